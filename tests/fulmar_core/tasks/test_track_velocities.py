"""Velocities to track, one after another."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.config.paths import config_names
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import Goal

TASK = load_task("track_velocities")
EVERY = (load_robot(name) for name in config_names("robots"))
ROBOTS = {robot.name: robot for robot in EVERY if not robot.actuators.turns_only}
MANY = 1000


def draw(robot, count=MANY):
    return TASK.draw(Draws(3, np.arange(count), np.zeros(count)), robot, training=False)


def goal(*targets, done=0.0):
    return Goal(np.array(targets), np.asarray(done), np.zeros((0, 3)))


def moving(ahead, left, turn, yaw=0.7):
    c, s = np.cos(yaw), np.sin(yaw)
    values = (3.0, -2.0, yaw, c * ahead - s * left, s * ahead + c * left, turn)
    return PlanarState(*(np.asarray(value) for value in values))


@pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS)
def test_targets_are_drawn_from_what_the_robot_can_do(robot):
    targets, can = draw(robot)[1].targets, robot.performance
    ahead, left, turn = targets[..., 0], targets[..., 1], targets[..., 2]
    for values, low, high in (
        (ahead, -can.reverse_speed, can.speed),
        (left, -can.lateral_speed, can.lateral_speed),
        (turn, -can.yaw_rate, can.yaw_rate),
    ):
        assert low - 1e-12 <= values.min() <= low + 0.02 * (high - low) + 1e-12
        assert high + 1e-12 >= values.max() >= high - 0.02 * (high - low) - 1e-12
    assert np.all(np.abs(turn) * np.hypot(ahead, left) <= can.turning_acceleration + 1e-9)


@pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS)
def test_there_is_a_target_for_every_moment_of_an_episode(robot):
    start, drawn = draw(robot, 5)
    assert drawn.targets.shape[1] * TASK.hold_s >= TASK.episode_s
    assert not any(getattr(start, name).any() for name in ("vx", "vy", "yaw_rate"))
    last = TASK.advance(drawn, start, np.full(5, 10.0 * TASK.episode_s))
    np.testing.assert_array_equal(last.current, drawn.targets[:, -1])


def test_each_target_holds_for_its_time_and_worlds_may_be_at_different_times():
    targets = [(0.1 * i, 0.0, 0.0) for i in range(5)]
    many = Goal(np.array([targets] * 4), np.zeros(4), np.zeros((4, 0, 3)))
    state = PlanarState(*np.zeros((6, 4)))
    time_s = TASK.hold_s * np.array([0.0, 0.99, 1.0, 3.5])
    assert TASK.advance(many, state, time_s).done.tolist() == [0.0, 0.0, 1.0, 3.0]


def test_a_single_target_holds_for_ever():
    assert float(TASK.advance(goal((0.1, 0.0, 0.0)), moving(0, 0, 0), np.asarray(1e6)).done) == 0.0


def test_errors_are_wanted_minus_true_in_the_body_s_frame():
    names = dict(
        zip(
            TASK.observation_names, TASK.observe(moving(0.1, -0.05, 0.2), goal((0.3, 0.0, -0.1))), strict=True
        )
    )
    expected = {
        "velocity_error_x_in_body": 0.2,
        "velocity_error_y_in_body": 0.05,
        "yaw_rate_error": -0.3,
        "velocity_x_in_body": 0.1,
        "velocity_y_in_body": -0.05,
        "yaw_rate": 0.2,
    }
    assert {name: float(names[name]) for name in expected} == pytest.approx(expected)
    fine = [float(names[name]) for name in TASK.observation_names[6:]]
    size = np.hypot(0.2, 0.05)
    assert fine == pytest.approx([0.2 / size, 0.05 / size, -1.0])
    errors = TASK.errors(moving(0.1, -0.05, 0.2), goal((0.3, 0.0, -0.1)))
    assert (float(errors.velocity), float(errors.yaw_rate)) == pytest.approx((size, -0.3))
    assert errors.position is None


def test_moving_as_wanted_is_worth_more_than_anything_else():
    wanted = goal((0.3, 0.1, 0.2))
    best = TASK.reward(moving(0, 0, 0), moving(0.3, 0.1, 0.2), wanted, wanted)
    for other in ((0.2, 0.1, 0.2), (0.3, 0.0, 0.2), (0.3, 0.1, 0.0), (0.0, 0.0, 0.0)):
        assert best > TASK.reward(moving(0, 0, 0), moving(*other), wanted, wanted)


def test_targets_that_turn_keep_their_speed_and_turn_no_faster_than_the_task_says():
    task = load_task("drift_track_velocities")
    targets = task.draw(Draws(3, np.arange(50), np.zeros(50)), ROBOTS["floating_platform"], training=False)[
        1
    ].targets
    assert targets.shape[1] * task.step_s >= task.episode_s
    held = targets.reshape(50, -1, round(task.hold_s / task.step_s), 3)
    velocity = held[..., 0] + 1j * held[..., 1]
    np.testing.assert_allclose(np.abs(velocity), np.abs(velocity[..., :1]).repeat(held.shape[2], axis=-1))
    rate = np.angle(velocity[..., 1:] / velocity[..., :-1]) / task.step_s
    np.testing.assert_allclose(rate, rate[..., :1].repeat(rate.shape[-1], axis=-1), atol=1e-9)
    assert 0.9 * task.turning < np.abs(rate).max() <= task.turning + 1e-9
    assert not held[..., 2].any()
