"""Robots without a gains file: four altered air-bearing platforms, and a YAML of each family beside this file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from fulmar_core.config.paths import config_names, config_path
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot

# Tasks by robot; no law here parks a car.
TASKS = {
    "heavy_platform": "go_to_pose",
    "moved_nozzle_platform": "go_to_pose",
    "six_nozzle_platform": "go_to_pose",
    "unshared_platform": "go_to_pose",
    "raft": "go_to_pose",
    "courier": "go_to_pose",
    "skiff": "go_to_pose",
    "rally": "go_to_position",
    "fan_disc": "go_to_pose",
}


def new_robot(name: str) -> Robot:
    """A robot whose YAML lies beside this file."""
    return load_config(Robot, Path(__file__).parent / f"{name}.yaml")


def robots_of_every_family() -> dict[str, Robot]:
    """The robots that Fulmar comes with, and one of each further family, by their names."""
    shipped = {name: load_robot(name) for name in config_names("robots")}
    return shipped | {"fan_disc": new_robot("fan_disc")}


def write_new_robots(folder: Path) -> None:
    """Write `robots/<name>.yaml` of each robot below a folder that FULMAR_CONFIGS may name."""
    robots = folder / "robots"
    robots.mkdir(parents=True)
    for name in TASKS:
        own = Path(__file__).parent / f"{name}.yaml"
        text = own.read_text(encoding="utf-8") if own.exists() else yaml.safe_dump(_altered(name))
        (robots / f"{name}.yaml").write_text(text, encoding="utf-8")


def _altered(name: str) -> dict[str, Any]:
    """The shipped platform with one thing changed."""
    text = config_path("robots", "floating_platform").read_text(encoding="utf-8")
    robot = yaml.safe_load(text) | {"name": name, "title": name.replace("_", " ")}
    body, uncertainty, actuators = robot["body"], robot["uncertainty"], robot["actuators"]
    if name == "heavy_platform":
        body |= {"mass": 2.0 * body["mass"], "inertia": [2.0 * each for each in body["inertia"]]}
        uncertainty |= {key: [2.0 * each for each in uncertainty[key]] for key in ("mass", "yaw_inertia")}
    elif name == "moved_nozzle_platform":
        actuators["nozzles"][0]["position"] = [0.1, 0.2192031, 0.0]
    elif name == "six_nozzle_platform":
        del actuators["nozzles"][6:]
    else:
        actuators["shared_pressure"] = False
    return dict(robot)
