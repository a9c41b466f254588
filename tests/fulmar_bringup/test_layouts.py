"""The layouts for Foxglove show what the robots really publish."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from fulmar_core.actuators.pushing import Pushing
from fulmar_core.paths import config_names
from fulmar_core.robot import load_robot
from fulmar_core.topics import WIRES

LAYOUTS = Path(__file__).resolve().parents[2] / "ros2_ws/src/fulmar_bringup/layouts"
PANEL_OF = re.compile(r"^[A-Za-z0-9]+![a-z]+$")


def texts(value):
    if isinstance(value, dict):
        for key, part in value.items():
            yield key
            yield from texts(part)
    elif isinstance(value, list):
        for part in value:
            yield from texts(part)
    elif isinstance(value, str):
        yield value


def test_there_is_a_layout_for_every_robot():
    assert {path.stem for path in LAYOUTS.glob("*.json")} == set(config_names("robots"))


@pytest.mark.parametrize("path", sorted(LAYOUTS.glob("*.json")), ids=lambda path: path.stem)
def test_a_layout_names_only_topics_of_the_table_and_actuators_of_the_robot(path):
    layout = json.loads(path.read_text())
    robot = load_robot(path.stem)
    wires = {wire.name if wire.name.startswith("/") else f"/{path.stem}/{wire.name}" for wire in WIRES}
    named = [text for text in texts(layout) if text.startswith("/")]
    assert len(named) > 10
    for text in named:
        topic, _, field = text.partition(".")
        assert topic in wires, text
        index = re.match(r"effort\[(\d+)\]", field)
        assert index is None or int(index[1]) < len(robot.actuators.names)


@pytest.mark.parametrize("path", sorted(LAYOUTS.glob("*.json")), ids=lambda path: path.stem)
def test_every_panel_of_a_layout_is_configured_and_placed(path):
    layout = json.loads(path.read_text())
    placed = {text for text in texts(layout["layout"]) if PANEL_OF.match(text)}
    assert placed == set(layout["configById"])


@pytest.mark.parametrize("path", sorted(LAYOUTS.glob("*.json")), ids=lambda path: path.stem)
def test_the_plots_of_efforts_have_every_actuator_by_its_name(path):
    robot, panels = load_robot(path.stem), json.loads(path.read_text())["configById"]
    for topic in ("command", "state"):
        begins = f"/{path.stem}/actuators/{topic}.effort["
        shown = {
            line["value"]: line["label"]
            for panel in panels.values()
            for line in panel.get("paths", ())
            if line["value"].startswith(begins)
        }
        if shown or isinstance(robot.actuators, Pushing):  # wheels have velocities and no efforts
            assert shown == {f"{begins}{i}]": name for i, name in enumerate(robot.actuators.names)}
