"""Row of the node that draws what a simulated robot's camera sees."""

from __future__ import annotations

from fulmar_bringup.estimator_row import chain_spec
from fulmar_bringup.node_row import NodeRow
from fulmar_bringup.node_spec import NodeSpec, given
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.robots.topics import CAMERA_IMAGES, CAMERA_INFO, TRUTH
from fulmar_core.tasks import load_task

CAMERA = "camera"


def image_specs(plan: RunPlan) -> tuple[NodeSpec, ...]:
    """The node, where it is asked for. It controls nothing: by the clock a robot goes on without it."""
    if CAMERA not in plan.extras:
        return ()
    things = load_task(plan.task, plan.thing).things
    blocks = tuple(thing.wire for thing in things if thing.body is not None)
    parameters = given(robot=plan.robot, task=plan.task, thing=plan.thing)
    outputs = (*CAMERA_IMAGES, CAMERA_INFO)
    loss = plan.loss_of_helpers
    module = "sim_nodes.camera_node"
    return (chain_spec(plan, CAMERA, module, parameters, (TRUTH, *blocks), (), outputs, (), loss=loss),)


ROW = NodeRow(lambda plan, _: image_specs(plan), (CAMERA,), beats=True)
