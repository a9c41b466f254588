"""Episodes: everything that is drawn before the first step, reproducible by seed and number.

Episode i of a seed is the same in the core's batch, in MuJoCo and through ROS, whatever the batch size.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.disturbances.scenario import Scenario, World, draw_world
from fulmar_core.errors import ConfigError
from fulmar_core.robot import Robot
from fulmar_core.state import Pose, RigidBodyState
from fulmar_core.tasks import Task

JUDGE_SEED = 2026  # of episodes that finished controllers are judged on
HELD_OUT_SEED = 1_000_003  # of episodes that learners are checked on
JUDGING_SEEDS = (JUDGE_SEED, HELD_OUT_SEED)  # no training seeds: no run shall have learned from them


@dataclass(frozen=True, slots=True)
class Episode:
    """Where one episode starts, where it shall go, and in which world."""

    start: RigidBodyState
    goal: Pose
    world: World


START, NOISE, WORLD = 0, 1, 2  # streams of random numbers that do not disturb one another


def episode_steps(task: Task, control_dt: float) -> int:
    """Control steps of one episode.

    Args:
        task: Says how long an episode lasts.
        control_dt: Time of one control step [s].

    Returns:
        Number of steps, >= 1.

    Raises:
        ConfigError: The episode is shorter than one control step.
    """
    steps = round(task.episode_s / control_dt)
    if steps < 1:
        raise ConfigError(
            f"an episode of task '{task.name}' lasts {task.episode_s:g} s, less than one control step of "
            f"{control_dt:g} s. Use a higher rate or a longer episode."
        )
    return steps


def episode_rng(seed: int, number: int, *, repeat: int = 0, stream: int = START) -> np.random.Generator:
    """Counter-based generator of one episode.

    Args:
        seed: Seed of the run, >= 0.
        number: Number of the episode, or of the world it runs in, >= 0.
        repeat: How many episodes that world has had before, >= 0.
        stream: START for start and goal, WORLD for body and wrench, NOISE for the sensors during the steps.

    Returns:
        A generator that no other (seed, number, repeat, stream) shares.
    """
    return np.random.Generator(np.random.Philox(key=[seed, number], counter=[0, 0, stream, repeat]))


def draw_episode(
    robot: Robot,
    task: Task,
    scenario: Scenario,
    *,
    seed: int,
    number: int,
    repeat: int = 0,
    training: bool = False,
) -> Episode:
    """Draw one episode.

    Args:
        robot: The robot.
        task: Says where episodes start.
        scenario: Says what may differ.
        seed: Seed of the run, >= 0.
        number: Number of the episode, or of the world it runs in, >= 0.
        repeat: How many episodes that world has had before, >= 0.
        training: Start where learning starts instead of where judging does.

    Returns:
        The episode.
    """
    start, goal = task.start.draw(episode_rng(seed, number, repeat=repeat), training=training)
    world = draw_world(robot, scenario, episode_rng(seed, number, repeat=repeat, stream=WORLD))
    return Episode(start, goal, world)
