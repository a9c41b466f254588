"""The small parts of the drivers: clocks, wheels, places, attitudes, valves, messages of nine."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fulmar_core.config.errors import DeviceError
from fulmar_core.states.rotation import rotate, yaw_of
from hardware_drivers.earth_frame import LocalFrame, attitude
from hardware_drivers.feedback import DeviceTime, Feedback, Report
from hardware_drivers.valves import ValveTiming, from_message, to_message
from hardware_drivers.wheel_odometry import WheelOdometry
from sim_nodes.emulators import kingfisher

ORDER = (5, 1, 3, 7, 0, 4, 6, 2)
MS = 1_000_000


def test_a_stamp_is_the_capture_time_however_late_the_bytes_come():
    """A report every 20 ms; the wire needs 1 ms at least, and now and then much more."""
    device, host_ns = DeviceTime(wrap_ms=65536), 10**18
    late_ms = [1, 9, 3, 30, 1, 200, 2]
    stamps = [device.stamp_ns(20 * i, host_ns + (20 * i + late) * MS) for i, late in enumerate(late_ms)]
    assert np.array(stamps) - host_ns == pytest.approx([(20 * i + 1) * MS for i in range(7)], abs=256)


def test_a_clock_that_wraps_goes_on():
    device = DeviceTime(wrap_ms=65536)
    first = device.stamp_ns(65530, 10**18)
    assert device.stamp_ns(14, 10**18 + 20 * MS) - first == pytest.approx(20 * MS, abs=256)


def test_a_device_that_was_switched_off_and_on_is_believed_anew():
    device = DeviceTime()
    device.stamp_ns(500_000.0, 10**18)
    assert device.stamp_ns(10.0, 10**18 + 5 * 10**9) == 10**18 + 5 * 10**9


def test_no_stamp_lies_ahead_of_its_arrival():
    device = DeviceTime()
    for at in (0, 20, 40, 61, 80):
        assert device.stamp_ns(float(at), 10**18 + at * MS) <= 10**18 + at * MS


def test_a_device_that_has_failed_is_an_error_at_once_though_its_last_report_is_young():
    feedback = Feedback("base", 60.0)
    feedback.put(Report(None, None, 1))
    assert feedback.read().stamp_ns == 1
    feedback.fail("the other side closed the connection")
    with pytest.raises(DeviceError, match="base: the other side closed the connection"):
        feedback.read()


@pytest.mark.parametrize("data", [[2, *[0] * 8], [*[0] * 8, 255], [0] * 8, [0] * 10, [-1, *[0] * 8]])
def test_a_message_of_other_values_than_open_and_shut_is_refused(data):
    assert from_message(data, ORDER) is None


def test_a_square_of_straight_lines_and_turns_ends_where_it_began():
    odometry = WheelOdometry(0.001)
    odometry.begin(1.0, -2.0, math.pi / 2)
    left = right = 65000  # so that the counters wrap on the way
    heading, time_s = 3.0, 0.0
    state = odometry.see(left, right, heading, 0.0, time_s)
    for _ in range(4):
        for _ in range(10):
            left, right, time_s = (left + 100) % 65536, (right + 100) % 65536, time_s + 0.1
            state = odometry.see(left, right, heading, 0.0, time_s)
        assert float(np.linalg.norm(state.velocity_in_world)) == pytest.approx(1.0)
        for _ in range(9):
            heading, time_s = heading + math.radians(10.0), time_s + 0.1
            state = odometry.see(left, right, heading, 0.0, time_s)
    assert state.position_in_world[:2] == pytest.approx([1.0, -2.0], abs=1e-9)
    assert math.remainder(float(state.yaw) - math.pi / 2, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)


def test_the_first_report_moves_nothing():
    odometry = WheelOdometry(0.001)
    odometry.begin(0.0, 0.0, 0.0)
    state = odometry.see(12345, 54321, 1.0, 0.0, 100.0)
    assert not state.position_in_world.any()
    assert not state.velocity_in_world.any()


@pytest.mark.parametrize(("east", "north"), [(0.0, 0.0), (120.0, -40.0), (-900.0, 700.0)])
def test_metres_of_the_tangent_plane_agree_with_another_formula(east, north):
    """The emulator's own, by the radii of curvature; to a centimetre within a kilometre."""
    frame = LocalFrame(kingfisher.LATITUDE, kingfisher.LONGITUDE)
    assert frame.metres(*kingfisher._place(east, north)) == pytest.approx((east, north), abs=0.01)


def test_a_degree_of_latitude_is_as_long_as_geodesy_says():
    """111.132 km at 45° (WGS 84)."""
    assert LocalFrame(44.5, 0.0).metres(45.5, 0.0)[1] == pytest.approx(111_132, abs=10)


@pytest.mark.parametrize(("heading", "yaw"), [(0.0, 90.0), (90.0, 0.0), (180.0, -90.0), (234.3, 215.7)])
def test_a_heading_from_north_is_a_yaw_from_east(heading, yaw):
    quat = attitude(0.0, 0.0, math.radians(heading))
    assert math.remainder(math.degrees(float(yaw_of(quat))) - yaw, 360.0) == pytest.approx(0.0, abs=1e-9)


def test_bow_up_and_starboard_down_are_what_sailors_mean():
    bow = rotate(attitude(0.0, math.radians(5.0), 1.0), np.array([1.0, 0.0, 0.0]))
    port = rotate(attitude(math.radians(5.0), 0.0, 1.0), np.array([0.0, 1.0, 0.0]))
    assert bow[2] > 0.08
    assert port[2] > 0.08


def test_a_valve_stays_open_for_its_minimum_and_no_longer():
    timing = ValveTiming(2, 0.05)
    both, first, none = np.ones(2), np.array([1.0, 0.0]), np.zeros(2)
    assert timing.allowed(both, 0).tolist() == [1.0, 1.0]
    assert timing.allowed(first, 20 * MS).tolist() == [1.0, 1.0]
    assert timing.allowed(first, 60 * MS).tolist() == [1.0, 0.0]
    assert timing.allowed(none, 61 * MS).tolist() == [0.0, 0.0]


def test_when_all_must_close_no_minimum_holds_a_valve_open():
    timing = ValveTiming(2, 0.2)
    timing.allowed(np.ones(2), 0)
    assert not timing.allowed(np.zeros(2), 1).any()


def test_the_nine_values_are_those_of_the_lab_s_own_code():
    """Entry i after the bearing is the policy's action number ORDER[i]."""
    valves = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    assert to_message(valves, bearing=True, order=ORDER) == [1, 1, 0, 0, 0, 1, 0, 0, 0]


@given(st.lists(st.booleans(), min_size=8, max_size=8), st.booleans())
def test_the_nine_values_go_both_ways(valves, bearing):
    sent = to_message(np.array(valves, dtype=float), bearing=bearing, order=ORDER)
    back = from_message(sent, ORDER)
    assert back is not None
    assert back[0] is bearing
    assert back[1].astype(bool).tolist() == valves


@given(st.lists(st.integers(-32768, 32767), max_size=12))
def test_other_values_are_refused(data):
    sound = len(data) == 9 and set(data) <= {0, 1}
    assert (from_message(data, ORDER) is not None) == sound
