"""Registers every task with Gymnasium as `fulmar/<task>-v0`, when it is imported.

Gymnasium 1.0 loads no plug-ins by itself. Import this module, or name it in the identifier:
`gymnasium.make("training.environments:fulmar/go_to_pose-v0", robot="turtlebot2")`.
"""

from __future__ import annotations

from typing import Any

import gymnasium

from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.paths import config_names
from fulmar_core.robot import load_robot
from fulmar_core.tasks import load_task
from training.gym_env import TaskEnv, TaskVectorEnv


def task_env(
    task: str, robot: str = "floating_platform", scenario: str = "randomised", **options: Any
) -> TaskEnv:
    """Build the environment of one world from names of configuration files.

    Args:
        task: Name that `fulmar list tasks` shows.
        robot: Name that `fulmar list robots` shows.
        scenario: Name that `fulmar list scenarios` shows.
        **options: `seed` and `training` of `TaskEnv`.

    Raises:
        ConfigError: Unknown name, or a mistake in a file.
    """
    return TaskEnv(load_robot(robot), load_task(task), load_scenario(scenario), **options)


def task_vector_env(
    task: str, robot: str = "floating_platform", scenario: str = "randomised", **options: Any
) -> TaskVectorEnv:
    """Build the environment of many worlds; as `task_env`, with `num_envs` among the options."""
    return TaskVectorEnv(load_robot(robot), load_task(task), load_scenario(scenario), **options)


def environment_id(task: str) -> str:
    """Identifier of a task in Gymnasium's registry."""
    return f"fulmar/{task}-v0"


def register_tasks() -> None:
    """Register the tasks of Fulmar and of the folders in FULMAR_CONFIGS that are not registered yet."""
    for task in config_names("tasks"):
        if environment_id(task) not in gymnasium.registry:
            gymnasium.register(
                environment_id(task),
                entry_point="training.environments:task_env",
                vector_entry_point="training.environments:task_vector_env",
                kwargs={"task": task},
            )


register_tasks()
