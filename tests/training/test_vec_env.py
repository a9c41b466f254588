"""The core's batch as Stable-Baselines3 expects a vector environment to be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from stable_baselines3.common.vec_env import VecNormalize

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from training.vec_env import BatchVecEnv

WORLDS = 16
OPEN_ONE = np.tile(np.eye(8, dtype=np.int8)[0], (WORLDS, 1))
NONE = np.zeros((WORLDS, 8), dtype=np.int8)


@pytest.fixture
def build(robot, task):
    def make(scenario="ideal", *, seed=1, task=task, robot=robot, **kwargs):
        return BatchVecEnv(robot, task, load_scenario(scenario), worlds=WORLDS, seed=seed, **kwargs)

    return make


def test_observations_rewards_and_dones_are_what_the_spaces_say(build):
    env = build()
    seen = env.reset()
    assert seen.shape == (WORLDS, *env.observation_space.shape)
    assert seen.dtype == env.observation_space.dtype == np.float32
    assert env.observation_space.contains(seen[0])
    actions = np.stack([env.action_space.sample() for _ in range(WORLDS)])
    seen, rewards, dones, infos = env.step(actions)
    assert (seen.shape, seen.dtype) == ((WORLDS, 10), np.float32)
    assert (rewards.shape, rewards.dtype) == ((WORLDS,), np.float32)
    assert (dones.shape, dones.dtype) == ((WORLDS,), np.dtype(bool))
    assert len(infos) == WORLDS
    assert all(isinstance(info, dict) for info in infos)


def test_the_action_space_has_one_on_off_value_for_each_valve(build):
    assert build().action_space.n == 8


def test_the_observation_is_the_task_s_own(build, task):
    env = build()
    expected = task.observe(env.simulation.measured, env.simulation.goal)
    np.testing.assert_array_equal(env.reset(), np.stack(expected, axis=-1))


def test_the_reward_is_the_task_s_own_less_the_actuators_cost_times_the_scale(build, robot, task):
    plain, scaled = build(), build(reward_scale=0.1)
    for env in (plain, scaled):
        env.reset()
    before, goal = plain.simulation.truth, plain.simulation.goal
    rewards, dones = plain.step(OPEN_ONE)[1:3]
    assert not dones.any()  # else the truth is already the next episode's
    expected = task.reward(before, plain.simulation.truth, goal, plain.simulation.goal) - robot.costs.effort
    np.testing.assert_allclose(rewards, expected, rtol=1e-6)
    np.testing.assert_allclose(scaled.step(OPEN_ONE)[1], 0.1 * rewards, rtol=1e-6)


def run_until_done(env, actions, world=0):
    for _ in range(400):
        seen, _, dones, infos = env.step(actions)
        if dones[world]:
            return seen, infos
    pytest.fail("no episode ended")


def test_an_episode_ends_by_time_as_truncated_and_begins_again_by_itself(build, task):
    env = build()
    env.reset()
    seen, infos = run_until_done(env, NONE)
    assert infos[0]["TimeLimit.truncated"] is True
    last = infos[0]["terminal_observation"]
    assert last.shape == (10,)
    assert not np.array_equal(last, seen[0])  # the new episode's first observation
    np.testing.assert_array_equal(seen, env.simulation.observe())
    assert (env.simulation.truth.vx[0], env.simulation.truth.vy[0]) == (0.0, 0.0)


def test_after_the_first_every_episode_lasts_its_whole_time(build, task):
    env = build()
    env.reset()
    run_until_done(env, NONE)
    for _ in range(round(task.episode_s * 5) - 1):
        assert not env.step(NONE)[2][0]
    assert env.step(NONE)[2][0]


def test_first_episodes_have_lengths_of_all_kinds(build):
    env = build()
    env.reset()
    ends = np.zeros(WORLDS, dtype=int)
    for step in range(1, 301):
        dones = env.step(NONE)[2]
        ends[(ends == 0) & dones] = step
    assert ends.min() > 0
    assert len(set(ends)) > WORLDS // 2


def test_leaving_the_geofence_ends_an_episode_as_terminated(build, robot, task):
    narrow = replace(robot, limits=replace(robot.limits, geofence=3.99))
    far = replace(task, start=replace(task.start, training_distance=(3.98, 3.98)), episode_s=1000.0)
    env = build(robot=narrow, task=far)
    env.reset()
    _, infos = run_until_done(env, OPEN_ONE)
    ended = next(info for info in infos if info)
    assert ended["TimeLimit.truncated"] is False
    where = ended["terminal_observation"][task.observation_names.index("goal_distance")]
    assert where > 3.99


def test_worlds_that_did_not_end_have_nothing_to_say(build):
    env = build()
    env.reset()
    for _ in range(30):
        _, _, dones, infos = env.step(NONE)
        assert [bool(info) for info in infos] == dones.tolist()


def test_the_same_seed_gives_the_same_story_and_another_gives_another(build):
    def run(env):
        rng = np.random.default_rng(5)
        parts = [env.reset()]
        for _ in range(20):
            seen, rewards, _, _ = env.step((rng.uniform(size=(WORLDS, 8)) > 0.5).astype(np.int8))
            parts += [seen, rewards[:, None]]
        return np.concatenate(parts, axis=1)

    first = run(build("uncertain", seed=1))
    np.testing.assert_array_equal(first, run(build("uncertain", seed=1)))
    assert not np.array_equal(first, run(build("uncertain", seed=2)))
    reseeded = build("uncertain", seed=2)
    assert reseeded.seed(1) == [1] * WORLDS
    np.testing.assert_array_equal(first, run(reseeded))


def test_a_second_reset_repeats_the_same_episodes(build):
    env = build("uncertain")
    first = env.reset()
    env.step(OPEN_ONE)
    np.testing.assert_array_equal(env.reset(), first)


def test_stable_baselines_wrappers_find_what_they_ask_for(build):
    env = VecNormalize(build(), norm_reward=False)
    assert np.isfinite(env.reset()).all()
    assert env.get_attr("render_mode") == [None] * WORLDS
    assert env.env_is_wrapped(VecNormalize, indices=[0, 1]) == [False, False]
    assert env.env_method("seed", 4, indices=[0]) == [[4] * WORLDS]
    env.set_attr("marker", 7)
    assert env.get_attr("marker", indices=[2]) == [7]
    env.close()


def test_dearer_commands_cost_their_multiple(build):
    plain, dear = build("nominal", seed=2), build("nominal", seed=2)
    dear.set_effort(3.0)
    for env in (plain, dear):
        env.reset()
    full = np.ones((WORLDS, 8), dtype=np.int8)
    less = plain.step(full)[1] - dear.step(full)[1]
    np.testing.assert_allclose(less, 2.0 * 0.08 * 8, rtol=1e-4)


def test_a_waypoint_pays_where_the_robot_takes_it_for_reached(build):
    course = load_task("go_through_positions")
    near = 2 * (course.reach + 0.02,)
    env = build(task=replace(course, start_distance=near), robot=load_robot("turtlebot2"))
    env.reset()
    rewards = env.step(np.zeros((WORLDS, 2), dtype=np.float32))[1]
    assert np.all(rewards > 0.9 * course.reward_weights.reached)
