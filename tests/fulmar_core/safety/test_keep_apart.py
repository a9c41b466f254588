"""The guard keeps robots apart: by what both can brake, past each other, and not without knowing where they are."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.controller import Inputs
from fulmar_core.loop.fleet_rollout import roll_out_swap
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.keep_apart import KeepApartGuard, Other, braking
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goals_at
from fulmar_core.tasks.swap_places import swap_places
from fulmar_core.wires.neighbours import NEIGHBOURS
from fulmar_core.worlds.scenario import load_scenario
from policy_server.controllers import Choice, load_controller

ROBOT, TASK = load_robot("floating_platform"), load_task("go_to_pose")
DT = 0.1
AHEAD = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]])


def inputs_of(vx: float, other: tuple[float, ...] | None) -> Inputs:
    zero = np.zeros(1)
    state = PlanarState(zero, zero, zero, np.array([vx]), zero, zero)
    readings = {} if other is None else {NEIGHBOURS: np.array([other])}
    return Inputs(state, goals_at(np.zeros((1, 3))), np.zeros((1, 0)), AHEAD, None, 0, DT, readings)


def pushes_ahead() -> np.ndarray:
    """Valves that push along the body's x axis."""
    ahead = ROBOT.actuators.wrench_per_newton[:, 0]
    return (ahead > 0.1).astype(float)[None]


def guard(*, guarded: bool = True) -> KeepApartGuard:
    return KeepApartGuard(ROBOT, [Other("beta", ROBOT, guarded=guarded)], DT)


def along_x(command: np.ndarray) -> float:
    return float(ROBOT.actuators.wrench_in_body(command)[0][0, 0])


def test_a_robot_far_from_every_other_one_is_left_alone():
    own, command = guard(), pushes_ahead()
    assert own.guarded(command, inputs_of(0.3, (5.0, 0.0, 0.0, 0.0))) is command
    assert not own.words and not own.interventions


def test_a_robot_that_nears_another_one_too_fast_is_braked():
    own = guard()
    command = own.guarded(pushes_ahead(), inputs_of(0.5, (1.2, 0.0, 0.0, 0.0)))
    assert along_x(command) < 0.0
    assert own.words == "keeps apart from 'beta'" and own.interventions == 1


def test_a_robot_that_leaves_another_one_is_left_alone():
    command = pushes_ahead()
    assert guard().guarded(command, inputs_of(0.3, (-0.8, 0.0, 0.0, 0.0))) is command


def test_a_robot_brakes_earlier_for_one_that_has_no_guard_and_comes_nearer():
    other = 2.2, 0.0, -0.3, 0.0
    assert guard(guarded=True).guarded(pushes_ahead(), inputs_of(0.25, other)) is not None
    alone, together = guard(guarded=False), guard(guarded=True)
    alone.guarded(pushes_ahead(), inputs_of(0.35, other))
    together.guarded(pushes_ahead(), inputs_of(0.2, other))
    assert alone.holds[0] and not together.holds[0]


def test_a_robot_that_knows_of_no_other_one_comes_to_rest():
    own = guard()
    command = own.guarded(pushes_ahead(), inputs_of(0.3, None))
    assert along_x(command) < 0.0 and "does not know" in own.words


def passed_side(*, speed: float, steps: int) -> float:
    """Push across, left positive, past another robot ahead, after so many steps in which the law pushes to the left."""
    own, inputs = guard(), inputs_of(0.1, (0.85, 0.0, 0.0, speed))
    ahead, left = ROBOT.actuators.wrench_per_newton[:, :2].T
    wanted = ((ahead > 0.1) | (left > 0.1)).astype(float)[None]
    for _ in range(steps):
        command = own.guarded(wanted, inputs)
    assert own.holds[0]
    return float(ROBOT.actuators.wrench_in_body(command)[0][0, 1])


def test_a_robot_that_has_stood_for_a_while_is_passed_on_the_side_of_the_goal_and_one_that_moves_on_the_right():
    assert passed_side(speed=0.0, steps=40) > 0.0
    assert passed_side(speed=0.0, steps=2) <= 0.0
    assert passed_side(speed=0.1, steps=40) <= 0.0


@pytest.mark.slow
def test_a_robot_between_two_that_have_arrived_does_not_wait_for_ever():
    """Seed 3: to its right lies a robot that stands, and its goal to the left."""
    assert swap(keep_apart=True, seeds=(3,), duration_s=40.0).all_arrived[0]


def test_the_speed_towards_another_robot_is_what_both_still_brake():
    own, brake = guard(), braking(ROBOT)
    gap = np.linspace(0.05, 3.0, 50)
    speed = own._most(0.5 * gap)
    stops = speed * own._late_s + speed**2 / (2.0 * brake)
    np.testing.assert_allclose(2.0 * stops, gap, rtol=1e-9)


@pytest.mark.parametrize("robot", ["kingfisher", "turtlebot2", "spacecraft_16"])
def test_a_robot_that_cannot_brake_in_every_direction_is_refused(robot):
    with pytest.raises(ConfigError, match="does not"):
        KeepApartGuard(load_robot(robot), [Other("beta", ROBOT)], DT)


def test_an_entry_that_names_no_robot_and_type_is_refused():
    with pytest.raises(ValueError, match="NAME TYPE"):
        Other.of("beta")


def test_places_to_swap_are_apart_and_each_robot_gets_that_of_another():
    for seed in range(20):
        starts, goals = swap_places(seed, [ROBOT.body.radius] * 4)
        far = np.linalg.norm(starts[:, None, :2] - goals[None, :, :2], axis=-1)
        assert (np.sort(far, axis=1)[:, 0] < 1e-12).all() and (far.diagonal() > 1.0).all()
    again, _ = swap_places(19, [ROBOT.body.radius] * 4)
    np.testing.assert_array_equal(starts, again)


def test_more_robots_get_more_room():
    starts, _ = swap_places(0, [ROBOT.body.radius] * 12)
    far = np.linalg.norm(starts[:, None, :2] - starts[None, :, :2], axis=-1) + 9.0 * np.eye(12)
    assert far.min() >= 1.2


def swap(*, keep_apart: bool, seeds, duration_s: float):
    controller = load_controller("lqr", ROBOT, TASK, Choice(10.0))
    scenario = load_scenario("nominal")
    return roll_out_swap(
        controller,
        ROBOT,
        TASK,
        scenario,
        robots=4,
        seeds=seeds,
        keep_apart=keep_apart,
        duration_s=duration_s,
    )


@pytest.mark.slow
def test_four_platforms_swap_places_on_twenty_seeds_and_never_touch():
    run = swap(keep_apart=True, seeds=range(20), duration_s=90.0)
    assert run.least_m.min() > 0.05
    assert run.all_arrived.sum() >= 16


def test_platforms_that_would_touch_do_not_with_the_guard_alone():
    seeds = (1, 4)
    assert (swap(keep_apart=False, seeds=seeds, duration_s=25.0).least_m < -0.2).all()
    assert (swap(keep_apart=True, seeds=seeds, duration_s=25.0).least_m > 0.05).all()
