"""Layouts of RViz and Foxglove show topics that exist, with their types, for every robot under every name."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import yaml

from fulmar_bringup.layouts.layout_file import PROGRAMS, layout_text, write_layout
from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.config.paths import config_names, config_path
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import (
    COMMAND,
    ESTOP_RESET,
    ESTOP_TRIGGER,
    VELOCITY_COMMAND,
    WIRES,
    Wire,
    command_wire,
)
from fulmar_ros.message_class import message_class

# What RViz's plugins_description.xml says that they receive, and its tools publish.
RVIZ_TYPES = {
    "RobotModel": "std_msgs/msg/String",
    "MarkerArray": "visualization_msgs/msg/MarkerArray",
    "Odometry": "nav_msgs/msg/Odometry",
    "Pose": "geometry_msgs/msg/PoseStamped",
    "PointStamped": "geometry_msgs/msg/PointStamped",
    "Path": "nav_msgs/msg/Path",
    "SetGoal": "geometry_msgs/msg/PoseStamped",
    "PublishPoint": "geometry_msgs/msg/PointStamped",
}
WITHOUT_TOPIC = {"Grid", "TF", "Interact", "MoveCamera", "Select", "FocusCamera", "Measure"}
PLUGIN = "rviz_default_plugins/"
PANEL = re.compile(r"[A-Za-z0-9]+![a-z]+")
STEP = re.compile(r'(?P<field>\w+)(?P<index>\[\d*:?\d*\])?(?P<filter>\{(?P<key>\w+)=="\w+"\})?')


@dataclass(frozen=True)
class Case:
    """A robot, as `fulmar layout` is given it."""

    robot: Robot
    given: str
    name: str | None

    @property
    def called(self) -> str:
        return self.name or self.robot.name

    def text(self, program: str) -> str:
        return layout_text(self.given, program, self.name)

    @property
    def foxglove(self) -> dict[str, Any]:
        return dict(json.loads(self.text("foxglove")))

    @property
    def rviz(self) -> dict[str, Any]:
        return dict(yaml.safe_load(self.text("rviz"))["Visualization Manager"])

    @property
    def wires(self) -> dict[str, Wire]:
        """By the full names of their topics."""
        return {w.name if w.name.startswith("/") else f"/{self.called}/{w.name}": w for w in WIRES}

    @property
    def odom(self) -> str:
        return "odom" if self.name is None else f"{self.name}/odom"


@pytest.fixture(params=["type", "name", "file"])
def case(request: pytest.FixtureRequest, robot: str, tmp_path: Path) -> Case:
    """A robot called as its type, one with a name of its own, and one of a file outside of every folder of files."""
    if request.param != "file":
        return Case(load_robot(robot), robot, "alpha" if request.param == "name" else None)
    text = config_path("robots", robot).read_text(encoding="utf-8").replace(f"name: {robot}", "name: mine", 1)
    path = tmp_path / "mine.yaml"
    path.write_text(text, encoding="utf-8")
    layout = viewed(path)
    return Case(layout, str(path), None)


def viewed(path: Path) -> Robot:
    from fulmar_bringup.layouts.viewed_robot import viewed_robot

    found = viewed_robot(str(path))
    assert found.name == found.robot.name == "mine"
    return found.robot


@pytest.fixture(params=config_names("robots"))
def robot(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def texts(value: Any) -> Iterator[str]:
    """Every text of a layout, and every key."""
    if isinstance(value, dict):
        for key, part in value.items():
            yield key
            yield from texts(part)
    elif isinstance(value, list):
        for part in value:
            yield from texts(part)
    elif isinstance(value, str):
        yield value


def paths_of(layout: dict[str, Any]) -> list[tuple[str, str]]:
    """Path into messages and label of every line."""
    panels = layout["configById"].values()
    return [(line["value"], line["label"]) for panel in panels for line in panel.get("paths", ())]


def number_at(path: str, wires: dict[str, Wire]) -> type:
    """Type of the value at the end of a path such as `/boat/odom.twist.twist.linear.x`."""
    topic, _, fields = path.partition(".")
    kind = message_class(wires[topic])
    assert kind is not None
    value: Any = kind()
    for step in re.findall(r"\w+(?:\[[^\]]*\])?(?:\{[^}]*\})?", fields):
        match = STEP.fullmatch(step)
        assert match is not None, path
        declared = value.get_fields_and_field_types()[match["field"]]
        inner = re.fullmatch(r"sequence<(.+)>", declared)
        assert bool(inner) == bool(match["index"]), path  # a list needs an index, and nothing else has one
        declared = inner[1] if inner else declared
        if "/" not in declared:
            return {"double": float, "string": str}[declared]
        package, _, name = declared.partition("/")
        value = getattr(__import__(f"{package}.msg", fromlist=[name]), name)()
        assert not match["filter"] or match["key"] in value.get_fields_and_field_types()
    raise AssertionError(f"{path} ends at a message")


def test_every_topic_and_service_of_a_foxglove_layout_exists(case):
    layout = case.foxglove
    services = {f"/{case.called}/{name}" for name in (ESTOP_TRIGGER, ESTOP_RESET)}
    named = {text.partition(".")[0] for text in texts(layout) if re.match(r"/[a-z]", text)}
    assert named <= case.wires.keys() | services
    assert services <= named
    scene = layout["configById"]["3D!scene"]
    assert {f"/{case.called}/{name}" for name in ("odom", "goal_pose", "markers", "obstacles")} <= {
        *scene["topics"]
    }
    assert scene["layers"]["robot"]["topic"] == f"/{case.called}/robot_description"
    assert scene["followTf"] == case.odom


def test_every_line_of_a_foxglove_layout_ends_at_a_field_of_the_topics_message(case):
    lines = paths_of(case.foxglove)
    assert len(lines) > 5
    for path, _label in lines:
        assert number_at(path, case.wires) in (float, str)


def test_foxglove_publishes_goals_of_the_type_of_their_topic(case):
    panel = case.foxglove["configById"]["Publish!goal"]
    wire = case.wires[panel["topicName"]]
    assert panel["datatype"] == wire.type == "geometry_msgs/msg/PoseStamped"
    message = json.loads(panel["value"])
    assert message["header"]["frame_id"] == case.odom
    assert message["pose"]["orientation"] == {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
    click = case.foxglove["configById"]["3D!scene"]["publish"]
    assert case.wires[click["poseTopic"]].type == "geometry_msgs/msg/PoseStamped"
    assert case.wires[click["pointTopic"]].type == "geometry_msgs/msg/PointStamped"


def test_every_panel_of_a_foxglove_layout_is_configured_and_placed_once(case):
    layout = case.foxglove
    placed = [text for text in texts(layout["layout"]) if PANEL.fullmatch(text)]
    assert sorted(placed) == sorted(layout["configById"])


def test_a_foxglove_layout_plots_every_actuator_by_its_name(case):
    shown = {path: label for path, label in paths_of(case.foxglove)}
    names = case.robot.actuators.names
    for number, name in enumerate(names):
        assert shown[f"/{case.called}/actuators/state.effort[{number}]"] == name
    commands = {path: label for path, label in shown.items() if command_wire(case.robot).name in path}
    assert [*commands.values()] == [*names]
    if command_wire(case.robot) is COMMAND:
        assert [*commands] == [f"/{case.called}/actuators/command.effort[{i}]" for i in range(len(names))]
    else:
        assert command_wire(case.robot) is VELOCITY_COMMAND
        assert [*commands] == [f"/{case.called}/cmd_vel.twist.{end}" for end in ("linear.x", "angular.z")]


def topics_of(rviz: dict[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    """Class and topic of each display and tool that has one."""
    found = []
    for part in (*rviz["Displays"], *rviz["Tools"]):
        kind = part["Class"].removeprefix(PLUGIN)
        topic = part.get("Topic") or part.get("Description Topic")
        assert (topic is None) == (kind in WITHOUT_TOPIC), part
        if topic is not None:
            found.append((kind, topic))
    return found


def test_every_display_and_tool_of_rviz_has_a_topic_of_its_type(case):
    rviz = case.rviz
    found = topics_of(rviz)
    for kind, topic in found:
        assert case.wires[topic["Value"]].type == RVIZ_TYPES[kind], topic
    assert {kind for kind, _ in found} == RVIZ_TYPES.keys()
    assert rviz["Global Options"]["Fixed Frame"] == case.odom


def test_the_quality_of_service_that_rviz_asks_for_matches_every_publisher_of_the_topic(case):
    for kind, topic in topics_of(case.rviz):
        wire = case.wires[topic["Value"]]
        if topic["Reliability Policy"] == "Reliable":
            assert wire.delivery != "best_effort"
        if topic["Durability Policy"] == "Transient Local":  # operators publish volatile, too
            assert wire.delivery == "latched"
            assert wire.source != "operator"
        if (
            kind in ("RobotModel", "MarkerArray") and wire.source != "operator"
        ):  # published once: for those who come later
            assert topic["Durability Policy"] == "Transient Local"


@pytest.mark.parametrize(("program", "file"), [("rviz", "alpha.rviz"), ("foxglove", "alpha.json")])
def test_a_layout_is_written_once_and_says_how_it_is_opened(tmp_path, monkeypatch, program, file):
    monkeypatch.chdir(tmp_path)
    path, opening = write_layout("turtlebot2", program, "alpha")
    assert path == Path(file)
    assert file in opening
    assert path.read_text() == layout_text("turtlebot2", program, "alpha")
    with pytest.raises(ConfigError, match=f"{file} exists already.*--force"):
        write_layout("turtlebot2", program, "alpha")
    path.write_text("mine")
    write_layout("turtlebot2", program, "alpha", force=True)
    assert path.read_text() != "mine"


def test_a_folder_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="is no folder"):
        write_layout("turtlebot2", "rviz", file=tmp_path / "nowhere" / "a.rviz")


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        (("turtlebott2", "rviz", None), "Did you mean 'turtlebot2'"),
        (("turtlebot2", "rvis", None), "Did you mean 'rviz'"),
        (("turtlebot2", "rviz", "Alpha"), "the name 'Alpha' of a robot"),
        (("nothing.yaml", "rviz", None), "nothing.yaml: cannot be read"),
    ],
)
def test_a_mistake_has_one_line_with_what_is_allowed(asked, message):
    with pytest.raises(ConfigError, match=re.escape(message)) as caught:
        layout_text(*asked)
    assert "\n" not in str(caught.value)


def test_every_program_is_known_by_a_name():
    assert {*PROGRAMS} == {"rviz", "foxglove"}
    with pytest.raises(UnknownNameError):
        layout_text("turtlebot2", "gazebo")
