"""Requests that put a simulated robot elsewhere: what they give, and what they are refused for."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.state_requests import read_state, read_steps, state_fields

PLATFORM, CRAFT = load_robot("floating_platform"), load_robot("spacecraft_16")
LEVEL = {"position_m": [1.0, -2.0, 0.0], "quat_xyzw": [0.0, 0.0, math.sin(0.4), math.cos(0.4)]}


def test_a_place_gives_a_state_at_rest() -> None:
    state = read_state({"what": "place", "id": "1", "by": "test", **LEVEL}, PLATFORM)
    np.testing.assert_allclose(state.position_in_world, [1.0, -2.0, 0.0])
    assert float(state.yaw) == pytest.approx(0.8)
    assert not state.velocity_in_world.any() and not state.angular_velocity_in_body.any()


def test_the_fields_of_a_state_give_it_again() -> None:
    moving = {**LEVEL, "velocity_m_s": [0.1, 0.2, 0.0], "rate_rad_s": [0.0, 0.0, 0.3]}
    fields = state_fields(read_state(moving, PLATFORM))
    assert list(fields) == list(moving)
    for key, numbers in moving.items():
        assert fields[key] == pytest.approx(numbers)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"position_m": [1.0, 2.0]}, "'position_m' is .* must be 3 finite numbers"),
        ({"position_m": [1.0, math.nan, 0.0]}, "must be 3 finite numbers"),
        ({"position_m": [1e9, 0.0, 0.0]}, "within 100,000 m"),
        ({"quat_xyzw": [0.0, 0.0, 0.0, 2.0]}, "norm 2.000, must be 1"),
        ({"quat_xyzw": None}, "must be 4 finite numbers"),
        ({"velocity_m_s": [500.0, 0.0, 0.0]}, "'velocity_m_s' is 500 m/s, of 'floating_platform' at most"),
        ({"rate_rad_s": [0.0, 0.0, 500.0]}, "'rate_rad_s' is 500 rad/s"),
        ({"position_m": [0.0, 0.0, 0.5]}, "has no height, no roll and no pitch"),
        ({"quat_xyzw": [1.0, 0.0, 0.0, 0.0]}, "has no height, no roll and no pitch"),
        ({"positon_m": [0.0, 0.0, 0.0]}, "'position_m'"),
    ],
)
def test_a_state_that_cannot_be_is_refused(change: dict[str, object], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        read_state({**LEVEL, **change}, PLATFORM)


def test_a_robot_in_space_may_have_any_attitude_and_height() -> None:
    up = {"position_m": [0.0, 0.0, 3.0], "quat_xyzw": [1.0, 0.0, 0.0, 0.0], "rate_rad_s": [0.1, 0.0, 0.0]}
    assert read_state(up, CRAFT).position_in_world[2] == 3.0


@pytest.mark.parametrize("steps", [0, -1, 1.5, True, "3", 100_000])
def test_a_number_of_steps_that_is_none_is_refused(steps: object) -> None:
    with pytest.raises(ConfigError, match="whole number from 1 to 10000"):
        read_steps({"steps": steps})


def test_one_step_is_taken_where_no_number_is_given() -> None:
    assert read_steps({}) == 1
    assert read_steps({"steps": 7}) == 7
