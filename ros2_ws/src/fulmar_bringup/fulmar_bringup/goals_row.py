"""Row of the node that publishes goals from a file."""

from __future__ import annotations

from dataclasses import replace

from fulmar_bringup.goal_plan import goal_rate, is_path_of_places
from fulmar_bringup.node_row import NodeRow
from fulmar_bringup.node_spec import NodeSpec, Parameter, given, node_spec
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.robots.topics import GOAL_WIRES, ODOMETRY
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
    parameters: dict[str, Parameter] = {"goals": goals, "robot": robot}
    parameters |= {"control_hz": control_hz, "as_path": as_path}
    parameters |= given(give_up_s=give_up_s)
    wires = {"inputs": (ODOMETRY.name,), "outputs": tuple(GOAL_WIRES)}
    return node_spec(namespace_of(name or robot), "goals", "fulmar_ros.goal_node", parameters, **wires)


def run_goals_spec(plan: RunPlan) -> NodeSpec:
    """The node that publishes the goals of a run, for as long as the run lasts."""
    spec = goals_spec(
        plan.robot,
        plan.goals,
        name=plan.name,
        as_path=is_path_of_places(load_task(plan.task, plan.thing)),
        control_hz=goal_rate(plan.control_hz),
    )
    more: dict[str, Parameter] = {"stay": True, "lockstep": plan.lockstep, "rate": plan.rate}
    return replace(
        spec,
        parameters=spec.parameters | more,
        remappings=dict(plan.remappings),
        loss=plan.loss_of_helpers,
    )


ROW = NodeRow(
    lambda plan, _: (run_goals_spec(plan),) if plan.goals else (),
    ("goals",),
    shown=False,
    resume=lambda said: given(place=said.get("place")),
)
