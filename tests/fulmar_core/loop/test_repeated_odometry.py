"""Odometry that repeats itself to the last bit: a stuck sensor, or encoders of a robot that stands."""

from __future__ import annotations

import pytest

from fulmar_core.loop.controller_settings import ControllerSettings
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.input_gate import FROZEN_AFTER, Measurement
from tests.states import planar_state

ROBOT, MS = load_robot("floating_platform"), 1_000_000


def problems(settings: ControllerSettings, times: int) -> list[str | None]:
    """What a controller's gate says of one pose that comes again and again at 50 Hz."""
    gate = settings.input_gate(ROBOT)
    state = planar_state(1.0, 0.0, 0.0)
    return [gate.problem(Measurement(n * 20 * MS, "odom", "base_link", state)) for n in range(1, times + 1)]


def test_a_sensor_that_repeats_itself_is_stuck() -> None:
    found = problems(ControllerSettings(), 2 * FROZEN_AFTER)
    assert not any(found[: FROZEN_AFTER - 1])
    assert "stuck" in str(found[-1])


def test_encoders_of_a_base_that_has_stood_for_long_are_believed() -> None:
    """Only motion could change them."""
    assert not any(problems(ControllerSettings(odometry_may_repeat=True), 20 * FROZEN_AFTER))


def test_more_copies_than_fit_into_a_period_are_refused() -> None:
    with pytest.raises(ValueError, match="copies = 4 must be from 1 to 3"):
        ControllerSettings(copies=4)
