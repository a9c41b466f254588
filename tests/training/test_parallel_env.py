"""`swap_places` as a parallel environment: the API test of PettingZoo, equal robots, and when episodes end."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("pettingzoo")

from pettingzoo.test import parallel_api_test

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from training.parallel_env import OTHER_TERMS, TOUCHED, SwapPlacesEnv

ROBOT, TASK, SCENARIO = load_robot("floating_platform"), load_task("go_to_pose"), load_scenario("nominal")


def environment(**more):
    return SwapPlacesEnv(ROBOT, TASK, SCENARIO, **more)


def rest(env):
    return {name: np.zeros(8, dtype=np.int8) for name in env.agents}


def test_the_api_test_of_pettingzoo_accepts_it():
    parallel_api_test(environment(robots=3), num_cycles=200)


def test_one_seed_gives_the_same_episodes_and_another_reset_the_next_one():
    first, second = environment(), environment(seed=9)
    for env in (first, second):
        env.reset(seed=4)
    again, other = first.reset()[0], second.reset()[0]
    for name in first.agents:
        np.testing.assert_array_equal(again[name], other[name])
    begin = first.reset(seed=4)[0]
    assert not np.array_equal(begin["robot_0"], again["robot_0"])


def test_each_robot_sees_the_others_from_its_own_body():
    env = environment(robots=2)
    seen, _ = env.reset(seed=1)
    own, other = (seen[name][-OTHER_TERMS:] for name in ("robot_0", "robot_1"))
    assert np.hypot(*own[:2]) == pytest.approx(np.hypot(*other[:2]), rel=0.05)
    assert np.hypot(*own[:2]) > 2.0 * ROBOT.body.radius


def test_an_episode_ends_for_all_where_two_hulls_overlap():
    env = environment(robots=2)
    env.reset(seed=1)
    truth = env._worlds.simulation.truth
    truth.x[1], truth.y[1] = truth.x[0] + 0.3, truth.y[0]
    _, reward, terminated, truncated, _ = env.step(rest(env))
    assert terminated == {"robot_0": True, "robot_1": True} and not any(truncated.values())
    assert all(each < 0.5 * TOUCHED for each in reward.values()) and env.agents == []


def test_an_episode_is_truncated_after_the_time_of_the_task():
    env = environment(robots=2)
    env.reset(seed=1)
    steps = 0
    while env.agents:
        _, _, terminated, truncated, _ = env.step(rest(env))
        steps += 1
    assert all(truncated.values()) and not any(terminated.values())
    assert steps == round(TASK.episode_s * ROBOT.timing.control_hz)


def test_a_fleet_of_one_and_a_task_without_poses_are_refused():
    with pytest.raises(ConfigError, match="robots: found 1, need at least 2"):
        environment(robots=1)
    with pytest.raises(ConfigError, match="'go_to_position' is none"):
        SwapPlacesEnv(ROBOT, load_task("go_to_position"), SCENARIO)
