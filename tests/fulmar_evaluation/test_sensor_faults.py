"""What relays make of measurements: frozen, drifting and creeping ones."""

from __future__ import annotations

import math

import pytest
from geometry_msgs.msg import PoseStamped, QuaternionStamped
from nav_msgs.msg import Odometry

from fulmar_evaluation.faults.sensor_faults import (
    DRIFT_DEG,
    frozen,
    since_first,
    turned_by,
)


def at(kind, seconds):
    message = kind()
    message.header.stamp.sec = seconds
    return message


def test_a_frozen_sensor_repeats_its_first_value_under_new_stamps():
    change, sent = frozen(), []
    for second in (1, 2, 3):
        message = at(PoseStamped, second)
        message.pose.position.x = float(second)
        sent.append(change(message))
    assert [message.pose.position.x for message in sent] == [1.0, 1.0, 1.0]
    assert [message.header.stamp.sec for message in sent] == [1, 2, 3]


def test_a_drift_counts_from_the_first_message_that_it_met():
    seen = []
    change = since_first(lambda _message, passed_s: seen.append(passed_s))
    for second in (10, 11, 14):
        change(at(Odometry, second))
    assert seen == [0.0, 1.0, 4.0]


def test_a_star_tracker_drifts_by_an_angle_about_z_and_stays_of_length_one():
    message = at(QuaternionStamped, 0)
    q = message.quaternion
    q.x, q.y, q.z, q.w = 0.5, -0.5, 0.5, 0.5
    turned_by(message, math.radians(DRIFT_DEG) * 20.0)
    assert math.hypot(q.x, q.y, q.z, q.w) == pytest.approx(1.0)
    cosine = abs(0.5 * q.x - 0.5 * q.y + 0.5 * q.z + 0.5 * q.w)
    assert math.degrees(2.0 * math.acos(cosine)) == pytest.approx(1.0, rel=1e-6)
