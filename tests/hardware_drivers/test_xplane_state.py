"""What X-Plane says, in the frames of ROS: known attitudes, places, velocities and forces."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fulmar_core.robots.robot import Limits
from fulmar_core.states.rotation import rotate
from fulmar_core.states.state import RigidBodyState
from hardware_drivers.believable_motion import unbelievable
from hardware_drivers.earth_frame import LocalFrame
from hardware_drivers.xplane_messages import KEEP, Position, Values
from hardware_drivers.xplane_protocol import MalformedError
from hardware_drivers.xplane_state import ASKED, flight_of, shown_at

FRAME = LocalFrame(49.5, -3.0)
LIMITS = Limits(geofence=1e4, speed=56.0, yaw_rate=8.0)
EAST, NORTH, UP = np.eye(3)
HERE = Position(49.5, -3.0, 12.0, 0.0, 0.0, 0.0)


def answer(**given: float) -> Values:
    """Zeros but for what is given, by the last part of the reference's name."""
    names = [name.rpartition("/")[2] for name in ASKED]
    assert set(given) <= set(names)
    return Values(tuple((float(given.get(name, 0.0)),) for name in names))


HALF = math.sqrt(0.5)


@pytest.mark.parametrize(
    ("angles", "nose", "left"),
    [  # pitch, roll, heading [deg]
        ((0.0, 0.0, 0.0), NORTH, -EAST),
        ((0.0, 0.0, 90.0), EAST, NORTH),
        ((0.0, 0.0, 180.0), -NORTH, EAST),
        ((0.0, 0.0, 270.0), -EAST, -NORTH),
        ((45.0, 0.0, 0.0), HALF * (NORTH + UP), -EAST),
        ((-45.0, 0.0, 90.0), HALF * (EAST - UP), NORTH),
        ((0.0, 45.0, 0.0), NORTH, HALF * (UP - EAST)),  # the right wing is down, so the left one is up
        ((0.0, -90.0, 90.0), EAST, -UP),
        ((45.0, 90.0, 90.0), HALF * (EAST + UP), HALF * (UP - EAST)),
    ],
)
def test_angles_of_sailors_become_an_attitude_in_east_north_up(angles, nose, left):
    pitch, roll, heading = angles
    state = flight_of(replace(HERE, pitch=pitch, roll=roll, heading=heading), answer(), FRAME).state
    assert rotate(state.quat_xyzw, EAST) == pytest.approx(nose, abs=1e-12)
    assert rotate(state.quat_xyzw, NORTH) == pytest.approx(left, abs=1e-12)
    shown = shown_at(state, FRAME, 0.0)
    if angles != (45.0, 90.0, 90.0):
        assert (shown.pitch, shown.roll) == pytest.approx((pitch, roll), abs=1e-9)
        assert math.remainder(shown.heading - heading, 360.0) == pytest.approx(0.0, abs=1e-9)


@given(st.floats(-85.0, 85.0), st.floats(-179.0, 179.0), st.floats(0.0, 359.0))
def test_what_is_shown_is_what_was_said(pitch, roll, heading):
    said = Position(49.503, -2.99, 31.0, pitch, roll, heading)
    shown = shown_at(flight_of(said, answer(), FRAME).state, FRAME, 0.0)
    assert (shown.latitude, shown.longitude, shown.altitude) == pytest.approx(
        (49.503, -2.99, 31.0), abs=1e-11
    )
    assert (shown.pitch, shown.roll) == pytest.approx((pitch, roll), abs=1e-6)
    assert math.remainder(shown.heading - heading, 360.0) == pytest.approx(0.0, abs=1e-6)
    assert (shown.gear, shown.aircraft, shown.coarse) == (KEEP, 0, False)


def test_a_minute_of_latitude_is_a_nautical_mile_and_height_is_above_the_sea():
    state = flight_of(replace(HERE, latitude=49.5 + 1.0 / 60.0), answer(), FRAME).state
    assert state.position_in_world == pytest.approx((0.0, 1853.7, 12.0), abs=1.0)
    state = flight_of(replace(HERE, longitude=-3.0 - 1.0 / 60.0), answer(), FRAME).state
    assert state.position_in_world == pytest.approx(
        (-1853.7 * math.cos(math.radians(49.5)), 0.0, 12.0), abs=5.0
    )
    assert shown_at(state, FRAME, 100.0).altitude == pytest.approx(112.0)


def test_velocity_points_east_up_and_south_and_rates_turn_right_up_and_right():
    flight = flight_of(
        HERE, answer(local_vx=1.0, local_vy=2.0, local_vz=-30.0, P=10.0, Q=20.0, R=30.0), FRAME
    )
    assert flight.state.velocity_in_world == pytest.approx((1.0, 30.0, 2.0))
    turning = np.radians((10.0, -20.0, -30.0))  # about the axes ahead, left and up
    assert flight.state.angular_velocity_in_body == pytest.approx(turning)
    assert flight.imu.angular_velocity == pytest.approx(turning)


def test_specific_force_is_gravity_upwards_in_level_flight_and_none_in_free_fall():
    assert flight_of(HERE, answer(), FRAME).imu.specific_force == pytest.approx((0.0, 0.0, 9.80665))
    assert flight_of(HERE, answer(local_ay=-9.80665), FRAME).imu.specific_force == pytest.approx((0, 0, 0))
    right_down = flight_of(replace(HERE, roll=90.0), answer(), FRAME).imu.specific_force
    assert right_down == pytest.approx((0.0, 9.80665, 0.0), abs=1e-9)  # the left wing is up
    faster = flight_of(HERE, answer(local_az=-2.0), FRAME).imu.specific_force  # to the north, which is ahead
    assert faster == pytest.approx((2.0, 0.0, 9.80665))


def test_air_data_have_the_signs_of_the_core():
    flight = flight_of(
        HERE, answer(true_airspeed=28.0, alpha=2.0, beta=5.0, y_agl=1.5, total_flight_time_sec=7.25), FRAME
    )
    assert flight.air.names == ("airspeed", "alpha", "beta", "height")
    # The nose is right of the path, so the air comes from the left.
    assert flight.air.values == pytest.approx((28.0, math.radians(2.0), math.radians(-5.0), 1.5))
    assert flight.time_s == 7.25


@pytest.mark.parametrize(
    ("position", "values", "says"),
    [
        (replace(HERE, coarse=True), answer(), "places in float32, good to 0.5 m: install XPlaneConnect 1.3"),
        (HERE, Values(answer().values[1:]), f"RESP has {len(ASKED) - 1} values, {len(ASKED)} were asked for"),
        (
            HERE,
            Values(((), *answer().values[1:])),
            "RESP has no value of sim/flightmodel/position/local_vx",
        ),
    ],
)
def test_answers_that_cannot_be_flown_by_are_refused(position, values, says):
    with pytest.raises(MalformedError, match=says):
        flight_of(position, values, FRAME)


@pytest.mark.parametrize(
    ("change", "after_s", "says"),
    [
        ({}, 0.01, ""),
        ({"position_in_world": np.array([0.6, 0.0, 1.0])}, 0.01, ""),
        (
            {"position_in_world": np.array([5000.0, 0.0, 1.0])},
            0.01,
            "its place jumped by 5000.0 m within 10 ms",
        ),
        (
            {"position_in_world": np.array([0.0, 0.0, 200.0])},
            0.5,
            "its place jumped by 199.0 m within 500 ms",
        ),
        (
            {"velocity_in_world": np.array([0.0, 900.0, 0.0])},
            0.01,
            "its speed 900.00 m/s is beyond the possible",
        ),
        (
            {"angular_velocity_in_body": np.array([20.0, 0.0, 0.0])},
            0.01,
            "its turn rate 20.00 rad/s is beyond",
        ),
    ],
)
def test_jumps_and_motion_that_no_aircraft_has_are_not_believed(change, after_s, says):
    last = RigidBodyState(
        np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, 0.0, 1.0]), np.array([28.0, 0.0, 0.0]), np.zeros(3)
    )
    now_ns = 10_000_000_000
    later_ns = now_ns + round(after_s * 1e9)
    found = unbelievable(replace(last, **change), later_ns, (last, now_ns), LIMITS, turns_freely=True)
    assert found.startswith(says)
    assert bool(found) is bool(says)
