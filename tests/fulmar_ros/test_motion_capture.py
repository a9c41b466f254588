"""Poses of a simulated motion capture: at a rate of their own, late."""

from __future__ import annotations

from fulmar_ros.motion_capture import MotionCapture
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
