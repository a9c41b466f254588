"""Bodies in space that thrusters or fans push and turn."""

from __future__ import annotations

from fulmar_core.robots.kinds.envelope_axis import PUSHED
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
    goal_forms=(("x", "y", "z"),),
    start_forms=(("x", "y", "z"),),
    other_task="go_to_position_3d",
    velocity_form=("ahead", "left", "up", "roll", "pitch", "yaw"),
    velocity_task="track_velocities_3d",
    asked_back=(
        (3,),
        "its usual goal has 6: --goal x,y,z,roll,pitch,yaw [m, deg]. For a place x,y,z with any attitude add "
        "--task go_to_position_3d",
    ),
    recipe="free_flyer",
    weighs=False,
    drifts=True,
    calibrated=(*PLANAR.calibrated, "roll_inertia", "pitch_inertia", "center_of_mass_z"),
    room="space",
    pose_form="pose3",
    envelope=PUSHED,
)
