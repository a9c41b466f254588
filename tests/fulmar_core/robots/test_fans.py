"""Fans: what a robot's file may say of them, and what their commands do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import yaml

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import OWN_FOLDERS
from fulmar_core.robots.actuators.fans import Fan
from fulmar_core.robots.actuators.response import Response
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.worlds.holdability import can_hold, uncontrollable_losses
from tests.new_robots import new_robot, write_new_robots

DISC = new_robot("fan_disc")
FANS = DISC.actuators


def test_a_fan_gives_its_share_of_the_full_thrust_whatever_the_others_do():
    assert FANS.thrusts(np.array([1.0, 0.5, 0.0, 1.0, 0.0, 0.0])).tolist() == [0.5, 0.25, 0.0, 0.5, 0.0, 0.0]


def test_a_fan_pushes_one_way_and_no_harder_than_it_can():
    assert FANS.limited(np.array([-1.0, 2.0, 0.3])).tolist() == [0.0, 1.0, 0.3]
    assert FANS.thrusts(np.array([-0.1, 1.1])).tolist() == [0.0, 0.5]  # with what noise adds


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"thrust": 0.0}, "'thrust' must be greater than 0"),
        ({"fans": ()}, "'fans' has no fan"),
        ({"fans": (FANS.fans[0], FANS.fans[0])}, "'fans' has 2 with the name 'fan_1'"),
        ({"response": Response(slew=(1.0,))}, "'slew' needs 6 values, one for each fan"),
        ({"response": Response(slew=(1.0,) * 6, lag_s=0.1)}, "not both"),
    ],
)
def test_fans_that_cannot_be_are_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        replace(FANS, **changes)


def test_a_fan_without_a_direction_is_refused():
    with pytest.raises(ValueError, match="fan 'a': 'direction' must not be zero"):
        Fan("a", (0.1, 0.0, 0.0), (0.0, 0.0, 0.0))


def changed(tmp_path, monkeypatch, **changes):
    """The robot with other actuators, loaded by its name."""
    write_new_robots(tmp_path)
    path = tmp_path / "robots/fan_disc.yaml"
    robot = yaml.safe_load(path.read_text(encoding="utf-8"))
    robot["actuators"] |= changes
    path.write_text(yaml.safe_dump(robot), encoding="utf-8")
    monkeypatch.setenv(OWN_FOLDERS, str(tmp_path))
    return load_robot("fan_disc")


def test_a_robot_with_fans_is_loaded_by_its_name(tmp_path, monkeypatch):
    assert changed(tmp_path, monkeypatch) == DISC


def test_a_fan_far_from_the_body_is_a_mistake_of_units(tmp_path, monkeypatch):
    far = {"name": "fan_1", "position": [110.0, 0.0, 0.0], "direction": [1.0, 0.0, 0.0]}
    with pytest.raises(ConfigError, match=r"actuators\.fans\.0\.position.*is not plausible.*Is it in mm\?"):
        changed(tmp_path, monkeypatch, fans=[far])


def test_an_unknown_family_is_refused_with_the_nearest_one(tmp_path, monkeypatch):
    with pytest.raises(
        ConfigError, match=r"fan_disc\.yaml:\d+: 'kind' = 'fan' is not known\. Did you mean 'fans'\?"
    ):
        changed(tmp_path, monkeypatch, kind="fan")


def test_a_key_of_another_family_is_refused(tmp_path, monkeypatch):
    with pytest.raises(ConfigError, match=r"fan_disc\.yaml:\d+: unknown key 'shared_pressure'"):
        changed(tmp_path, monkeypatch, shared_pressure=False)


def test_a_pose_is_held_without_some_fans_and_not_without_others():
    assert can_hold(DISC)
    assert can_hold(DISC, force=(0.2, -0.1), torque=0.02, heading=0.4)
    assert not can_hold(DISC, force=(2.0, 0.0))
    lost = uncontrollable_losses(DISC, 2)
    assert 0 < len(lost) < 15
    assert all(not can_hold(DISC, each) for each in lost)
