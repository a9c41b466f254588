"""What is asked of a robot that has lost too many valves to hold a pose: the place, whatever the heading.

Where no mean wrench is left in some direction (`fulmar_core.holdability`), a platform that turns its working nozzles to
where it has to brake can still come to rest at its goal. A reward that asks for the heading all the way there keeps it
from learning that.
"""

from __future__ import annotations

from dataclasses import replace

from fulmar_core.disturbances.scenario import Scenario
from fulmar_core.tasks import Task
from fulmar_core.tasks.go_to_pose import GoToPose


def asked_for(task: Task, scenario: Scenario) -> Task:
    """The task with the weights that count in a scenario: other ones where all failures strand the robot."""
    if not (scenario.actuation.stranding and isinstance(task, GoToPose) and task.stranded_weights):
        return task
    return replace(task, reward_weights=task.stranded_weights)
