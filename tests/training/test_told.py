"""What a network is told beside its observations: in training, when judged, and when deployed."""

import numpy as np
import pytest

from fulmar_core.controllers.told import PUSH_TERMS, Told, told_for, told_terms
from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.observation import Observer
from fulmar_core.robot import load_robot
from fulmar_core.simulation import BatchSimulation
from fulmar_core.tasks import load_task
from training.vec_env import BatchVecEnv

ROBOT, TASK = load_robot("floating_platform"), load_task("drift_go_to_pose")
NAMES = Observer(ROBOT, TASK).names
HZ = ROBOT.timing.control_hz


def lived(scenario, steps, *, worlds=8, seed=4):
    """Random valves for a while: what was told last, the estimator's completed observations, and the simulation."""
    simulation = BatchSimulation(
        ROBOT, TASK, load_scenario(scenario), worlds=worlds, seed=seed, control_hz=HZ
    )
    told, rng = Told(ROBOT, TASK, HZ), np.random.default_rng(1)
    for _ in range(steps):
        seen = told.complete(np.asarray(simulation.observe()))
        command = (rng.random((worlds, 8)) < 0.2).astype(float)
        told.acts(command)
        simulation.step(command)
    return told.complete(np.asarray(simulation.observe())), simulation, seen


def pushes(told, simulation):
    """Told and true push in the body's frame, shape (worlds, 3) each."""
    world, yaw = simulation.world, simulation.truth.yaw
    c, s = np.cos(yaw), np.sin(yaw)
    true = np.stack(
        (c * world.force_x + s * world.force_y, c * world.force_y - s * world.force_x, world.torque), -1
    )
    return told[:, len(NAMES) : len(NAMES) + 3], true


def test_a_robot_without_valves_has_nothing_to_be_told():
    assert told_terms(load_robot("turtlebot2")) == ()
    assert told_terms(ROBOT)[:3] == PUSH_TERMS
    assert len(told_terms(ROBOT)) == 3 + 8


def test_only_a_network_that_takes_more_than_is_seen_is_told():
    assert told_for(ROBOT, TASK, HZ, len(NAMES)) is None
    assert told_for(ROBOT, TASK, HZ, len(NAMES) + 11) is not None


@pytest.mark.parametrize("scenario", ["drift_force_4", "drift_torque", "drift_force_torque"])
def test_a_push_is_found_within_seconds(scenario):
    told, true = pushes(*lived(scenario, 40)[:2])
    np.testing.assert_allclose(told, true, atol=0.04)
    assert np.abs(true).max() > 0.04


def test_a_dead_valve_is_found_once_it_was_told_to_open():
    told, simulation, _ = lived("drift_one_lost", 40)
    np.testing.assert_array_equal(told[:, -8:].round(), simulation.world.alive.T)


def test_blurred_velocities_are_told_sharper_than_they_are_seen():
    told, simulation, _ = lived("drift_velocity_noise_4", 60, worlds=32)
    column = NAMES.index("velocity_x_in_body")
    true = simulation.truth.velocity_in_body[0]
    seen = np.asarray(simulation.observe())[:, column]
    assert np.std(told[:, column] - true) < 0.5 * np.std(seen - true)


def test_without_noise_the_terms_of_the_task_stay_what_they_are():
    told, simulation, _ = lived("drift_ideal", 30)
    np.testing.assert_allclose(told[:, : len(NAMES)], np.asarray(simulation.observe()), atol=0.02)


def test_a_learner_is_told_the_same_as_a_deployed_network_up_to_errors():
    env = BatchVecEnv(
        ROBOT, TASK, load_scenario("drift_force_4"), worlds=4, seed=2, told=True, staggered=False
    )
    assert env.observation_space.shape == (len(NAMES) + 11,)
    seen = env.reset()
    np.testing.assert_allclose(seen[:, -11:-8], 0.0, atol=0.05)
    for _ in range(20):
        seen, _, _, _ = env.step(np.zeros((4, 8)))
    told, true = pushes(seen, env.simulation)
    np.testing.assert_allclose(told, true, atol=0.05)
    np.testing.assert_array_equal(seen[:, -8:], 1.0)


def test_a_learner_forgets_pushes_and_dead_valves_when_an_episode_begins():
    env = BatchVecEnv(
        ROBOT, TASK, load_scenario("drift_two_lost"), worlds=4, seed=2, told=True, staggered=False
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
        BatchVecEnv(ROBOT, TASK, load_scenario("drift_training"), worlds=4, seed=seed, told=True)
        for seed in (2, 3)
    )
    for each in (env, other):
        each.reset()
    for _ in range(5):
        env.step(np.ones((4, 8)))
    other.set_state(env.state())
    for ours, theirs in zip(env.step(np.ones((4, 8)))[:2], other.step(np.ones((4, 8)))[:2], strict=True):
        np.testing.assert_array_equal(ours, theirs)
