"""Episodes in batches of any size: the same figures, number for number."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.loop.rollout import batches, roll_out_in_batch
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.metrics import join, select
from fulmar_core.simulation.trajectories import COLUMNS
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario


class Eager:
    """Commands that depend on what is seen, for any robot."""

    name = "eager"
    estimator = None
    readings, observer = (), None

    def __init__(self, robot, task):
        self.control_hz = robot.timing.control_hz
        self._robot = robot

    def reset(self):
        pass

    def act(self, inputs):
        seen = np.cumsum(np.sin(7.0 * inputs.observation), axis=-1)
        return seen[..., : len(self._robot.actuators.names)] * self._robot.actuators.scale

    def metadata(self):
        return {}


def roll_out(robot, task, scenario, *, episodes=8, worlds):
    robot, task = load_robot(robot), replace(load_task(task), episode_s=3.0)
    controller, world = Eager(robot, task), load_scenario(scenario)
    return list(batches(controller, robot, task, world, episodes=episodes, seed=5, worlds=worlds))


def assert_same(run, other):
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(run, name), getattr(other, name), err_msg=name)


@pytest.mark.parametrize("scenario", ["nominal", "randomised"])
@pytest.mark.parametrize(
    ("robot", "task"),
    [
        ("floating_platform", "go_to_pose"),
        ("kingfisher", "go_through_positions"),
        ("turtlebot2", "go_to_position_with_obstacles"),
        ("leatherback", "track_velocities"),
    ],
)
def test_an_episode_is_the_same_among_few_and_among_many(robot, task, scenario):
    whole = roll_out(robot, task, scenario, worlds=100)
    parts = roll_out(robot, task, scenario, worlds=3)
    assert [len(run.x) for run in whole] == [8]
    assert [len(run.x) for run in parts] == [3, 3, 2]
    assert_same(join(parts), whole[0])
    assert_same(roll_out(robot, task, scenario, episodes=2, worlds=2)[0], select(whole[0], np.arange(2)))


def test_progress_counts_every_control_step_once():
    robot, task = load_robot("turtlebot2"), replace(load_task("go_to_pose"), episode_s=0.4)
    steps_done = []
    run = roll_out_in_batch(
        Eager(robot, task),
        robot,
        task,
        load_scenario("nominal"),
        episodes=5,
        seed=1,
        progress=steps_done.append,
    )
    assert run.x.shape == (5, 4)
    assert steps_done == [5, 10, 15, 20]
