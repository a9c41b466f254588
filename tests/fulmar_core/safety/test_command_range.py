"""Controllers that mostly ask for more than the actuators can do."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.config.paths import config_names
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.command_range import LEAST_STEPS, CommandRange

BASE = load_robot("turtlebot2").actuators


def seen(actuators, actions) -> str:
    watch = CommandRange(actuators)
    watch.see(np.asarray(actions, dtype=float))
    return watch.warning


def test_commands_beyond_the_limits_in_most_steps_are_named_with_share_and_unit():
    actions = np.zeros((40, 2))
    actions[:30, 0] = 3.0
    warning = seen(BASE, actions)
    assert "in 75 % of 40 steps, at most speed 3 m/s, where the limit is 0.45" in warning


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_commands_beyond_them_in_some_steps_are_not(share):
    actions = np.zeros((40, 2))
    actions[: round(40 * share), 1] = 100.0
    assert not seen(BASE, actions)


def test_a_few_steps_say_nothing(steps=LEAST_STEPS - 1):
    assert not seen(BASE, np.full((steps, 2), 9.0))


def test_one_step_that_is_not_finite_hides_no_others():
    actions = np.full((40, 2), 9.0)
    actions[7, 1] = np.nan
    assert "in 100 % of 39 steps" in seen(BASE, actions)


def test_refused_actions_are_not_counted():
    assert not seen(BASE, np.full((40, 3), 9.0))
    assert not seen(BASE, np.full((40, 2), np.nan))


@pytest.mark.parametrize("name", ["cubesat_wheels", "airship_v7", "int_ball2", "kingfisher", "leatherback"])
def test_the_limits_themselves_are_within(name):
    actuators = load_robot(name).actuators
    for limit in (actuators.lowest, actuators.scale):
        assert not seen(actuators, np.tile(limit, (40, 1)))
    warning = seen(
        actuators, np.tile(actuators.scale * np.append(2.0, np.ones(len(actuators.names) - 1)), (40, 1))
    )
    assert f"at most {actuators.names[0]} " in warning
    assert f" {actuators.units[0]}, where" in warning


@pytest.mark.parametrize("name", config_names("robots"))
def test_every_actuator_has_a_unit(name):
    actuators = load_robot(name).actuators
    assert len(actuators.units) == len(actuators.names)
