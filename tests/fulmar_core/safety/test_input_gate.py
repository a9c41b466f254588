"""Only believable, fresh measurements pass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.robots.robot import Limits
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.repetition import FROZEN_AFTER
from fulmar_core.safety.input_gate import CONTRADICTION, FROZEN, InputGate, Measurement
from fulmar_core.states.state import RigidBodyState
from tests.states import planar_state

LIMITS = Limits(geofence=8.0, speed=2.0, yaw_rate=6.0)


def measurement(stamp_ns=1, x=0.0, **changes):
    return replace(Measurement(stamp_ns, "odom", "base_link", planar_state(x, 0.0, 0.0)), **changes)


def state(**changes) -> RigidBodyState:
    return replace(planar_state(0.0, 0.0, 0.0), **changes)


def test_a_plain_measurement_passes():
    gate = InputGate(LIMITS)
    assert [gate.problem(measurement(i, x=0.1 * i)) for i in range(1, 30)] == [None] * 29


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        ({"frame": "map"}, "odom is 'map' → 'base_link', must be 'odom' → 'base_link'"),
        ({"child_frame": "imu_link"}, "odom is 'odom' → 'imu_link'"),
        ({"state": state(position_in_world=np.array([0.0, np.nan, 0.0]))}, "not finite"),
        ({"state": state(quat_xyzw=np.array([0.0, 0.0, np.inf, 1.0]))}, "not finite"),
        ({"state": state(velocity_in_world=np.array([np.nan, 0.0, 0.0]))}, "not finite"),
        ({"state": state(angular_velocity_in_body=np.array([0.0, 0.0, np.nan]))}, "not finite"),
        ({"state": state(quat_xyzw=np.zeros(4))}, "quaternion has norm 0.000, must be 1"),
        ({"state": state(quat_xyzw=np.array([0.0, 0.0, 0.0, 1.02]))}, "quaternion has norm 1.020"),
        (
            {"state": planar_state(0.0, 0.0, 0.0, vx=1.5, vy=1.5)},
            "speed 2.12 m/s is beyond the possible 2 m/s",
        ),
        (
            {"state": planar_state(0.0, 0.0, 0.0, yaw_rate=-6.1)},
            "yaw rate 6.10 rad/s is beyond the possible 6 rad/s",
        ),
    ],
)
def test_an_unbelievable_measurement_is_refused_with_its_reason(wrong, reason):
    assert reason in (InputGate(LIMITS).problem(measurement(**wrong)) or "")


def test_values_at_the_limits_pass():
    at_limits = planar_state(0.0, 0.0, 0.0, vx=2.0, yaw_rate=6.0)
    assert InputGate(LIMITS).problem(measurement(state=at_limits)) is None


@pytest.mark.parametrize(
    ("stamp", "reason"), [(5_000_000, "went back by 5 ms"), (10_000_000, "did not advance")]
)
def test_stamps_have_to_advance(stamp, reason):
    gate = InputGate(LIMITS)
    gate.problem(measurement(10_000_000))
    assert reason in (gate.problem(measurement(stamp, x=1.0)) or "")


def test_a_refused_measurement_does_not_become_the_last_one():
    gate = InputGate(LIMITS)
    gate.problem(measurement(10))
    gate.problem(measurement(99, frame="map"))
    assert gate.problem(measurement(11, x=1.0)) is None


def test_a_sensor_that_repeats_itself_is_stuck_until_it_changes():
    gate = InputGate(LIMITS)
    reasons = [gate.problem(measurement(i)) for i in range(1, FROZEN_AFTER + 3)]
    assert reasons[:FROZEN_AFTER] == [None] * FROZEN_AFTER
    assert reasons[FROZEN_AFTER] == f"odom has not changed for {FROZEN_AFTER} messages: the sensor is stuck"
    assert reasons[-1] is not None
    assert gate.problem(measurement(100, x=0.001)) is None


def test_where_the_sensor_is_noiseless_repetition_is_no_fault():
    gate = InputGate(LIMITS, frozen_after=0)
    assert not any(gate.problem(measurement(i)) for i in range(1, 50))


def test_after_forgetting_time_may_start_anew():
    gate = InputGate(LIMITS)
    gate.problem(measurement(10**9))
    gate.forget()
    assert gate.problem(measurement(1, x=1.0)) is None


SECOND = 1_000_000_000


@pytest.mark.parametrize(("jump_s", "words"), [(-1.1, "jumped by -1.1 s"), (10.1, "jumped by +10.1 s")])
def test_a_jump_of_time_is_reported_once_and_begins_a_new_epoch(jump_s, words):
    gate = InputGate(LIMITS)
    assert gate.problem(measurement(100 * SECOND)) is None
    there = 100 * SECOND + round(jump_s * SECOND)
    assert f"odom time {words}: a new epoch begins" in (gate.problem(measurement(there, x=0.1)) or "")
    assert gate.problem(measurement(there + 1, x=0.2)) is None
    assert gate.epoch == 1


@pytest.mark.parametrize("back_s", [1.0, 0.2])
def test_reordering_begins_no_epoch_however_often_it_comes(back_s):
    gate = InputGate(LIMITS)
    gate.problem(measurement(100 * SECOND))
    reasons = [gate.problem(measurement(round((100 - back_s) * SECOND), x=0.1)) for _ in range(3)]
    assert reasons == [f"odom stamp went back by {1e3 * back_s:.0f} ms"] * 3
    assert gate.epoch == 0


def test_a_gap_is_no_jump():
    gate = InputGate(LIMITS)
    gate.problem(measurement(100 * SECOND))
    assert gate.problem(measurement(110 * SECOND, x=0.1)) is None
    assert gate.epoch == 0


def test_one_stamp_far_in_the_future_does_not_shut_the_gate_for_ever():
    gate = InputGate(LIMITS)
    stamps = [1, 2, 3600, 3, 4, 5]
    reasons = [gate.problem(measurement(stamp * SECOND, x=0.1 * i)) for i, stamp in enumerate(stamps)]
    assert [reason is None for reason in reasons] == [True, True, False, False, True, True]
    assert gate.epoch == 2


def test_repetition_counts_anew_in_a_new_epoch():
    gate = InputGate(LIMITS, frozen_after=2)
    reasons = [gate.problem(measurement(stamp * SECOND)) or "" for stamp in (100, 101, 102, 1, 2)]
    assert "stuck" in reasons[2]
    assert "epoch" in reasons[3]
    assert reasons[4] == ""


def test_a_jump_of_place_is_reported_once_and_begins_a_new_epoch():
    gate = InputGate(LIMITS, jump_m=1.0)
    assert gate.problem(measurement(100 * SECOND)) is None
    first = gate.problem(measurement(100 * SECOND + 20_000_000, x=500.0)) or ""
    assert "odom place jumped by 500.0 m within 20 ms: a new epoch begins" in first
    assert gate.problem(measurement(100 * SECOND + 40_000_000, x=500.01)) is None
    assert gate.epoch == 1


def test_what_speed_and_a_correction_explain_is_no_jump():
    gate = InputGate(LIMITS, jump_m=1.0)
    gate.problem(measurement(100 * SECOND))
    assert gate.problem(measurement(103 * SECOND, x=6.9)) is None  # 3 s at 2 m/s, and 0.9 m


def test_where_episodes_begin_anywhere_no_place_is_too_far():
    gate = InputGate(LIMITS)
    gate.problem(measurement(1))
    assert gate.problem(measurement(2, x=500.0)) is None


def test_an_unbelievable_measurement_begins_no_epoch():
    gate = InputGate(LIMITS)
    gate.problem(measurement(1))
    assert "map" in (gate.problem(measurement(3600 * SECOND, frame="map")) or "")
    assert gate.epoch == 0


@pytest.mark.parametrize("rate", [(7.0, 0.0, 0.0), (0.0, -6.1, 0.0), (4.0, 4.0, 4.0)])
def test_what_turns_freely_must_not_tumble_faster_about_any_axis(rate):
    tumbling = measurement(state=state(angular_velocity_in_body=np.array(rate)))
    reason = InputGate(LIMITS, turns_freely=True).problem(tumbling)
    assert reason == f"odom turn rate {np.linalg.norm(rate):.2f} rad/s is beyond the possible 6 rad/s"
    slower = measurement(state=state(angular_velocity_in_body=np.array(rate) * 6.0 / 7.0))
    assert InputGate(LIMITS, turns_freely=True).problem(slower) is None


ODOMETRY = load_robot("turtlebot2").sensors.odometry
TICK_NS = 20_000_000


class Drive:
    """A base that drives circles or stands, and its odometry, which a gate is given."""

    def __init__(self, *, v: float = 0.3, yaw_rate: float = 0.2) -> None:
        self.gate = InputGate(LIMITS, odometry=ODOMETRY)
        self.rng = np.random.default_rng(3)
        self.v, self.yaw_rate = v, yaw_rate
        self.x = self.y = self.yaw = 0.0
        self.ticks = 0

    def run(
        self, seconds: float, *, change=lambda _t, pose, twist: (pose, twist)
    ) -> tuple[float | None, str]:
        """Drive with odometry that is changed; returns when the gate refused first [s], and its last words."""
        first, reason = None, ""
        for tick in range(round(seconds / 0.02)):
            self.ticks += 1
            self.yaw += 0.02 * self.yaw_rate
            vx, vy = self.v * np.cos(self.yaw), self.v * np.sin(self.yaw)
            self.x, self.y = self.x + 0.02 * vx, self.y + 0.02 * vy
            noise = self.rng.standard_normal(6) * (0.002, 0.002, 0.003, 0.01, 0.01, 0.01)
            pose = np.array([self.x, self.y, self.yaw]) + noise[:3]
            pose, twist = change(0.02 * tick, pose, np.array([vx, vy, self.yaw_rate]) + noise[3:])
            state = planar_state(*pose, vx=twist[0], vy=twist[1], yaw_rate=twist[2])
            problem = self.gate.problem(measurement(self.ticks * TICK_NS, state=state))
            reason = problem or ""
            if first is None and reason:
                first = 0.02 * tick
        return first, reason

    def standing_pose(self):
        at = np.array([self.x, self.y, self.yaw])
        return lambda _t, pose, twist: (at + 0.002 * self.rng.standard_normal(3), twist)


@pytest.mark.parametrize(("v", "yaw_rate"), [(0.3, 0.2), (0.0, 0.0), (0.0, 1.0), (0.8, 0.0)])
def test_odometry_whose_pose_moves_as_its_twist_says_passes(v, yaw_rate):
    assert Drive(v=v, yaw_rate=yaw_rate).run(20.0) == (None, "")


@pytest.mark.parametrize(("v", "yaw_rate"), [(0.3, 0.0), (0.0, 0.5)])
def test_a_pose_that_stands_with_noise_while_the_twist_says_motion_is_refused(v, yaw_rate):
    drive = Drive(v=v, yaw_rate=yaw_rate)
    drive.run(6.0)
    first, reason = drive.run(5.0, change=drive.standing_pose())
    assert first < 1.0
    assert (reason, drive.gate.warning) == (CONTRADICTION, CONTRADICTION)


def test_a_twist_that_stands_while_the_pose_moves_is_refused():
    drive = Drive()
    drive.run(6.0)
    first, reason = drive.run(5.0, change=lambda _t, pose, twist: (pose, 0.001 * twist))
    assert first < 1.0
    assert reason == CONTRADICTION


def test_a_position_that_creeps_away_is_refused():
    drive = Drive(v=0.0, yaw_rate=0.0)
    drive.run(6.0)
    first, _ = drive.run(6.0, change=lambda t, pose, twist: (pose + np.array([0.1 * t, 0.0, 0.0]), twist))
    assert first < 3.0


def test_one_correction_of_a_fix_is_no_contradiction():
    drive = Drive()
    drive.run(6.0)
    corrected = np.array([0.5, 0.3, 0.1])
    assert drive.run(8.0, change=lambda _t, pose, twist: (pose + corrected, twist)) == (None, "")


def test_a_position_that_goes_on_in_steps_is_no_row_of_corrections():
    drive = Drive(v=0.0, yaw_rate=0.0)
    drive.run(6.0)
    step = np.array([0.5, 0.0, 0.0])
    first, reason = drive.run(12.0, change=lambda t, pose, twist: (pose + t // 2 * step, twist))
    assert 6.0 < first < 9.0
    assert reason == CONTRADICTION


def test_after_a_contradiction_odometry_passes_once_pose_and_twist_agree_on_a_motion():
    drive = Drive()
    drive.run(6.0)
    drive.run(1.5, change=drive.standing_pose())
    rate, speed = drive.yaw_rate, drive.v
    drive.yaw_rate = drive.v = 0.0
    assert drive.run(10.0)[1] == CONTRADICTION  # both stand: that proves nothing
    drive.yaw_rate, drive.v = rate, speed
    assert drive.run(12.0)[1] == ""
    assert drive.run(1.0) == (None, "")
    assert drive.gate.warning == ""


def test_a_source_that_is_stuck_is_named_in_words_that_stay_the_same():
    gate = InputGate(LIMITS)
    for i in range(1, FROZEN_AFTER + 4):
        gate.problem(measurement(i))
    assert gate.warning == FROZEN
    gate.problem(measurement(100, x=0.001))
    assert gate.warning == ""
