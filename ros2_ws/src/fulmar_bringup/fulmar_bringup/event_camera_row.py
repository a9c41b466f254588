"""Row of the node that simulates the event cameras of a robot."""

from __future__ import annotations

from fulmar_bringup.estimator_row import camera_specs
from fulmar_bringup.node_row import Launcher, NodeRow
from fulmar_bringup.node_spec import NodeSpec
from fulmar_bringup.run_plan import RunPlan


def _specs(plan: RunPlan, _launcher: Launcher) -> tuple[NodeSpec, ...]:
    return camera_specs(plan)


ROW = NodeRow(_specs, ("event_camera",), reports=False)
