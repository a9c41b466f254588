"""Row of the node that records."""

from __future__ import annotations

from dataclasses import asdict

from fulmar_bringup.lockstep_chain import chain_of
from fulmar_bringup.node_row import NodeRow, robot_spec
from fulmar_bringup.node_spec import NodeSpec, given
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.config.recording import Recording
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import CAMERA_IMAGES, WIRES, own_wires
from fulmar_core.tasks import load_task

WRITES_WITHIN_S = 20.0  # what it still holds at its end, on a slow disk or a busy computer [s]


def recorder_spec(plan: RunPlan, *, directory: str = "", info: str = "", files: str = "") -> NodeSpec:
    """The node that records.

    Args:
        plan: What to run.
        directory: The bag folder; empty: the node makes one under `runs/`.
        info: As `bag_origin.run_info` gives it.
        files: As `bag_origin.attachments` gives it.
    """
    things, own = load_task(plan.task, plan.thing).things, own_wires(load_robot(plan.robot))
    usual = asdict(Recording())
    unusual = {key: value for key, value in asdict(plan.recording).items() if value != usual[key]}
    texts = given(directory=directory, run_info=info, attachments=files)
    more = given(
        lossless=bool(chain_of(plan)),
        things=[thing.name for thing in things],
        own_topics=[f"{wire.name} {wire.type}" for wire in own],
    )
    return robot_spec(
        plan,
        "recorder",
        "fulmar_ros.recorder_node",
        texts | unusual | more,
        observed=tuple(
            wire.name
            for wire in (*WIRES, *own, *(thing.wire for thing in things))
            if wire.recorded or wire in CAMERA_IMAGES
        ),
        loss=plan.loss_of_helpers,
        patience_s=WRITES_WITHIN_S,
    )


ROW = NodeRow(
    lambda plan, launcher: () if launcher.record is None else (recorder_spec(plan, **launcher.record),),
    ("recorder",),
    beats=True,
    resume=lambda _: {"resume": True},
)
