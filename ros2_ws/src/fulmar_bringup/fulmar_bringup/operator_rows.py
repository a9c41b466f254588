"""The table's rows of nodes for people: goals from a file, teleoperation, and what viewers draw."""

from __future__ import annotations

from dataclasses import replace

from fulmar_bringup.estimator_rows import robot_row
from fulmar_bringup.goal_plan import goal_rate, is_path_of_places
from fulmar_bringup.node_loss import RESTARTS
from fulmar_bringup.run_plan import NodeSpec, Parameter, RunPlan, node_row
from fulmar_core.robots.topics import (
    ACTUATORS_STATE,
    DIAGNOSTICS,
    GOAL_WIRES,
    JOY,
    MARKERS,
    OBSTACLES,
    ODOMETRY,
    STATUS,
    TELEOP,
    goal_wires,
)
from fulmar_core.safety.geofence import NO_AREA
from fulmar_core.tasks import load_task
from fulmar_core.wires.robot_name import namespace_of


def goals_spec(
    robot: str,
    goals: str,
    *,
    name: str = "",
    as_path: bool = False,
    control_hz: float = 10.0,
    give_up_s: float = 0.0,
) -> NodeSpec:
    """The node that publishes goals from a file; no system has it by itself.

    Args:
        robot: Type of the robot that is to do it.
        goals: Name of a file in `configs/goals`, or a path that ends in `.yaml`.
        name: What the robot is called; its type by default.
        as_path: Publish all positions or poses at once.
        control_hz: Velocities come so often along a path [Hz].
        give_up_s: Ends with exit code 1 where robot or controller are not there after so long; 0: waits [s].
    """
    parameters: dict[str, Parameter] = {
        "goals": goals,
        "robot": robot,
        "control_hz": control_hz,
        "as_path": as_path,
    }
    if give_up_s:
        parameters["give_up_s"] = give_up_s
    wires = {"inputs": (ODOMETRY.name,), "outputs": tuple(GOAL_WIRES)}
    return node_row(namespace_of(name or robot), "goals", "fulmar_ros.goal_node", parameters, **wires)


def run_goals_spec(plan: RunPlan) -> NodeSpec:
    """The node that publishes the goals of a run, for as long as the run lasts."""
    spec = goals_spec(
        plan.robot,
        plan.goals,
        name=plan.name,
        as_path=is_path_of_places(load_task(plan.task)),
        control_hz=goal_rate(plan.control_hz),
    )
    more: dict[str, Parameter] = {"stay": True, "lockstep": plan.lockstep, "rate": plan.rate}
    return replace(
        spec,
        parameters=spec.parameters | more,
        remappings=dict(plan.remappings),
        loss=plan.loss_of_helpers,
    )


def markers_spec(plan: RunPlan) -> NodeSpec:
    """The node that draws for viewers; nothing depends on it."""
    task, area = load_task(plan.task), plan.guards.area
    parameters: dict[str, Parameter] = {"robot": plan.robot, "task": plan.task}
    if area != NO_AREA:
        parameters["area"] = list(area)
    goals = (wire.name for wire in goal_wires(task.goal_topic))
    return robot_row(
        plan,
        "markers",
        "fulmar_ros.markers_node",
        parameters,
        observed=(*goals, OBSTACLES.name, ACTUATORS_STATE.name, STATUS.name, DIAGNOSTICS.name),
        outputs=(MARKERS.name,),
        optional=True,
        loss=RESTARTS,
    )


def teleop_spec(robot: str, *, name: str = "", keyboard: bool = True, share: float = 0.5) -> NodeSpec:
    """The node that a person drives with; it starts beside a system that runs, and no system has it by itself.

    Args:
        robot: Type of the robot.
        name: What the robot is called; its type by default.
        keyboard: Whether keys drive, or only joysticks.
        share: Of full command.
    """
    parameters: dict[str, Parameter] = {"robot": robot, "keyboard": keyboard, "share": share}
    wires = {"outputs": (TELEOP.name,), "observed": (JOY.name,)}
    return node_row(namespace_of(name or robot), "teleop", "fulmar_ros.teleop_node", parameters, **wires)
