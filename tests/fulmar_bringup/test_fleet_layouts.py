"""Layouts of a fleet have every robot once, in the frame that all share."""

from __future__ import annotations

import json

import pytest
import yaml

from fulmar_bringup.layouts.layout_file import layout_text
from fulmar_core.config.errors import ConfigError

NAMES = ("alpha", "beta", "boat")


def test_rviz_has_a_group_of_displays_and_a_tool_for_goals_for_each_robot():
    manager = yaml.safe_load(layout_text("fleet", "rviz", fleet=True))["Visualization Manager"]
    assert manager["Global Options"]["Fixed Frame"] == "map"
    groups = {each["Name"]: each["Displays"] for each in manager["Displays"] if "Displays" in each}
    assert tuple(groups) == NAMES
    for name, displays in groups.items():
        topics = [each["Topic"]["Value"] for each in displays if "Topic" in each]
        assert topics and all(topic.startswith(f"/{name}/") for topic in topics)
    assert sum(each["Name"] == "Grid" for each in manager["Displays"]) == 1
    goals = [tool["Topic"]["Value"] for tool in manager["Tools"] if tool["Class"].endswith("/SetGoal")]
    assert goals == [f"/{name}/goal_pose" for name in NAMES]


def test_foxglove_shows_every_robot_in_one_scene_and_has_a_tab_for_each():
    layout = json.loads(layout_text("fleet", "foxglove", fleet=True))
    panels = layout["configById"]
    scene = panels["3D!scene"]
    assert scene["followTf"] == "map"
    assert {f"/{name}/odom" for name in NAMES} <= set(scene["topics"])
    assert [key for key in scene["layers"] if key.startswith("robot_")] == [f"robot_{name}" for name in NAMES]
    tabs = panels["Tab!robots"]["tabs"]
    assert tuple(tab["title"] for tab in tabs) == NAMES

    def leaves(placed):
        return [placed] if isinstance(placed, str) else leaves(placed["first"]) + leaves(placed["second"])

    shown = [leaf for tab in tabs for leaf in leaves(tab["layout"])]
    assert sorted([*shown, "3D!scene", "Tab!robots"]) == sorted(panels)
    assert panels["CallService!stop_boat"]["serviceName"] == "/boat/estop/trigger"


def test_a_system_of_one_robot_has_no_layout_of_a_fleet():
    with pytest.raises(ConfigError, match="'mujoco_lqr' is of one robot, and no fleet"):
        layout_text("mujoco_lqr", "rviz", fleet=True)
