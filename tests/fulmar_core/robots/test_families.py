"""What commands mean: propellers, two driven wheels, steered wheels; thrusters have their own file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.robots.actuators.ackermann import GRIP
from fulmar_core.robots.actuators.response import Response
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.gravity import GRAVITY

PROPELLERS = load_robot("kingfisher").actuators
DRIVE = load_robot("turtlebot2").actuators
CAR = load_robot("leatherback").actuators


def wrench(*command, gain=(1.0, 1.0)):
    return [
        float(value) for value in PROPELLERS.planar_wrench(np.array(command, dtype=float), np.array(gain))
    ]


def test_the_thrust_goes_through_every_point_of_its_curve_and_straight_between_them():
    commands = np.linspace(-1.0, 1.0, len(PROPELLERS.curve))
    np.testing.assert_allclose(PROPELLERS.thrust(commands), PROPELLERS.curve, rtol=0, atol=1e-12)
    between = 0.5 * (commands[1:] + commands[:-1])
    middle = 0.5 * (np.array(PROPELLERS.curve[1:]) + np.array(PROPELLERS.curve[:-1]))
    np.testing.assert_allclose(PROPELLERS.thrust(between), middle, rtol=0, atol=1e-12)


def test_nothing_happens_in_the_dead_band():
    # RAN robots_cfg/kingfisher_cfg.py has zeros from -0.4 to 0.2.
    assert not PROPELLERS.thrust(np.linspace(-0.4, 0.2, 50)).any()
    assert PROPELLERS.thrust(np.array([-0.41])) < 0.0 < PROPELLERS.thrust(np.array([0.21]))


def test_commands_beyond_full_give_full_thrust():
    assert PROPELLERS.thrust(np.array([-5.0, 5.0])).tolist() == [-4.0, 19.5]
    assert PROPELLERS.limited(np.array([-5.0, 0.3])).tolist() == [-1.0, 0.3]


def test_both_propellers_push_ahead_and_the_right_one_alone_turns_left():
    assert wrench(1.0, 1.0) == pytest.approx([39.0, 0.0, 0.0])
    assert wrench(0.0, 1.0) == pytest.approx([19.5, 0.0, 19.5 * 0.37765])
    assert wrench(1.0, 0.0, gain=(0.5, 1.0)) == pytest.approx([9.75, 0.0, -9.75 * 0.37765])


def test_the_curve_is_the_same_in_torch_and_for_a_batch():
    torch = pytest.importorskip("torch")
    command = np.random.default_rng(1).uniform(-1.2, 1.2, (2, 50))
    ours = PROPELLERS.planar_wrench(command, np.ones_like(command))
    theirs = PROPELLERS.planar_wrench(torch.as_tensor(command), torch.ones(2, 50, dtype=torch.float64))
    for a, b in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(b.numpy(), a, rtol=0, atol=1e-12)


def test_a_curve_that_falls_is_refused_and_so_are_propellers_of_one_name():
    with pytest.raises(ValueError, match="none less than the one before"):
        replace(PROPELLERS, curve=(0.0, 1.0, 0.5))
    with pytest.raises(ValueError, match="a name of its own"):
        replace(PROPELLERS, propellers=(PROPELLERS.propellers[0],) * 2)


def test_speed_and_turn_rate_of_a_base_are_cut_to_what_it_does():
    assert DRIVE.limited(np.array([9.0, -9.0])).tolist() == pytest.approx([0.45, -0.9])
    assert DRIVE.limited(np.array([0.1, 0.2])).tolist() == [0.1, 0.2]


def test_where_wheels_are_too_slow_the_path_stays_and_both_shrink():
    slow = replace(DRIVE, max_wheel_speed=10.0)
    command = np.array([0.45, 0.9])
    cut = slow.limited(command)
    assert cut[0] / cut[1] == pytest.approx(command[0] / command[1])
    assert np.abs(slow.wheel_speeds(cut)).max() == pytest.approx(10.0)


def test_turning_left_the_right_wheel_is_the_faster_one():
    left, right = DRIVE.wheel_speeds(np.array([0.0, 0.5]))
    assert left == pytest.approx(-right)
    assert right == pytest.approx(0.5 * 0.23 * 0.5 / 0.035)


def test_straight_ahead_both_wheels_roll_at_the_speed_of_the_base():
    assert DRIVE.wheel_speeds(np.array([0.35, 0.0])).tolist() == pytest.approx([10.0, 10.0])


def test_speed_and_steering_of_a_car_are_cut_each_by_itself():
    assert CAR.limited(np.array([[0.5, -9.0], [-9.0, 0.1]])).tolist() == [[0.5, -0.785], [-3.6, 0.1]]


def test_a_car_steers_less_the_faster_it_goes_so_that_its_tyres_hold():
    fast = np.array([[3.6, 0.785], [-3.6, -0.785], [2.0, 0.785]])
    speed, steering = CAR.limited(fast).T
    sideways = speed**2 * np.tan(steering) / CAR.wheelbase
    np.testing.assert_allclose(np.abs(sideways), GRIP * CAR.friction * GRAVITY)
    np.testing.assert_array_equal(np.sign(steering), np.sign(fast[:, 1]))


@pytest.mark.parametrize("actuators", [PROPELLERS, DRIVE, CAR], ids=lambda a: a.kind)
def test_limits_keep_the_floating_type_and_the_safe_command_is_within_them(actuators):
    command = np.ones((3, 2), dtype=np.float32)
    assert actuators.limited(command).dtype == np.float32
    safe = actuators.safe_command
    np.testing.assert_array_equal(actuators.limited(safe), safe)
    assert not actuators.binary


@pytest.mark.parametrize("actuators", [PROPELLERS, DRIVE, CAR], ids=lambda a: a.kind)
def test_torch_is_limited_as_numpy_is(actuators):
    torch = pytest.importorskip("torch")
    command = np.random.default_rng(2).normal(size=(20, 2)) * 3.0
    np.testing.assert_allclose(
        actuators.limited(torch.as_tensor(command)).numpy(), actuators.limited(command), atol=1e-12
    )


@pytest.mark.parametrize("actuators", [PROPELLERS, DRIVE, CAR], ids=lambda a: a.kind)
def test_a_slew_of_the_wrong_length_is_refused(actuators):
    with pytest.raises(ValueError, match="'slew' needs"):
        replace(actuators, response=Response(slew=(1.0, 1.0, 1.0)))


def test_what_slews_has_no_lag_beside_it_but_for_the_servos_of_wheels():
    both = Response(slew=(1.0, 1.0), lag_s=0.5)
    assert replace(DRIVE, response=both).response == both
    with pytest.raises(ValueError, match="not both"):
        replace(PROPELLERS, response=both)


def test_propellers_that_push_at_a_command_of_0_are_rejected():
    with pytest.raises(ValueError, match="'curve' must be 0 in its middle"):
        replace(PROPELLERS, curve=(0.0, 10.0, 20.0))


@pytest.mark.parametrize("change", [{"delay_s": -0.1}, {"lag_s": -0.1}, {"slew": (0.0, 1.0)}])
def test_responses_without_meaning_are_refused(change):
    with pytest.raises(ValueError, match="must"):
        Response(**change)


def test_sizes_of_wheels_have_to_be_positive_and_steering_below_a_quarter_turn():
    with pytest.raises(ValueError, match="greater than 0"):
        replace(DRIVE, track=0.0)
    with pytest.raises(ValueError, match=r"below 1\.57"):
        replace(CAR, max_steering=1.6)
