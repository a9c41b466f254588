"""Bodies in space that reaction wheels turn, and nothing pushes."""

from __future__ import annotations

from fulmar_core.robots.kinds.envelope_axis import DELAY, INERTIA, THRUST_LOSS, EnvelopeAxis
from fulmar_core.robots.kinds.kind import Kind
from fulmar_core.states.spatial import SpatialState

SATELLITE = Kind(
    name="satellite",
    plural="satellites that only turn",
    state_type=SpatialState,
    usual_robot="cubesat_wheels",
    usual_task="point",
    usual_estimator="attitude",
    far_goal=(0.0, 0.0, 0.0, 20.0, -30.0, 90.0),
    goal_forms=(("roll", "pitch", "yaw"),),
    start_forms=(("roll", "pitch", "yaw"),),
    goal_task="slew",
    usual_law="classical",
    recipe="free_flyer",
    always_estimated=True,
    goes_anywhere=False,
    weighs=False,
    drifts=True,
    axes=(3, 4, 5),
    envelope=(
        EnvelopeAxis("angle", "deg", 180.0),
        EnvelopeAxis("turn_rate", "rad/s", 2.0, of="yaw_rate"),
        EnvelopeAxis("torque", "N·m", 0.05, of="torque"),
        INERTIA,
        THRUST_LOSS,
        DELAY,
    ),
    room="attitude",
    pose_form="attitude",
    stops="the wheels' motors go to zero torque; it keeps its turn rate, and the wheels keep their speeds",
)
