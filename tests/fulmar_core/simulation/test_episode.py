"""Episodes: the same by seed and number, whichever way they are run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episode, draw_episodes, episode_steps
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from fulmar_core.worlds.world import FIELDS

ROBOT, TASK, RANDOMISED = (
    load_robot("floating_platform"),
    load_task("go_to_pose"),
    load_scenario("randomised"),
)
PARTS = (("start", PlanarState.COLUMNS), ("goal", ("targets", "done", "obstacles")), ("world", FIELDS))


def draw(numbers, *, seed=7, scenario=RANDOMISED, task=TASK, **kwargs):
    return draw_episodes(ROBOT, task, scenario, seed=seed, numbers=np.asarray(numbers), **kwargs)


def same(one, other, parts=PARTS):
    return all(
        np.array_equal(getattr(getattr(one, part), name), getattr(getattr(other, part), name))
        for part, names in parts
        for name in names
    )


def test_the_same_seed_and_number_give_the_same_episode():
    assert same(draw([3])[0], draw([3])[0])


def test_seed_number_and_repeat_each_make_another_episode():
    episodes = [draw([3])[0], draw([4])[0], draw([3], seed=8)[0], draw([3], repeats=np.array([1]))[0]]
    starts = {(float(e.start.x), float(e.start.y), float(e.world.mass)) for e in episodes}
    assert len(starts) == 4


@pytest.mark.parametrize(
    "task", ["go_to_pose", "track_velocities", "go_through_positions", "go_to_position_with_obstacles"]
)
def test_an_episode_is_the_same_alone_and_among_others(task):
    task = load_task(task)
    many = draw(range(20), task=task)
    for number in (0, 7, 19):
        assert same(many[number], draw_episode(ROBOT, task, RANDOMISED, seed=7, number=number))
        assert same(many[number], draw([11, number, 2], task=task)[1])


def test_start_and_goal_do_not_depend_on_the_scenario():
    randomised, ideal = draw(range(5)), draw(range(5), scenario=load_scenario("ideal"))
    assert same(randomised, ideal, PARTS[:2])
    assert not same(randomised, ideal, PARTS[2:])


@pytest.mark.parametrize("worlds", [1, 3, 8])
def test_the_batch_starts_the_very_episodes_whatever_its_size(worlds):
    simulation = BatchSimulation(ROBOT, TASK, RANDOMISED, worlds=worlds, seed=7, dtype=np.float64)
    drawn = draw(range(worlds))
    for part, mine in (("start", simulation.truth), ("goal", simulation.goal), ("world", simulation.world)):
        for name in dict(PARTS)[part]:
            np.testing.assert_array_equal(getattr(mine, name), getattr(getattr(drawn, part), name))


def test_evaluated_episodes_start_in_the_ring_of_the_task_and_training_reaches_the_goal():
    def distances(training):
        drawn = draw(range(400), training=training)
        target = drawn.goal.current
        return np.hypot(drawn.start.x - target[:, 0], drawn.start.y - target[:, 1])

    evaluated, learned = distances(False), distances(True)
    low, high = TASK.start.distance
    assert low <= evaluated.min()
    assert evaluated.max() <= high
    assert learned.min() < 0.2 < low  # 400 draws of [0, 5] miss [0, 0.2] with a chance of 1e-7
    assert learned.max() <= TASK.start.training_distance[1]


def test_episodes_start_at_rest_with_any_heading():
    start = draw(range(200)).start
    assert not any(getattr(start, name).any() for name in ("vx", "vy", "yaw_rate"))
    assert set(np.floor(start.yaw / (np.pi / 2))) == {-2.0, -1.0, 0.0, 1.0}


def test_an_episode_is_as_many_control_steps_as_its_time_holds():
    assert episode_steps(replace(TASK, episode_s=60.0), 0.1) == 600
    with pytest.raises(ConfigError, match=r"an episode of task 'go_to_pose' lasts 0\.05 s, less than one"):
        episode_steps(replace(TASK, episode_s=0.05), 0.2)
