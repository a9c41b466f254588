"""Policies that are shown the targets of a path by their coordinates and the legs between them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from stable_baselines3.common.vec_env import VecNormalize

from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.errors import ConfigError
from fulmar_core.robot import load_robot
from fulmar_core.tasks import load_task
from training.coordinates import coordinate_terms, places_of, with_coordinates
from training.deploy import deployed_network
from training.learners import build_learner
from training.settings import load_training_settings
from training.vec_env import BatchVecEnv

BOAT, TASK = load_robot("kingfisher"), load_task("go_through_positions")


def worlds(*, coordinates=True, task=TASK, **more):
    return BatchVecEnv(
        BOAT, task, load_scenario("nominal"), worlds=16, seed=3, coordinates=coordinates, **more
    )


def row_of(*targets):
    """What a task tells of targets at these places [m], behind one term that is something else."""
    terms = [7.0]
    for x, y in targets:
        distance = float(np.hypot(x, y))
        terms += [x / distance, y / distance, distance]
    return np.array([terms], dtype=np.float32)


def test_places_legs_and_turns_are_those_of_a_drawing():
    row = row_of((2.0, 0.0), (2.0, 3.0), (1.0, 3.0))
    shown = with_coordinates(row, (1, 4, 7))[0]
    assert len(shown) == row.shape[1] + coordinate_terms(3)
    np.testing.assert_array_equal(shown[:10], row[0])
    np.testing.assert_allclose(shown[10:16], [2.0, 0.0, 2.0, 3.0, 1.0, 3.0], atol=1e-6)
    left = [0.0, 3.0, 0.0, 1.0, 0.0, 1.0]  # 3 m to the left: a quarter turn to the left
    back = [-1.0, 0.0, -1.0, 0.0, 0.0, 1.0]  # 1 m backwards: another one
    np.testing.assert_allclose(shown[16:], left + back, atol=2e-3)


def test_targets_in_the_same_place_leave_numbers():
    assert np.isfinite(with_coordinates(row_of((1.0, 1.0), (1.0, 1.0)), (1, 4))).all()


def test_what_a_task_tells_stays_and_what_follows_from_it_comes_after():
    plain, shown = worlds(coordinates=False), worlds()
    places = places_of(plain.simulation.observer.names)
    before, after = plain.reset(), shown.reset()
    np.testing.assert_array_equal(after, with_coordinates(before, places))
    assert after.shape[1:] == shown.observation_space.shape


def test_the_mirror_image_is_taken_first():
    plain, shown = worlds(coordinates=False, mirror="sides"), worlds(mirror="sides")
    np.testing.assert_array_equal(shown.reset(), with_coordinates(plain.reset(), shown.places))


def test_a_deployed_network_takes_what_the_task_tells_and_finds_the_rest_itself(small_settings):
    env = VecNormalize(worlds(mirror="sides"), norm_reward=False)
    learner = build_learner(small_settings.algorithm, env, seed=3)
    shown = env.reset()
    network = deployed_network(learner, env, BOAT.actuators.scale)
    plain = worlds(coordinates=False)
    told = plain.reset()
    assert network.plan.inputs == told.shape[1]
    shares = np.clip(learner.predict(shown, deterministic=True)[0], -1.0, 1.0)
    mirrored = told[:, env.venv.mirror.side] < 0.0
    shares[mirrored] = shares[mirrored] @ env.venv.mirror.done
    np.testing.assert_allclose(network.infer(told)[0], shares * BOAT.actuators.scale, atol=1e-4)


def test_tasks_without_a_path_are_refused():
    with pytest.raises(ConfigError, match="'coordinates': task 'track_velocities' has no path"):
        worlds(task=load_task("track_velocities"))


def test_networks_that_are_told_are_refused():
    with pytest.raises(ValueError, match="that are not 'told'"):
        replace(load_training_settings(BOAT, TASK), orders=None, told=True)


def test_networks_with_a_memory_are_refused():
    with pytest.raises(ValueError, match="'coordinates' are for networks without memory"):
        replace(load_training_settings(BOAT, TASK, "recurrent_ppo"), coordinates=True)
