"""What X-Plane says of an aircraft, as odometry, inertial reading and air data in the frames of ROS.

X-Plane's local axes point east, up and south; its angles are those of sailors, in degrees; its beta is the heading
relative to the flown path, which is sideslip with the other sign. The signs follow the descriptions of the data
references; they are not tested on X-Plane itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fulmar_core.robots.sensors.air_data import AirData, AirDataSpec
from fulmar_core.robots.sensors.imu import ImuSample
from fulmar_core.states.rotation import from_yaw, multiply, rotate, rotate_inverse
from fulmar_core.states.state import RigidBodyState
from hardware_drivers.earth_frame import LocalFrame, attitude, sailed_angles
from hardware_drivers.xplane_messages import Position, Values
from hardware_drivers.xplane_protocol import MalformedError

G = 9.80665  # [m/s²]
PLACE = "sim/flightmodel/position/"
ASKED = (
    *(f"{PLACE}local_v{axis}" for axis in "xyz"),  # [m/s]
    *(f"{PLACE}local_a{axis}" for axis in "xyz"),  # [m/s²]
    *(f"{PLACE}{rate}" for rate in "PQR"),  # roll right, pitch up, yaw right [deg/s]
    f"{PLACE}true_airspeed",  # [m/s]
    f"{PLACE}alpha",  # [deg]
    f"{PLACE}beta",  # [deg]
    f"{PLACE}y_agl",  # above the ground or the water [m]
    "sim/time/total_flight_time_sec",  # stands still while X-Plane is paused by its key P [s]
)


@dataclass(frozen=True)
class Flight:
    """An aircraft at one instant."""

    state: RigidBodyState  # in the local frame, z above mean sea level
    imu: ImuSample
    air: AirData  # all of `AirDataSpec.NAMES`
    time_s: float  # of X-Plane


def check_place(position: Position) -> None:
    """Reject places that are none on Earth; raises MalformedError."""
    if not (abs(position.latitude) <= 90.0 and abs(position.longitude) <= 180.0):
        raise MalformedError(f"POSI has latitude {position.latitude:g}, longitude {position.longitude:g}")


def flight_of(position: Position, answer: Values, frame: LocalFrame) -> Flight:
    """Read two answers of one frame.

    Args:
        position: Answer to GETP.
        answer: Answer to GETD for `ASKED`.
        frame: East and north of its origin.

    Raises:
        MalformedError: A value is missing, or the place is too coarse to fly by.
    """
    if position.coarse:
        raise MalformedError(
            "POSI of 34 bytes has places in float32, good to 0.5 m: install XPlaneConnect 1.3"
        )
    if len(answer.values) != len(ASKED):
        raise MalformedError(f"RESP has {len(answer.values)} values, {len(ASKED)} were asked for")
    missing = [name for name, found in zip(ASKED, answer.values, strict=True) if len(found) != 1]
    if missing:
        raise MalformedError(f"RESP has no value of {missing[0]}")
    vx, vy, vz, ax, ay, az, p, q, r, airspeed, alpha, beta, height, time_s = (
        found[0] for found in answer.values
    )
    east, north = frame.metres(position.latitude, position.longitude)
    angles = (math.radians(angle) for angle in (position.roll, position.pitch, position.heading))
    quat, rates = attitude(*angles), np.radians((p, -q, -r))
    state = RigidBodyState(np.array([east, north, position.altitude]), quat, np.array([vx, -vz, vy]), rates)
    force = rotate_inverse(quat, np.array([ax, -az, ay + G]))
    air = np.array([airspeed, math.radians(alpha), -math.radians(beta), height])
    return Flight(state, ImuSample(force, rates), AirData(AirDataSpec.NAMES, air), time_s)


@dataclass(frozen=True)
class Placed:
    """Where `odom` begins, and where its x axis points."""

    origin: np.ndarray  # (3,) in the local frame [m]
    place: np.ndarray  # (3,) of that in `odom` [m]
    turn: np.ndarray  # (4,) from the local frame, about z

    @classmethod
    def unmoved(cls, elevation: float) -> Placed:
        """The local frame itself, with z from an elevation above mean sea level on [m]."""
        return cls(np.array([0.0, 0.0, elevation]), np.zeros(3), from_yaw(np.zeros(())))

    @classmethod
    def at(cls, seen: RigidBodyState, x: float, y: float, heading: float, elevation: float) -> Placed:
        """The frame in which an aircraft, seen unmoved, is at a place [m] and heading [rad]."""
        east, north, _ = seen.position_in_world
        turn = from_yaw(np.asarray(heading - float(seen.yaw)))
        return cls(np.array([east, north, elevation]), np.array([x, y, 0.0]), turn)

    def seen(self, state: RigidBodyState) -> RigidBodyState:
        """A state of the local frame in `odom`."""
        return RigidBodyState(
            self.place + rotate(self.turn, state.position_in_world - self.origin),
            np.asarray(multiply(self.turn, state.quat_xyzw)),
            rotate(self.turn, state.velocity_in_world),
            state.angular_velocity_in_body,
        )


def shown_at(state: RigidBodyState, frame: LocalFrame, elevation: float) -> Position:
    """The POSI that shows a robot in X-Plane; gear as it is.

    Args:
        state: In the local frame.
        frame: Its origin.
        elevation: Of z = 0 above mean sea level [m].
    """
    east, north, up = (float(part) for part in state.position_in_world)
    roll, pitch, heading = (math.degrees(angle) for angle in sailed_angles(state.quat_xyzw))
    return Position(*frame.degrees(east, north), up + elevation, pitch, roll, heading)
