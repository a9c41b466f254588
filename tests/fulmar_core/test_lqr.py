"""The LQR: its model, its gain, and what it does to a platform."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from fulmar_core.actuators.thrusters import Nozzle
from fulmar_core.config import load_config
from fulmar_core.controllers.lqr import Lqr, LqrWeights, linear_model, load_lqr
from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.errors import ConfigError
from fulmar_core.metrics import TrajectoryLog, successes
from fulmar_core.paths import config_path
from fulmar_core.robot import load_robot
from fulmar_core.simulation import BatchSimulation
from fulmar_core.state import planar_pose, planar_state
from fulmar_core.tasks import load_task

ROBOT, POSE, POSITION = load_robot("floating_platform"), load_task("go_to_pose"), load_task("go_to_position")
WEIGHTS = load_config(LqrWeights, config_path("controllers", "floating_platform_lqr"))


@pytest.mark.parametrize("hz", [50.0, 5.0])
def test_the_linear_model_is_the_textbook_double_integrator(hz):
    a, b = linear_model(ROBOT, 1.0 / hz)
    dt, n = 1.0 / hz, ROBOT.timing.substeps(hz)
    expected_a = np.eye(6)
    expected_a[:3, 3:] = dt * np.eye(3)
    moments = np.array([ROBOT.body.mass, ROBOT.body.mass, ROBOT.body.inertia[2]])
    # Sum of n semi-implicit steps: dt²/2 of the continuous plant, times (n + 1) / n.
    expected_b = np.concatenate((np.diag(dt * dt * (n + 1) / (2 * n) / moments), np.diag(dt / moments)))
    np.testing.assert_allclose(a, expected_a, rtol=0, atol=1e-9)  # central differences of 1e-4 round at 1e-12
    np.testing.assert_allclose(b, expected_b, rtol=0, atol=1e-9)


@pytest.mark.parametrize("hz", [50.0, 5.0])
@pytest.mark.parametrize("task", [POSE, POSITION], ids=lambda task: task.name)
def test_the_closed_loop_without_saturation_is_stable(task, hz):
    lqr = load_lqr(ROBOT, task, control_hz=hz)
    used = [0, 1, 2, 3, 4, 5] if task is POSE else [0, 1, 3, 4, 5]
    a, b = linear_model(ROBOT, 1.0 / hz)
    gain = gain_by_probing(lqr)
    radius = np.abs(np.linalg.eigvals(a[np.ix_(used, used)] - b[used] @ gain)).max()
    assert radius < 1.0
    assert np.log(radius) * hz < -0.1  # errors die out within some ten seconds


def gain_by_probing(lqr):
    """The gain as the allocation sees it: wanted wrenches for small unit errors."""
    wanted = []

    class Spy:
        def best(self, wrench):
            wanted.append(wrench)
            return np.zeros(8)

    lqr._allocation = Spy()
    task = POSE if "sin_heading_error" in lqr.observation_names else POSITION
    h = 1e-3  # far below every limit
    states = [planar_state(h, 0.0, 0.0), planar_state(0.0, h, 0.0)]
    if task is POSE:
        states.append(planar_state(0.0, 0.0, h))
    states += [planar_state(0.0, 0.0, 0.0, **{name: h}) for name in ("vx", "vy", "yaw_rate")]
    for state in states:
        lqr.act(task.observe(state, planar_pose(0.0, 0.0, 0.0)))
    return -np.stack(wanted, axis=1) / h


def test_errors_push_back_towards_the_goal():
    gain = gain_by_probing(load_lqr(ROBOT, POSE))
    for wrench, error in ((0, 0), (1, 1), (2, 2), (0, 3), (1, 4), (2, 5)):
        assert gain[wrench, error] > 0.0  # w = -K x


def test_errors_beyond_the_limit_count_as_the_limit():
    lqr, goal = load_lqr(ROBOT, POSE), planar_pose(0.0, 0.0, 0.0)
    edge, far = (POSE.observe(planar_state(d, 0.0, 0.0), goal) for d in (WEIGHTS.position_error_limit, 4.0))
    beyond, near = lqr._error_state(far), lqr._error_state(edge)
    np.testing.assert_allclose(beyond, near, rtol=0, atol=1e-12)
    turned = lqr._error_state(POSE.observe(planar_state(0.0, 0.0, np.deg2rad(-150)), goal))
    assert np.rad2deg(turned[2]) == pytest.approx(-WEIGHTS.heading_error_limit_deg, abs=1e-9)


def test_at_rest_at_the_goal_every_valve_is_closed():
    command = load_lqr(ROBOT, POSE).act(POSE.observe(planar_state(1.0, 2.0, 0.5), planar_pose(1.0, 2.0, 0.5)))
    assert not command.any()


def test_going_to_a_position_ignores_the_heading():
    lqr = load_lqr(ROBOT, POSITION)
    rng = np.random.default_rng(1)
    for x, y, vx in rng.normal(size=(20, 3)):
        goals = [planar_pose(0.0, 0.0, yaw) for yaw in (0.0, 1.0, -2.0)]
        answers = [lqr.act(POSITION.observe(planar_state(x, y, 0.3, vx=vx), goal)).tolist() for goal in goals]
        assert answers[0] == answers[1] == answers[2]


@pytest.mark.parametrize("task", [POSE, POSITION], ids=lambda task: task.name)
@pytest.mark.parametrize(("hz", "worlds"), [(5.0, 32), (50.0, 8)])
def test_it_brings_every_platform_home_at_either_rate(task, hz, worlds):
    simulation = BatchSimulation(ROBOT, task, load_scenario("nominal"), worlds=worlds, seed=5, control_hz=hz)
    lqr, log = load_lqr(ROBOT, task, control_hz=hz), TrajectoryLog(1.0 / hz)
    for _ in range(round(task.episode_s * hz)):
        command = lqr.act(task.observe(simulation.measured, simulation.goal))
        simulation.step(command)
        log.add(simulation.truth, simulation.goal, command)
    # At 50 Hz noise and friction-free drift cost no success; at 5 Hz the issue asks for 0.99 of 256.
    assert successes(log.trajectories(), task).mean() == 1.0


def test_a_batch_is_answered_like_its_members():
    lqr = load_lqr(ROBOT, POSE)
    rng = np.random.default_rng(3)
    seen = POSE.observe(planar_state(*rng.normal(size=(3, 20))), planar_pose(*rng.normal(size=(3, 20))))
    np.testing.assert_array_equal(lqr.act(seen), [lqr.act(row) for row in seen])


def sha(robot=ROBOT, task=POSE, weights=WEIGHTS, hz=5.0):
    return Lqr(robot, task, weights, control_hz=hz).metadata()["sha256"]


@pytest.mark.parametrize("name", [field.name for field in fields(LqrWeights)])
def test_the_metadata_hash_changes_with_every_weight_and_limit(name):
    assert sha(weights=replace(WEIGHTS, **{name: 1.5 * getattr(WEIGHTS, name)})) != sha()


def test_the_metadata_hash_changes_with_robot_task_and_rate_and_with_nothing_else():
    heavier = replace(ROBOT, body=replace(ROBOT.body, mass=6.0))
    other_thrust = replace(ROBOT, actuators=replace(ROBOT.actuators, thrust=0.9))
    robots = [ROBOT, replace(ROBOT, name="other"), heavier, other_thrust]
    hashes = [*(sha(robot) for robot in robots), sha(task=POSITION), sha(hz=50.0)]
    assert len(set(hashes)) == len(hashes)
    assert sha(replace(ROBOT, title="the same by another title")) == sha()


def test_the_rate_is_the_robots_own_by_default():
    assert load_lqr(ROBOT, POSE).control_hz == ROBOT.timing.control_hz


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"position": -1.0}, "weights must not be negative"),
        ({"force": 0.0}, "force, torque and the error limits"),
    ],
)
def test_weights_without_a_solution_are_refused(change, words):
    with pytest.raises(ValueError, match=words):
        replace(WEIGHTS, **change)


def test_a_robot_without_weights_is_told_which_file_to_write():
    with pytest.raises(
        ConfigError, match=r"no LQR weights for 'other'. Write configs/controllers/other_lqr\.yaml"
    ):
        load_lqr(replace(ROBOT, name="other"), POSE)


@pytest.mark.parametrize("hz", [None, 5.0])
def test_a_robot_with_too_many_valves_is_refused_with_its_rate(hz):
    nozzles = tuple(Nozzle(f"n{i}", (0.1, 0.1 * i, 0.0), (1.0, 0.0, 0.0)) for i in range(13))
    robot = replace(ROBOT, actuators=replace(ROBOT.actuators, nozzles=nozzles))
    with pytest.raises(ConfigError, match="LQR for 'floating_platform' at 5 Hz: 13 valves"):
        load_lqr(robot, POSE, control_hz=hz)


def test_a_rate_that_the_physics_cannot_keep_is_refused():
    with pytest.raises(ConfigError, match="LQR for 'floating_platform' at 7 Hz: control_hz = 7 must divide"):
        load_lqr(ROBOT, POSE, control_hz=7.0)
