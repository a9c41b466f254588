"""Row of the node that simulates the event cameras of a robot."""

from __future__ import annotations

from fulmar_bringup.estimator_row import camera_specs
from fulmar_bringup.node_row import NodeRow

ROW = NodeRow(lambda plan, _: camera_specs(plan), ("event_camera",), reports=False)
