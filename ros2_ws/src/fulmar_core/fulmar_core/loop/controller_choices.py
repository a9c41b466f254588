"""Controllers that a robot can be given while it runs: a policy, laws, the fallback, and a person."""

from __future__ import annotations

from dataclasses import dataclass

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.by_kind import LAWS, laws_of
from fulmar_core.controllers.classical import check_law
from fulmar_core.controllers.rest import Rest
from fulmar_core.loop.controller_settings import POLICY
from fulmar_core.loop.teleop import can_be_driven
from fulmar_core.robots.robot import Robot
from fulmar_core.tasks import Task

CLASSICAL = "classical"  # the law of a robot's family
FALLBACK, TELEOPERATION = "fallback", "teleoperation"
# Laws that are chosen by their own name; a law that is the only one of its family is called `classical`.
NAMED = frozenset(
    name for families in LAWS.values() for laws in families.values() if len(laws) > 1 for name in laws
)


@dataclass(frozen=True)
class ControllerChoice:
    """One controller that can be chosen."""

    name: str
    title: str


def controller_choices(
    robot: Robot, task: Task, *, bundle: bool = False, fallback: str = "", running: str = ""
) -> tuple[ControllerChoice, ...]:
    """Controllers that a robot can be given at a task, each once.

    Args:
        robot: The robot.
        task: What it does.
        bundle: Whether a policy is shipped for both, or was given.
        fallback: Law that takes over by itself; empty: none.
        running: Name of the controller that runs; it is on the list even where nothing else would put it there.
    """
    laws = law_choices(robot, task)
    found = [ControllerChoice(POLICY, "a learned policy")] if bundle or running == POLICY else []
    if running and running not in (POLICY, *(law.name for law in laws)):
        title = "the law of the robot's family" if running == CLASSICAL else "the controller that was started"
        found.append(ControllerChoice(running, title))
    found += laws
    if fallback:
        found.append(ControllerChoice(FALLBACK, f"the fallback, {fallback}"))
    if can_be_driven(robot):
        found.append(ControllerChoice(TELEOPERATION, Rest.title))
    return tuple(found)


def law_choices(robot: Robot, task: Task) -> list[ControllerChoice]:
    """Classical laws that do a task with a robot, the usual one first."""
    try:
        laws = laws_of(robot)
    except ConfigError:
        return []
    return [
        ControllerChoice(name if name in NAMED else CLASSICAL, entry.law.title)
        for name, entry in laws.items()
        if _does(robot, task, name)
    ]


def _does(robot: Robot, task: Task, law: str) -> bool:
    try:
        check_law(robot, task, law=law)
    except ConfigError:
        return False
    return True
