"""Poses of a simulated motion capture: at a rate of their own, late."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

from fulmar_core.robots.robot_file import load_robot
from fulmar_ros.motion_capture import MotionCapture, PacedCapture, SteppedCapture, capture_maker, moved_on
from tests.states import planar_state

MS = 1_000_000
STATE = planar_state(1.0, 2.0, 0.3)


def stamps(capture, until_ms, every_ms=20):
    return [stamp // MS for t in range(0, until_ms, every_ms) for stamp, _ in capture.see(STATE, t * MS)]


def test_without_a_rate_every_measurement_is_a_pose_at_once():
    assert stamps(MotionCapture(), 100) == [0, 20, 40, 60, 80]


def test_captures_keep_their_own_beat():
    assert stamps(MotionCapture(rate_hz=25.0), 200) == [0, 40, 80, 120, 160]


def test_poses_come_late_and_are_stamped_when_they_come():
    capture = MotionCapture(late_s=0.04)
    assert capture.see(STATE, 0) == []
    assert capture.see(STATE, 20 * MS) == []
    assert [stamp for stamp, _ in capture.see(STATE, 40 * MS)] == [40 * MS]


def test_a_pose_moves_on_at_constant_velocity_and_turn_rate():
    state = moved_on(planar_state(1.0, 2.0, 0.3, vx=0.5, vy=-0.2, yaw_rate=0.4), 0.015)
    assert state.position_in_world == pytest.approx([1.0075, 1.997, 0.0])
    assert float(state.yaw) == pytest.approx(0.306, abs=1e-6)
    assert np.linalg.norm(state.quat_xyzw) == pytest.approx(1.0)


def test_in_lock_step_captures_faster_than_the_ticks_come_with_them_and_in_order():
    """The plant's ticks are 20 ms apart: at 75 Hz the pose moves on from the tick before."""
    capture, poses = SteppedCapture(rate_hz=75.0), []
    for tick in range(4):
        x = 1.0 + 0.5 * 0.02 * tick
        poses += capture.see(planar_state(x, 0.0, 0.0, vx=0.5), 20 * MS * tick)
    assert [stamp for stamp, _ in poses] == [0, 13_333_333, 26_666_667, 40_000_000, 53_333_333]
    for stamp, pose in poses:
        assert pose.position_in_world[0] == pytest.approx(1.0 + 0.5e-9 * stamp, abs=1e-12)


def test_late_captures_in_lock_step_are_stamped_when_they_come():
    capture = SteppedCapture(rate_hz=100.0, late_s=0.02)
    found = [[stamp // MS for stamp, _ in capture.see(STATE, 20 * MS * tick)] for tick in range(3)]
    assert found == [[], [20], [30, 40]]


@pytest.mark.parametrize(
    ("rate_hz", "lockstep", "paced"),
    [(0.0, False, False), (50.0, False, False), (200.0, False, True), (200.0, True, False)],
)
def test_captures_faster_than_the_ticks_get_a_thread_of_their_own(rate_hz, lockstep, paced):
    robot = load_robot("floating_platform")  # ticks at 50 Hz
    make = capture_maker(robot, rate_hz=rate_hz, late_s=0.0, lockstep=lockstep)
    assert isinstance(make(lambda _stamp, _pose: None), PacedCapture) is paced


def test_paced_captures_come_between_measurements_and_stop_with_them():
    """One measurement, then silence: the pose moves on for one tick of the plant and no further."""
    poses, enough = [], threading.Event()

    def publish(stamp, pose):
        poses.append((stamp, float(pose.position_in_world[0])))
        if stamp >= 1_020 * MS:
            enough.set()

    capture = PacedCapture(publish, rate_hz=200.0, longest_s=0.02)
    assert capture.see(planar_state(0.0, 0.0, 0.0, vx=1.0), 1_000 * MS) == []
    assert enough.wait(5.0)
    time.sleep(0.03)
    capture.close()
    stamps, places = np.array(poses).T
    assert len(stamps) >= 2
    assert (np.diff(stamps) > 0).all()
    assert stamps[-1] == 1_020 * MS
    assert places == pytest.approx((stamps - 1_000 * MS) / 1e9)
    enough.clear()
    capture.see(planar_state(2.0, 0.0, 0.0), 1_040 * MS)  # a plant that goes on after a pause
    assert enough.wait(5.0)
    capture.close()
    assert poses[-1][1] == 2.0
