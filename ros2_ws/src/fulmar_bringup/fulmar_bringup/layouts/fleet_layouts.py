"""Layouts of a fleet: every robot in one scene, made of the layouts of the robots."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import yaml

from fulmar_bringup.fleet_file import load_fleet
from fulmar_bringup.layouts.foxglove_layout import SCENE, foxglove_layout
from fulmar_bringup.layouts.rviz_layout import rviz_layout
from fulmar_bringup.layouts.viewed_robot import ViewedRobot, viewed_robot
from fulmar_core.config.yaml_text import load

ROOM = "map"  # frame that all robots of a fleet share
TABS = "Tab!robots"
OF_ALL = ("Grid", "TF")  # displays that one of is enough
GIVES = ("SetGoal", "PublishPoint")  # tools that each robot has of its own


def robots_of(fleet: str) -> list[ViewedRobot]:
    """The robots of a fleet, as viewers find them.

    Raises:
        ConfigError: As in `load_fleet`.
    """
    return [viewed_robot(row.robot, row.called) for row in load_fleet(fleet).robots]


def fleet_rviz(robots: Sequence[ViewedRobot]) -> str:
    """A configuration of RViz 2 with a group of displays, and tools that give goals, for each robot."""
    whole, *others = (load(rviz_layout(robot)) for robot in robots)
    manager = whole["Visualization Manager"]
    every = [layout["Visualization Manager"] for layout in (whole, *others)]
    shared = [display for display in manager["Displays"] if display["Name"] in OF_ALL]
    groups = [
        {
            "Class": "rviz_common/Group",
            "Name": robot.name,
            "Enabled": True,
            "Displays": [display for display in own["Displays"] if display["Name"] not in OF_ALL],
        }
        for robot, own in zip(robots, every, strict=True)
    ]
    manager["Displays"] = shared + groups
    manager["Global Options"]["Fixed Frame"] = ROOM
    manager["Tools"] += [tool for own in every[1:] for tool in own["Tools"] if tool["Class"].endswith(GIVES)]
    return yaml.safe_dump(whole, sort_keys=False)


def fleet_foxglove(robots: Sequence[ViewedRobot]) -> str:
    """A layout for Foxglove: one scene with every robot, and a tab of plots and buttons for each."""
    layouts = {robot.name: json.loads(foxglove_layout(robot)) for robot in robots}
    panels: dict[str, Any] = {}
    tabs = []
    for name, own in layouts.items():
        panels |= {f"{key}_{name}": panel for key, panel in own["configById"].items() if key != SCENE}
        tabs.append({"title": name, "layout": _without_scene(own["layout"], name)})
    panels[SCENE] = _scene_of_all([own["configById"][SCENE] for own in layouts.values()], list(layouts))
    panels[TABS] = {"activeTabIdx": 0, "tabs": tabs}
    whole = next(iter(layouts.values()))
    placed = {"direction": "row", "first": SCENE, "second": TABS, "splitPercentage": 45}
    return json.dumps({**whole, "configById": panels, "layout": placed}, indent=2) + "\n"


def _without_scene(placed: Any, name: str) -> Any:
    """Where the panels of one robot are, without the scene."""
    if isinstance(placed, str):
        return None if placed == SCENE else f"{placed}_{name}"
    first, second = (_without_scene(placed[part], name) for part in ("first", "second"))
    if first is None or second is None:
        return second if first is None else first
    return {**placed, "first": first, "second": second}


def _scene_of_all(scenes: Sequence[dict[str, Any]], names: Sequence[str]) -> dict[str, Any]:
    """One scene in the frame of the room; a click gives a goal to the first robot."""
    whole = dict(scenes[0])
    for key in ("topics", "transforms"):
        whole[key] = {name: value for scene in scenes for name, value in scene[key].items()}
    whole["transforms"][f"frame:{ROOM}"] = {"visible": True}
    grid = {**scenes[0]["layers"]["grid"], "frameId": ROOM}
    robots = {
        f"robot_{name}": {**scene["layers"]["robot"], "instanceId": f"robot_{name}"}
        for name, scene in zip(names, scenes, strict=True)
    }
    return {**whole, "followTf": ROOM, "layers": {"grid": grid, **robots}}
