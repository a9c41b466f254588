"""Aircraft: wings carry them, and they cannot stop."""

from __future__ import annotations

from dataclasses import replace

from fulmar_core.robots.kinds.envelope_axis import MASS, THRUST_LOSS, VELOCITY_NOISE, EnvelopeAxis
from fulmar_core.robots.kinds.kind import Kind
from fulmar_core.states.spatial import SpatialState

AIRCRAFT = Kind(
    name="aircraft",
    plural="aircraft",
    state_type=SpatialState,
    usual_robot="airship_v7",
    usual_task="fly_hold",
    usual_estimator="mocap_imu_3d",
    far_goal=(0.0, 0.0, 1.0, 0.0, 0.0, 0.0),  # where it begins: it goes on along x for ever
    goal_forms=(("roll", "pitch", "yaw"),),
    start_forms=(("x", "y", "z"),),
    other_task="fly_attitude",
    velocity_form=("ahead",),
    velocity_task="fly_airspeed",
    height_task="fly_hold",
    asked_back=(
        (3, 6),
        "it cannot stop at a place. Say --height H [m] or --velocity V [m/s] instead, or, for a bank and a pitch, "
        "--task fly_attitude --goal roll,pitch,yaw [deg]",
    ),
    goal_task="fly_hold",
    usual_law="lqi",
    recipe="aircraft",
    # The delays of `randomised` are longer than the control step of an aircraft.
    usual_scenario="nominal",
    stays=False,
    rests=False,
    obstacle="the water or the ground",
    outdoors=True,
    room="flight",
    pose_form="attitude",
    envelope=(
        EnvelopeAxis("height", "m", 2.0),
        EnvelopeAxis("tilt", "deg", 5.0),
        EnvelopeAxis("turn_rate", "rad/s", 1.0, of="yaw_rate"),
        EnvelopeAxis("wind", "m/s", 1.5),
        EnvelopeAxis("turbulence", "m/s", 4.0),
        replace(MASS, high=1.15),
        EnvelopeAxis("inertia", "x", 1.5, 1.0),
        replace(THRUST_LOSS, high=0.2),
        EnvelopeAxis("delay", "s", 0.03),
        replace(VELOCITY_NOISE, high=0.1),
    ),
    stops="the safe controller flies level and descends; it does not stand still",
)
