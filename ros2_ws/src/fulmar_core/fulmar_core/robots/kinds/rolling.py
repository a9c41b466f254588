"""Robots on driven wheels."""

from __future__ import annotations

from fulmar_core.robots.kinds.envelope_axis import DELAY, DISTANCE, THRUST_LOSS, VELOCITY_NOISE
from fulmar_core.robots.kinds.kind import FAR_M, Kind
from fulmar_core.states.planar import PlanarState

ROLLING = Kind(
    name="rolling",
    plural="robots on wheels",
    state_type=PlanarState,
    usual_robot="turtlebot2",
    usual_task="go_to_pose",
    usual_estimator="mocap_imu",
    far_goal=(FAR_M, 0.0, 0.0),
    goal_forms=(("x", "y"),),
    start_forms=(("x", "y"),),
    other_task="go_to_position",
    velocity_form=("ahead", "left", "turning"),
    velocity_task="track_velocities",
    axes=(0, 1, 5),
    envelope=(DISTANCE, THRUST_LOSS, DELAY, VELOCITY_NOISE),
    stops="the wheels slow down and stop; it stands still",
)
