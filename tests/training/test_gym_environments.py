"""The environments that Gymnasium makes by name: one world, and many that step together."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import gymnasium
from gymnasium.utils.env_checker import check_env

from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.config.paths import config_names, config_path
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from training.environments import environment_id, register_tasks
from training.vec_env import BatchVecEnv

GO_TO_POSE = environment_id("go_to_pose")


@pytest.mark.filterwarnings("error", "ignore:.*(too low|too high):UserWarning")  # terms have no bounds
@pytest.mark.parametrize(
    ("task", "robot"),
    [("go_to_pose", "floating_platform"), ("go_to_pose", "turtlebot2"), ("go_to_pose_3d", "int_ball2")],
)
def test_the_checker_of_gymnasium_accepts_it(task, robot):
    check_env(gymnasium.make(environment_id(task), robot=robot).unwrapped)


def test_each_space_has_a_robot_by_default():
    assert gymnasium.make(GO_TO_POSE).action_space.n == 8
    assert gymnasium.make(environment_id("go_to_pose_3d")).action_space.n == 16


def test_every_task_is_registered_and_registering_again_changes_nothing():
    tasks = {environment_id(task) for task in config_names("tasks")}
    before = dict(gymnasium.registry)
    register_tasks()
    assert tasks <= set(before)
    assert dict(gymnasium.registry) == before


def test_a_task_of_ones_own_folder_is_registered_too(tmp_path, monkeypatch):
    (tmp_path / "tasks").mkdir()
    shipped = config_path("tasks", "go_to_position").read_text(encoding="utf-8")
    own = shipped.replace("name: go_to_position", "name: go_far")
    (tmp_path / "tasks" / "go_far.yaml").write_text(own, encoding="utf-8")
    monkeypatch.setenv("FULMAR_CONFIGS", str(tmp_path))
    register_tasks()
    try:
        observation, _ = gymnasium.make("fulmar/go_far-v0", robot="turtlebot2").reset(seed=1)
        assert observation.shape == (10,)  # eight terms of the task, two commands that were given
    finally:
        del gymnasium.registry["fulmar/go_far-v0"]


def test_the_plain_environment_needs_neither_torch_nor_stable_baselines():
    code = (
        "import sys, gymnasium; env = gymnasium.make('training.environments:fulmar/go_to_pose-v0');"
        "env.reset(seed=0); env.step(env.action_space.sample());"
        "sys.exit(bool({'torch', 'stable_baselines3'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def stepped_beside_training(robot, steps):
    """Outcomes of the vector environment, and of the environment that Fulmar's own training uses, same actions."""
    seed, worlds = 3, 4
    scenario = load_scenario("nominal")
    ours = gymnasium.make_vec(GO_TO_POSE, num_envs=worlds, robot=robot, scenario="nominal", seed=seed)
    theirs = BatchVecEnv(
        load_robot(robot), load_task("go_to_pose"), scenario, worlds=worlds, seed=seed, staggered=False
    )
    yield ours.reset()[0], theirs.reset()
    ours.action_space.seed(1)
    for _ in range(steps):
        actions = ours.action_space.sample()
        actions[1:] = 0  # these stay, and their time runs out
        yield ours.step(actions), theirs.step(actions)


def test_many_worlds_give_what_training_sees_over_the_end_of_an_episode():
    pairs = stepped_beside_training("floating_platform", 301)  # 60 s at 5 Hz, and one step
    np.testing.assert_array_equal(*next(pairs))
    endings = set()
    for (seen, reward, terminated, truncated, infos), (other, other_reward, done, other_infos) in pairs:
        np.testing.assert_array_equal(seen, other)
        np.testing.assert_array_equal(reward, other_reward)
        np.testing.assert_array_equal(terminated | truncated, done)
        for world in np.flatnonzero(done):
            last = other_infos[world]["terminal_observation"]
            np.testing.assert_array_equal(infos["final_obs"][world], last)
            assert infos["_final_obs"][world]
            assert truncated[world] == other_infos[world]["TimeLimit.truncated"]
            endings.add("time" if truncated[world] else "geofence")
        assert bool(infos) == done.any()
    assert endings == {"time", "geofence"}


def test_one_world_is_the_first_of_many():
    one, many = gymnasium.make(GO_TO_POSE), gymnasium.make_vec(GO_TO_POSE, num_envs=3)
    np.testing.assert_array_equal(one.reset(seed=5)[0], many.reset(seed=5)[0][0])
    many.action_space.seed(2)
    for _ in range(5):
        actions = many.action_space.sample()
        seen, reward, *_ = one.step(actions[0])
        all_seen, all_rewards, *_ = many.step(actions)
        np.testing.assert_array_equal(seen, all_seen[0])
        assert reward == all_rewards[0]


def test_without_a_seed_every_reset_of_many_worlds_begins_the_next_episodes():
    many = gymnasium.make_vec(GO_TO_POSE, num_envs=2)
    first, second = many.reset()[0], many.reset()[0]
    assert (first != second).any(axis=1).all()
    np.testing.assert_array_equal(many.reset(seed=0)[0], first)


def test_mistakes_name_what_is_allowed():
    with pytest.raises(UnknownNameError, match="turtlebot2"):
        gymnasium.make(GO_TO_POSE, robot="turtlebot")
    with pytest.raises(ConfigError, match="Did you mean 'go_to_pose_3d'"):
        gymnasium.make(GO_TO_POSE, robot="spacecraft_16")
    with pytest.raises(ConfigError, match="num_envs: found 0, need at least 1"):
        gymnasium.make_vec(GO_TO_POSE, num_envs=0)
    with pytest.raises(ConfigError, match="seed: found -1, need 0 or more"):
        gymnasium.make(GO_TO_POSE, seed=-1)
    with pytest.raises(ConfigError, match="unknown option 'distance'"):
        gymnasium.make(GO_TO_POSE).reset(options={"distance": 1.0})
