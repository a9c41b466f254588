"""Robots of one type with names of their own, in one ROS domain."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest
from nav_msgs.msg import Odometry

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import messages
from fulmar_bags.run_record import read_run
from fulmar_core.config.errors import DONE, FAILED
from fulmar_core.robots.topics import CLOCK, GOAL_POSE, IMU, ODOMETRY, TRUTH
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.qos import subscriber_qos
from fulmar_ros.runtime import spinning
from sim_nodes.sim_node import make_backend
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of, start_fulmar, tripped, under_way
from tests.ros.neighbour import NAMESPACE, ROBOT, Neighbour, until

pytestmark = pytest.mark.real_time

GOALS = {"alpha": (0.5, 0.0, 0.0), "beta": (0.0, 0.5, 0.0)}
MESSAGES = 100  # in a bag, when its run is under way


@pytest.fixture
def beta(plant: PlantNode) -> Iterator[PlantNode]:
    """A second plant of the same type, beside one without a name of its own."""
    node = PlantNode(
        make_backend, lambda _code: None, cli_args=["--ros-args", "-r", "__ns:=/beta", "-p", "backend:=mock"]
    )
    with spinning(node, lambda error: pytest.fail(repr(error))):
        yield node
        node.stop()


def test_a_second_plant_has_its_own_frames_and_leaves_the_clock_to_the_first(
    neighbour: Neighbour, beta: PlantNode
) -> None:
    odometry: dict[str, Odometry] = {}
    for space in (NAMESPACE, "/beta"):

        def keep(message: Odometry, space: str = space) -> None:
            odometry[space] = message

        neighbour.node.create_subscription(
            Odometry, f"{space}/{ODOMETRY.name}", keep, subscriber_qos(ODOMETRY)
        )
    until(lambda: len(odometry) == 2)
    frames = {space: (m.header.frame_id, m.child_frame_id) for space, m in odometry.items()}
    assert frames == {NAMESPACE: ("odom", "base_link"), "/beta": ("beta/odom", "beta/base_link")}
    clocks = beta.get_publishers_info_by_topic(CLOCK.name)
    assert [info.node_namespace for info in clocks] == [NAMESPACE]


def start(name: str, env: dict[str, str], cwd: Path) -> psutil.Popen:
    """Start a run of a named robot, and wait until it is under way."""
    goal = ",".join(map(str, GOALS[name]))
    asked = ("--controller", "lqr", "--start", "0,0,0", "--goal", goal, "--duration", "20", "--json")
    run = start_fulmar("run", ROBOT, "--name", name, *asked, "--record", name, env=env, cwd=cwd)
    under_way(run, cwd / name, MESSAGES)
    return run


def run_both(env: dict[str, str], cwd: Path) -> tuple[dict[str, str], dict[str, str], str]:
    """Run both at once, beta a moment later; standard outputs and errors by name, and what a wrong name gets."""
    runs = {name: start(name, env, cwd) for name in GOALS}
    lost = fulmar("swap", "gamma", "bundle", env=env, cwd=cwd)
    assert lost.returncode == FAILED
    said = {name: run.communicate(timeout=60.0) for name, run in runs.items()}
    outs = {name: out for name, (out, _) in said.items()}
    return outs, {name: err for name, (_, err) in said.items()}, lost.stderr


@pytest.mark.slow
@pytest.mark.timeout(240)
def test_two_named_robots_of_one_type_reach_their_own_goals_in_one_domain(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    """A watchdog that trips on a busy machine, as it must, gives them a second try."""
    outs, errors, lost = run_both(ros_domain.env, tmp_path)
    if any(map(tripped, outs.values())):
        for name in GOALS:
            shutil.rmtree(tmp_path / name)
        outs, errors, lost = run_both(ros_domain.env, tmp_path)
    assert "no controller of 'gamma' runs" in lost
    assert lost.strip().endswith("Running robots: alpha, beta.")
    assert "/alpha/plant publishes /clock already: this plant leaves it out" in errors["beta"]
    assert "/clock" not in errors["alpha"]
    for name, goal in GOALS.items():
        summary = json_of(outs[name])
        assert (summary["success"], summary["robot"], summary["name"]) == (True, ROBOT, name)
        record = read_run(tmp_path / name)
        assert not record.warnings
        assert record.truth.position[-1, :2] == pytest.approx(goal[:2], abs=0.1)
        bag = open_bag(tmp_path / name)
        first = {wire: messages(bag.of(wire))[0][1] for wire in (ODOMETRY, TRUTH, IMU, GOAL_POSE)}
        found = {wire.name: message.header.frame_id for wire, message in first.items()}
        assert found == {
            "odom": f"{name}/odom",
            "ground_truth/odom": "map",
            "imu/data": f"{name}/imu_link",
            "goal_pose": f"{name}/odom",
        }
        assert first[ODOMETRY].child_frame_id == first[TRUTH].child_frame_id == f"{name}/base_link"
        info = fulmar("bag", "info", name, "--json", env=ros_domain.env, cwd=tmp_path)
        reported = json_of(info.stdout)
        assert (reported["damage"], reported["provenance"]["name"]) == ([], name)
        assert {topic["name"].split("/")[1] for topic in reported["topics"]} == {name, "clock", "diagnostics"}
        again = fulmar("bag", "rerun", name, "--tolerance", "1e-9", env=ros_domain.env, cwd=tmp_path)
        assert again.returncode == DONE, again.stdout
    report = fulmar("report", *GOALS, env=ros_domain.env, cwd=tmp_path)
    assert report.returncode == DONE, report.stderr
