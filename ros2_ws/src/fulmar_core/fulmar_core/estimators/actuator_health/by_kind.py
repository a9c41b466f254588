"""The tables of actuator feedback by kind of robot: what compares actuators with what is applied to them."""

from __future__ import annotations

from fulmar_core.estimators.actuator_health.joint_feedback import ReactionWheelFeedback, SurfaceFeedback
from fulmar_core.estimators.actuator_health.motion_feedback import (
    CarFeedback,
    DriveFeedback,
    PropellerFeedback,
)

# Where a sensor measures each joint.
JOINTS: dict[str, type[SurfaceFeedback] | type[ReactionWheelFeedback]] = {
    "aircraft": SurfaceFeedback,
    "satellite": ReactionWheelFeedback,
}
# By kind and family of actuators: where the motion of the robot shows single ones.
MOTION: dict[tuple[str, str], type[DriveFeedback] | type[CarFeedback] | type[PropellerFeedback]] = {
    ("rolling", "differential_drive"): DriveFeedback,
    ("rolling", "ackermann"): CarFeedback,
    ("planar", "propellers"): PropellerFeedback,
}
