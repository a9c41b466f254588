"""Registers every task with Gymnasium as `fulmar/<task>-v0`, when it is imported.

Gymnasium 1.0 loads no plug-ins by itself. Import this module, or name it in the identifier:
`gymnasium.make("training.environments:fulmar/go_to_pose-v0", robot="turtlebot2")`.
"""

from __future__ import annotations

from typing import Any

try:
    import gymnasium
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        "the tasks need gymnasium, which the extra 'gym' brings: make with EXTRA=gym", name=error.name
    ) from error

from fulmar_core.config.paths import config_names
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import Task, load_task
from fulmar_core.worlds.scenario import Scenario, load_scenario
from training.gym_env import TaskEnv, TaskVectorEnv


def task_env(task: str, robot: str | None = None, scenario: str | None = None, **options: Any) -> TaskEnv:
    """Build the environment of one world from names of configuration files.

    Args:
        task: Name that `fulmar list tasks` shows.
        robot: Name that `fulmar list robots` shows; the usual one of the task's kind by default.
        scenario: Name that `fulmar list scenarios` shows; randomised by default, of aircraft nominal.
        **options: `seed` and `training` of `TaskEnv`.

    Raises:
        ConfigError: Unknown name, a mistake in a file, or a robot that the task is not for.
    """
    return TaskEnv(*_parts(task, robot, scenario), **options)


def task_vector_env(
    task: str, robot: str | None = None, scenario: str | None = None, **options: Any
) -> TaskVectorEnv:
    """Build the environment of many worlds; as `task_env`, with `num_envs` among the options."""
    return TaskVectorEnv(*_parts(task, robot, scenario), **options)


def _parts(task: str, robot: str | None, scenario: str | None) -> tuple[Robot, Task, Scenario]:
    the_task = load_task(task)
    the_robot = load_robot(robot or the_task.kinds[0].usual_robot)
    the_task.check(the_robot)
    return the_robot, the_task, load_scenario(scenario or the_robot.kind.usual_scenario)


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
