"""Every robot at every task is an environment that Stable-Baselines3 accepts and learns from."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import gymnasium
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.env_checker import check_env

from fulmar_core.config.paths import OWN_FOLDERS, config_names
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from tests.new_robots import robots_of_every_family, write_new_robots
from tests.pairs import each_pair
from training.environments import environment_id
from training.gym_env import TaskEnv
from training.vec_env import BatchVecEnv

ROBOTS = robots_of_every_family()
TASKS = {name: load_task(name) for name in config_names("tasks")}
EACH_PAIR = each_pair(ROBOTS, TASKS)
RANDOMISED = load_scenario("randomised")


@pytest.fixture(autouse=True)
def new_robots(tmp_path, monkeypatch):
    """Environments load robots by their names."""
    write_new_robots(tmp_path)
    monkeypatch.setenv(OWN_FOLDERS, str(tmp_path))


@pytest.fixture(autouse=True, scope="module")
def one_thread():
    before = torch.get_num_threads()
    torch.set_num_threads(1)  # networks this small are slower on two
    yield
    torch.set_num_threads(before)


@EACH_PAIR
def test_the_checker_of_stable_baselines_accepts_it(robot, task):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make(environment_id(task.name), robot=robot.name).unwrapped)


@EACH_PAIR
def test_two_updates_of_ppo_run_and_stay_finite(robot, task):
    env = BatchVecEnv(robot, task, RANDOMISED, worlds=4, seed=1)
    model = PPO(
        "MlpPolicy", env, n_steps=8, batch_size=16, n_epochs=1, policy_kwargs={"net_arch": [8]}, seed=1, device="cpu"
    )  # fmt: skip
    model.learn(2 * 4 * 8)
    assert model._n_updates == 2
    assert all(torch.isfinite(values).all() for values in model.policy.parameters())


def env_of(robot="turtlebot2", task="go_to_pose", seed=3):
    return TaskEnv(ROBOTS[robot], TASKS[task], RANDOMISED, seed=seed)


def test_a_seed_brings_the_same_episode_back_and_none_the_next_one():
    env = env_of()
    first, again = env.reset(seed=7)[0], env.reset(seed=7)[0]
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(env.reset()[0], first)
    env.step(np.zeros(2, dtype=np.float32))
    assert not np.array_equal(env.reset()[0], first)


def test_an_episode_has_its_full_length_and_the_next_begins_where_reset_says():
    env = env_of()
    env.reset(seed=7)
    steps, ended = 0, False
    while not ended:
        last, reward, terminated, truncated, _ = env.step(np.zeros(2, dtype=np.float32))
        assert np.isfinite(reward)
        steps, ended = steps + 1, terminated or truncated
    assert (steps, terminated, truncated) == (600, False, True)
    first, _ = env.reset()
    assert not np.array_equal(first, last)
    np.testing.assert_array_equal(first, env.simulation.observe()[0])


def test_who_leaves_the_geofence_has_ended_for_good():
    env = env_of()
    env.reset(seed=7)
    env.simulation.truth.x[0] += 100.0
    _, _, terminated, truncated, _ = env.step(np.zeros(2, dtype=np.float32))
    assert (terminated, truncated) == (True, False)
