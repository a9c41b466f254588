"""Sensors that a driver of the user's own class reports."""

from __future__ import annotations

import re

import numpy as np
import pytest
import yaml

from fulmar_core.config.errors import DeviceError
from fulmar_core.config.paths import config_path
from tests.hardware_drivers.own_board import PLATFORM, made, with_method

STARS = """from fulmar_core.wires.reading import Reading
        from hardware_drivers.feedback import Report
        return Report(None, None, 7, {{{name!r}: {reading}}})"""


def starry(folder, monkeypatch, name="star_tracker", reading="Reading((0.0, 0.6, 0.0, 0.8), stamp_ns=5)"):
    """The device of a robot with a star tracker, whose class reports it."""
    robot = yaml.safe_load(config_path("robots", PLATFORM).read_text(encoding="utf-8"))
    robot["sensors"]["star_tracker"] = {"std": 1e-4}
    (folder / "robots").mkdir()
    (folder / "robots" / "starry.yaml").write_text(yaml.safe_dump(robot | {"name": "starry"}))
    monkeypatch.setenv("FULMAR_CONFIGS", str(folder))
    return made(folder, with_method("read(self)", STARS.format(name=name, reading=reading)), "starry")[0]


def test_a_class_reports_any_sensor_of_the_table_that_its_robot_has(folder, monkeypatch):
    sample = starry(folder, monkeypatch).step(np.zeros(8))
    assert sample.odometry is None and sample.imu is None
    assert sample.stamp_ns == 7
    assert sample.readings["star_tracker"].value == (0.0, 0.6, 0.0, 0.8)
    assert sample.readings["star_tracker"].stamp_ns == 5


@pytest.mark.parametrize(
    ("name", "reading", "says"),
    [
        ("star_traker", "Reading((0, 0, 0, 1))", "'star_traker' is no sensor. Did you mean 'star_tracker'?"),
        ("star_tracker", "(0, 0, 0, 1)", "'star_tracker' is tuple, which must be a Reading"),
        ("star_tracker", "Reading((0, 0, 1))", "ValueError: [0.0, 0.0, 1.0] must be a unit quaternion"),
        ("imu", "Reading(None)", "'imu' is a field of a report of its own: Report(imu=...)."),
    ],
)
def test_a_reading_that_cannot_be_published_is_one_line_with_its_name(
    folder, monkeypatch, name, reading, says
):
    device = starry(folder, monkeypatch, name, reading)
    with pytest.raises(DeviceError, match=rf"^driver 'own_board:Board': read .*{re.escape(says)}") as caught:
        device.step(np.zeros(8))
    assert "\n" not in str(caught.value)


def test_a_sensor_that_the_robot_s_file_does_not_name_is_refused(folder):
    code = with_method("read(self)", STARS.format(name="star_tracker", reading="Reading((0, 0, 0, 1))"))
    device, _ = made(folder, code)
    with pytest.raises(DeviceError, match="is no sensor of this robot: add 'star_tracker:' below 'sensors:'"):
        device.step(np.zeros(8))
