"""Episodes: the same by seed and number, whichever way they are run."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.episode import NOISE, START, WORLD, draw_episode, episode_rng
from fulmar_core.robot import load_robot
from fulmar_core.simulation import BatchSimulation
from fulmar_core.tasks import load_task

ROBOT, TASK, UNCERTAIN = load_robot("floating_platform"), load_task("go_to_pose"), load_scenario("uncertain")


def draw(number=0, *, seed=7, **kwargs):
    return draw_episode(ROBOT, TASK, kwargs.pop("scenario", UNCERTAIN), seed=seed, number=number, **kwargs)


def key(episode):
    return (
        *episode.start.position_in_world,
        *episode.start.quat_xyzw,
        *episode.goal.position_in_world,
        episode.world,
    )


def test_the_same_seed_and_number_give_the_same_episode():
    assert key(draw(3)) == key(draw(3))


def test_seed_number_and_repeat_each_make_another_episode():
    assert len({key(draw(3)), key(draw(4)), key(draw(3, seed=8)), key(draw(3, repeat=1))}) == 4


def test_no_two_streams_of_random_numbers_overlap():
    names = itertools.product((0, 1, 2**40), (0, 1, 2**40), (0, 1, 5), (START, NOISE, WORLD))
    rngs = [episode_rng(seed, number, repeat=repeat, stream=stream) for seed, number, repeat, stream in names]
    numbers = np.concatenate([rng.integers(0, 2**63, 1000) for rng in rngs])
    assert len(np.unique(numbers)) == numbers.size  # of 81,000 in 2^63; a chance hit has odds of 4e-10


def test_start_and_goal_do_not_depend_on_the_scenario():
    uncertain, ideal = draw(5), draw(5, scenario=load_scenario("ideal"))
    assert key(uncertain)[:-1] == key(ideal)[:-1]
    assert uncertain.world != ideal.world


@pytest.mark.parametrize("worlds", [1, 3, 8])
def test_the_batch_starts_the_very_episodes_whatever_its_size(worlds):
    simulation = BatchSimulation(ROBOT, TASK, UNCERTAIN, worlds=worlds, seed=7, dtype=np.float64)
    for number in range(worlds):
        episode = draw(number)
        np.testing.assert_array_equal(
            simulation.truth.position_in_world[number], episode.start.position_in_world
        )
        np.testing.assert_array_equal(simulation.truth.quat_xyzw[number], episode.start.quat_xyzw)
        np.testing.assert_array_equal(
            simulation.goal.position_in_world[number], episode.goal.position_in_world
        )


def test_judged_episodes_start_in_the_ring_of_the_task_and_training_reaches_the_goal():
    def distances(training):
        episodes = [draw(i, training=training) for i in range(200)]
        return np.array(
            [np.linalg.norm(e.start.position_in_world - e.goal.position_in_world) for e in episodes]
        )

    judged, learned = distances(False), distances(True)
    low, high = TASK.start.distance
    assert low <= judged.min()
    assert judged.max() <= high
    assert learned.min() < 0.2 < low  # 200 draws of [0, 4] miss [0, 0.2] with a chance of 4e-5
    assert learned.max() <= TASK.start.training_distance[1]


def test_episodes_start_at_rest_with_any_heading():
    episodes = [draw(i) for i in range(200)]
    assert not any(
        e.start.velocity_in_world.any() or e.start.angular_velocity_in_body.any() for e in episodes
    )
    quadrants = {int(np.floor(float(e.start.yaw) / (np.pi / 2))) for e in episodes}
    assert quadrants == {-2, -1, 0, 1}
