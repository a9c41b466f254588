"""Each robot's URDF makes the robot again, from a robot of the same family with another body in other places."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fulmar_core.config.paths import config_names, config_path
from fulmar_core.config.yaml_text import dump, load
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.urdf import body_frames, urdf_of
from fulmar_evaluation.new_robot.new_robot import make_robot
from fulmar_evaluation.new_robot.urdf_reader import read_urdf

EACH = pytest.mark.parametrize("name", config_names("robots"))
OTHER = "other"


def scaled(values: list[float], factor: float) -> list[float]:
    return [factor * each for each in values]


def write_other(folder: Path, name: str) -> None:
    """A robot of the same family whose body, and whatever has a place on it, differ."""
    robot: dict[str, Any] = load(config_path("robots", name).read_text(encoding="utf-8"))
    body, spans, actuators = robot["body"], robot["uncertainty"], robot["actuators"]
    body |= {"mass": 1.1 * body["mass"], "inertia": scaled(body["inertia"], 1.1)}
    body |= {"radius": 1.05 * body["radius"], "height": 0.95 * body["height"]}
    if "footprint" in body:
        body["footprint"] = scaled(body["footprint"], 1.03)
    if "center_of_mass" in body:
        body["center_of_mass"] = scaled(body["center_of_mass"], 0.5)
    for key in ("mass", "yaw_inertia"):
        spans[key] = scaled(spans[key], 1.1)
    for key in ("nozzles", "fans", "propellers"):
        for part in actuators.get(key, []):
            part["position"] = scaled(part["position"], 0.9)
            if "direction" in part:
                part["direction"] = [part["direction"][2], *part["direction"][:2]]
    for wheel in actuators.get("wheels", []):
        wheel["axis"] = [wheel["axis"][2], *wheel["axis"][:2]]
    for key in ("wheel_radius", "track", "wheelbase", "caster_x"):
        if key in actuators:
            actuators[key] *= 1.03
    if isinstance(robot["sensors"].get("camera"), dict):
        robot["sensors"]["camera"]["mount"] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    robot |= {"name": OTHER, "title": OTHER}
    (folder / "robots").mkdir()
    (folder / "robots" / f"{OTHER}.yaml").write_text(dump(robot), encoding="utf-8")


@pytest.fixture
def made(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Robot, Robot]:
    """A robot, and what is made from its URDF."""
    robot = load_robot(name)
    write_other(tmp_path, name)
    monkeypatch.setenv("FULMAR_CONFIGS", str(tmp_path))
    file = tmp_path / "robot.urdf"
    file.write_text(urdf_of(robot), encoding="utf-8")
    return robot, make_robot("again", OTHER, {}, read_urdf(file)).robot


@EACH
def test_mass_inertia_and_centre_of_mass_are_equal(made):
    robot, again = made
    assert again.body.mass == robot.body.mass
    assert again.body.tensor == robot.body.tensor
    assert again.body.com == robot.body.com


@EACH
def test_frames_are_equal(made):
    frames, found = (body_frames(robot) for robot in made)
    assert [frame.name for frame in found] == [frame.name for frame in frames]
    for frame, other in zip(frames, found, strict=True):
        np.testing.assert_allclose(other.position, frame.position, atol=1e-9)
        turn = np.abs(np.dot(other.quat_xyzw, frame.quat_xyzw))
        assert turn == pytest.approx(1.0, abs=1e-12)


@EACH
def test_the_hull_is_equal_and_its_circle_is_one_around_it(made):
    robot, again = made
    assert again.body.footprint == robot.body.footprint
    assert again.body.footprint_x == pytest.approx(robot.body.footprint_x, abs=1e-12)
    assert again.body.height == pytest.approx(robot.body.height, abs=1e-9)
    if robot.body.footprint is None:
        assert again.body.radius == robot.body.radius
    else:
        assert again.body.radius == pytest.approx(0.5 * np.hypot(*robot.body.footprint), abs=1e-3)
