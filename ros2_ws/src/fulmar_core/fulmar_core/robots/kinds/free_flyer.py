"""Bodies in space that thrusters or fans push and turn."""

from __future__ import annotations

from fulmar_core.robots.kinds.kind import Kind
from fulmar_core.robots.kinds.planar import PLANAR
from fulmar_core.states.spatial import SpatialState

FREE_FLYER = Kind(
    name="free_flyer",
    plural="bodies that are pushed in space",
    state_type=SpatialState,
    usual_robot="spacecraft_16",
    usual_task="go_to_pose_3d",
    usual_estimator="mocap_imu_3d",
    far_goal=(4.0, 4.0, 2.0, 20.0, -30.0, 90.0),
    recipe="free_flyer",
    weighs=False,
    drifts=True,
    calibrated=(*PLANAR.calibrated, "roll_inertia", "pitch_inertia", "center_of_mass_z"),
)
