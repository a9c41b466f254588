"""Estimated disturbances as inputs of a network: as a controller receives them, and as a learner does."""

import numpy as np
import pytest

from fulmar_core.controllers.disturbance_inputs import (
    ESTIMATOR,
    PUSH_TERMS,
    disturbance_terms,
    with_disturbances,
)
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.tasks.observation import Observer
from fulmar_core.worlds.scenario import load_scenario
from training.vec_env import BatchVecEnv

ROBOT, TASK = load_robot("floating_platform"), load_task("drift_go_to_pose")
NAMES = Observer(ROBOT, TASK).names


class Random:
    """Opens valves at random, and keeps what a network would be shown."""

    name, control_hz, estimator = "random", ROBOT.timing.control_hz, ESTIMATOR
    readings, observer = (), None

    def __init__(self):
        self._rng, self._observer = np.random.default_rng(1), Observer(ROBOT, TASK)

    def reset(self): ...

    def act(self, inputs):
        self.shown = with_disturbances(self._observer, inputs)
        return (self._rng.random(inputs.previous.shape) < 0.2).astype(float)


def lived(scenario, steps, *, worlds=8, seed=4):
    """Random valves for a while: what was shown last, and the simulation at that moment."""
    simulation = BatchSimulation(ROBOT, TASK, load_scenario(scenario), worlds=worlds, seed=seed)
    controller = Random()
    loop = ControlLoop(ROBOT, TASK, controller, robots=worlds)
    loop.begin(goal_in_float64(simulation.goal))
    for number in range(steps):
        simulation.move(loop.step(simulation.measured, {}, round(1e9 * number * loop.dt)).command)
    loop.step(simulation.measured, {}, round(1e9 * steps * loop.dt))
    return controller.shown, simulation


def pushes(shown, simulation):
    """Shown and true push in the body's frame, shape (worlds, 3) each."""
    world, yaw = simulation.world, simulation.truth.yaw
    c, s = np.cos(yaw), np.sin(yaw)
    true = np.stack(
        (c * world.force_x + s * world.force_y, c * world.force_y - s * world.force_x, world.torque), -1
    )
    return shown[:, len(NAMES) : len(NAMES) + 3], true


def test_a_robot_without_valves_has_no_disturbances_among_its_inputs():
    assert disturbance_terms(load_robot("turtlebot2")) == ()
    assert disturbance_terms(ROBOT)[:3] == PUSH_TERMS
    assert len(disturbance_terms(ROBOT)) == 3 + 8


@pytest.mark.parametrize("scenario", ["drift_force_4", "drift_torque", "drift_force_torque"])
def test_a_push_is_found_within_seconds(scenario):
    shown, true = pushes(*lived(scenario, 40))
    np.testing.assert_allclose(shown, true, atol=0.04)
    assert np.abs(true).max() > 0.04


def test_a_dead_valve_is_found_once_it_was_commanded_to_open():
    shown, simulation = lived("drift_one_lost", 40)
    np.testing.assert_array_equal(shown[:, -8:].round(), simulation.world.alive.T)


def test_blurred_velocities_are_shown_sharper_than_they_are_measured():
    shown, simulation = lived("drift_velocity_noise_4", 60, worlds=32)
    column = NAMES.index("velocity_x_in_body")
    true = simulation.truth.velocity_in_body[0]
    measured = np.asarray(simulation.observe())[:, column]
    assert np.std(shown[:, column] - true) < 0.5 * np.std(measured - true)


def test_without_noise_the_terms_of_the_task_stay_what_they_are():
    shown, simulation = lived("drift_ideal", 30)
    np.testing.assert_allclose(shown[:, : len(NAMES)], np.asarray(simulation.observe()), atol=0.02)


def test_a_learner_receives_the_same_as_a_deployed_network_up_to_errors():
    env = BatchVecEnv(
        ROBOT,
        TASK,
        load_scenario("drift_force_4"),
        worlds=4,
        seed=2,
        disturbance_inputs=True,
        staggered=False,
    )
    assert env.observation_space.shape == (len(NAMES) + 11,)
    seen = env.reset()
    np.testing.assert_allclose(seen[:, -11:-8], 0.0, atol=0.05)
    for _ in range(20):
        seen, _, _, _ = env.step(np.zeros((4, 8)))
    shown, true = pushes(seen, env.simulation)
    np.testing.assert_allclose(shown, true, atol=0.05)
    np.testing.assert_array_equal(seen[:, -8:], 1.0)


def test_a_learner_forgets_pushes_and_dead_valves_when_an_episode_begins():
    env = BatchVecEnv(
        ROBOT,
        TASK,
        load_scenario("drift_two_lost"),
        worlds=4,
        seed=2,
        disturbance_inputs=True,
        staggered=False,
    )
    env.reset()
    for _ in range(3):
        seen, _, _, _ = env.step(np.ones((4, 8)))
    assert (seen[:, -8:].sum(axis=1) == 6.0).all()
    env.begin_anew([1])
    seen, _, _, _ = env.step(np.zeros((4, 8)))
    np.testing.assert_array_equal(seen[:, -8:].sum(axis=1), [6.0, 8.0, 6.0, 6.0])


def test_what_a_learner_knows_survives_an_interruption():
    env, other = (
        BatchVecEnv(
            ROBOT, TASK, load_scenario("drift_training"), worlds=4, seed=seed, disturbance_inputs=True
        )
        for seed in (2, 3)
    )
    for each in (env, other):
        each.reset()
    for _ in range(5):
        env.step(np.ones((4, 8)))
    other.set_state(env.state())
    for ours, theirs in zip(env.step(np.ones((4, 8)))[:2], other.step(np.ones((4, 8)))[:2], strict=True):
        np.testing.assert_array_equal(ours, theirs)
