"""A person's hand: keys and gamepads to commands, with a dead-man switch."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from fulmar_core.config.paths import config_names
from fulmar_core.loop.teleop import (
    JOY_LASTS_NS,
    KEY_HOLDS_NS,
    NOTHING,
    Gamepad,
    JoyLayout,
    Keyboard,
    Wish,
    hand_mapping,
    keys_help,
    letting_go,
)
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.planar import PlanarState
from tests.simulations import build
from tests.spaces import pushes_within_its_plane

ROBOTS = pytest.mark.parametrize(
    "robot",
    [
        robot
        for robot in map(load_robot, config_names("robots"))
        if robot.state_type is PlanarState or pushes_within_its_plane(robot)
    ],
    ids=lambda r: r.name,
)
CRAFT = load_robot("spacecraft_16")
BY_HAND = hand_mapping(CRAFT)
AXES, HELD, LET_GO = [0.0, 1.0, 0.0, 0.0], [0, 0, 0, 0, 1, 0], [0, 0, 0, 0, 0, 0]


@ROBOTS
def test_no_wish_is_the_safe_command(robot):
    assert hand_mapping(robot)(NOTHING).tolist() == robot.actuators.safe_command.tolist()


@ROBOTS
@pytest.mark.parametrize("wish", [Wish(ahead=1.0), Wish(turn=-1.0), Wish(ahead=-0.5, turn=0.3)])
def test_every_robot_can_be_driven_within_its_limits(robot, wish):
    command = hand_mapping(robot)(wish)
    assert command.any()
    assert np.asarray(robot.actuators.limited(command)) == pytest.approx(command)


@pytest.mark.parametrize("name", ["floating_platform", "modular_freeflyer"])
def test_valves_push_where_the_hand_points(name):
    thrusters = load_robot(name).actuators
    for wish, axis, sign in ((Wish(ahead=1.0), 0, 1), (Wish(left=-1.0), 1, -1)):
        force, _ = thrusters.wrench_in_body(hand_mapping(load_robot(name))(wish))
        assert sign * force[axis] > 0.3
    _, torque = thrusters.wrench_in_body(hand_mapping(load_robot(name))(Wish(turn=1.0)))
    assert torque[2] > 0.1


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3))
def test_a_hand_in_space_opens_no_valve_that_pushes_out_of_its_plane(parts):
    """With one pressure line for all, such a valve would only be opened to take thrust from the others."""
    force, torque = CRAFT.actuators.wrench_in_body(BY_HAND(Wish(*parts)))
    assert [force[2], *torque[:2]] == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)


def test_a_boat_turns_left_with_its_right_propeller():
    left, right = hand_mapping(load_robot("kingfisher"))(Wish(turn=0.6))
    assert right > 0.0 > left


def test_a_key_holds_for_as_long_as_a_terminal_needs_to_repeat_it_and_no_longer():
    keys = Keyboard()
    keys.press("w", 0)
    assert keys.wish(KEY_HOLDS_NS) == Wish(ahead=1.0)
    assert keys.wish(KEY_HOLDS_NS + 1) is None


def test_the_space_bar_lets_go_of_everything():
    keys = Keyboard()
    keys.press("w", 0)
    keys.press("a", 1)
    assert keys.wish(2) == Wish(ahead=1.0, turn=1.0)
    keys.press(" ", 3)
    assert keys.wish(4) is None


def test_a_gamepad_moves_nothing_without_its_dead_man_button():
    pad = Gamepad(JoyLayout())
    assert pad.see(AXES, LET_GO, 0) == ""
    assert pad.wish(1) is None
    pad.see(AXES, HELD, 2)
    assert pad.wish(3) == Wish(ahead=1.0)
    pad.see(AXES, LET_GO, 4)
    assert pad.wish(5) is None


def test_a_silent_gamepad_is_gone():
    pad = Gamepad(JoyLayout())
    pad.see(AXES, HELD, 0)
    assert pad.wish(JOY_LASTS_NS + 1) is None


@pytest.mark.parametrize(
    ("axes", "buttons"), [([], HELD), (AXES, []), ([0.0, math.nan, 0.0, 0.0], HELD), ([0.0] * 1000, HELD)]
)
def test_a_senseless_gamepad_counts_as_let_go(axes, buttons):
    pad = Gamepad(JoyLayout())
    pad.see(AXES, HELD, 0)
    assert pad.see(axes, buttons, 1)
    assert pad.wish(2) is None


@given(st.lists(st.floats(width=32), max_size=70), st.lists(st.integers(-5, 5), max_size=70))
@hypothesis_settings(max_examples=100, deadline=None)
def test_whatever_a_gamepad_says_wishes_stay_within_bounds(axes, buttons):
    pad = Gamepad(JoyLayout())
    pad.see(axes, buttons, 0)
    wish = pad.wish(1)
    assert wish is None or all(-1.0 <= part <= 1.0 for part in wish.parts)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("spacecraft_16", "let go and the valves close: it drifts on; press the opposite key to brake, or g to give"),
        ("int_ball2", "let go and the fans stop: it drifts on; press the opposite key to brake, or g to give"),
        ("floating_platform", "let go and the valves close: it drifts on"),
        ("modular_freeflyer", "let go and the valves close: it drifts on"),
        ("turtlebot2", "let go and it stands still; g gives it back"),
        ("leatherback", "let go and it stands still"),
        ("kingfisher", "let go and it stands still"),
    ],
)  # fmt: skip
def test_a_person_reads_what_the_robot_does_when_the_key_is_released(name, words):
    assert letting_go(load_robot(name)).startswith(words)


@ROBOTS
def test_what_drifts_is_as_fast_as_before_when_its_actuators_have_rested(robot):
    """The sentence follows the physics: driven ahead by hand for 2 s, then let go for 20 s."""
    simulation = build(robot=robot, worlds=1)
    steps = round(simulation.robot.timing.control_hz)

    def speed_after(seconds, wish):
        command = hand_mapping(robot)(wish)[None]
        for _ in range(seconds * steps):
            simulation.step(command)
        return float(simulation.truth.logged()["speed"][0])

    driven, left = speed_after(2, Wish(ahead=1.0)), speed_after(20, NOTHING)
    assert driven > 0.02
    assert (left > 0.9 * driven) == robot.drifts


def test_the_help_says_that_x_keeps_the_robot_from_its_controller_and_what_keys_do_in_space():
    words = keys_help(CRAFT)
    assert (
        "x: end; the robot stays in its safe state: press g first to give it back to the controller" in words
    )
    assert "keys push along x and y and turn about z only" in words
    assert "about z only" not in keys_help(load_robot("floating_platform"))
