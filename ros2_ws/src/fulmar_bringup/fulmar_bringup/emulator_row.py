"""Row of the node that stands in for a device."""

from __future__ import annotations

from fulmar_bringup.emulation import Emulation
from fulmar_bringup.node_row import NodeRow, robot_spec
from fulmar_bringup.node_spec import NodeSpec, Parameter
from fulmar_bringup.plant_row import motion_capture
from fulmar_bringup.run_plan import ORIGIN, RunPlan
from fulmar_core.robots.topics import DEVICE_STATE, MOCAP


def emulator_spec(plan: RunPlan, emulation: Emulation) -> NodeSpec:
    """The node that stands in for a device."""
    parameters: dict[str, Parameter] = {
        "robot": plan.robot,
        "task": plan.task,
        "scenario": plan.scenario,
        "seed": plan.seed,
        "start": list(plan.start or ORIGIN),
        "device": emulation.device,
        "link": emulation.link,
        **emulation.more,
    }
    parameters |= motion_capture(plan)
    return robot_spec(
        plan,
        "emulator",
        "sim_nodes.emulator_node",
        parameters,
        outputs=(DEVICE_STATE.name, MOCAP.name),
    )


ROW = NodeRow(
    lambda plan, launcher: () if launcher.emulation is None else (emulator_spec(plan, launcher.emulation),),
    ("emulator",),
    reports=False,
)
