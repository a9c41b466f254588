"""Robots that actuators push in the plane: on air bearings, and boats."""

from __future__ import annotations

from fulmar_core.robots.kinds.envelope_axis import PUSHED, EnvelopeAxis
from fulmar_core.robots.kinds.kind import FAR_M, Kind
from fulmar_core.states.planar import PlanarState

PLANAR = Kind(
    name="planar",
    plural="robots that are pushed over a floor or water",
    state_type=PlanarState,
    usual_robot="floating_platform",
    usual_task="go_to_pose",
    usual_estimator="mocap_imu",
    far_goal=(FAR_M, 0.0, 0.0),
    goal_forms=(("x", "y"),),
    start_forms=(("x", "y"),),
    other_task="go_to_position",
    velocity_form=("ahead", "left", "turning"),
    velocity_task="track_velocities",
    drifts=True,
    calibrated=("mass", "yaw_inertia", "center_of_mass_x", "center_of_mass_y", "delay"),
    axes=(0, 1, 5),
    envelope=(
        *PUSHED,
        EnvelopeAxis("force", "N", 0.1, of="force", water=True),
        EnvelopeAxis("torque", "N·m", 0.2, of="torque", water=True),
        EnvelopeAxis("drag", "x", 1.5, 1.0, water=True),
    ),
)
