"""Driver of a free flyer behind PX4: arming, actuators, the end of commands, and odometry that cannot be true."""

from __future__ import annotations

import time

import numpy as np
import pytest

from fulmar_core.config.errors import DeviceError
from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.controller import Inputs
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.command_end import CommandEnd
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goals_at
from hardware_drivers.px4_driver import controls_of
from tests.hardware_drivers.bench import until
from tests.hardware_drivers.px4_bench import BY_SILENCE, START, Px4Failsafe, drive, driven, flyer, opened

CLOSED = np.zeros(8)


def test_a_flyer_is_armed_in_offboard_mode_and_moves_by_its_thrusters():
    with flyer() as (bench, ends), driven(bench, ends) as driver:
        assert (bench.device.armed, bench.device.nav_state) == (True, 14)
        sample = drive(driver, 0.25 * opened(0, 3), 0.3)
        assert sample.refusal == ""
        assert bench.device.command(time.monotonic()) == pytest.approx(0.25 * opened(0, 3))
        assert bench.device.received["OffboardControlMode"].direct_actuator
        assert not bench.device.received["OffboardControlMode"].attitude


def test_the_air_bearing_is_a_persons_and_counts_as_on():
    with flyer() as (bench, ends), driven(bench, ends) as driver:
        assert driver.bearing_on
        assert "switch it by hand" in driver.set_bearing(False)


def test_odometry_and_imu_come_in_the_frames_of_ros_with_the_time_of_measurement():
    with flyer() as (bench, ends), driven(bench, ends) as driver:
        drive(driver, opened(0, 7), 0.6)
        sample, truth = driver.step(CLOSED), bench.sample.truth
        assert sample.odometry.position_in_world == pytest.approx(truth.position_in_world, abs=0.03)
        assert sample.odometry.velocity_in_world == pytest.approx(truth.velocity_in_world, abs=0.02)
        assert float(sample.odometry.yaw) == pytest.approx(float(truth.yaw), abs=0.02)
        assert sample.imu.specific_force == pytest.approx([0.0, 0.0, 9.80665], abs=1e-3)
        assert abs(time.time_ns() - sample.stamp_ns) < 0.1e9


def test_times_of_a_px4_whose_clock_is_another_one_are_mapped_to_ours():
    with flyer() as (bench, ends):
        bench.device.clock_us = -1_700_000_000_000_000  # since its start
        with driven(bench, ends) as driver:
            sample = drive(driver, CLOSED, 0.3)
            assert 0.0 <= time.time_ns() - sample.stamp_ns < 0.1e9


def test_without_arm_the_driver_measures_and_sends_nothing():
    with flyer() as (bench, ends), driven(bench, ends, arm=False) as driver:
        drive(driver, opened(0), 0.2)
        assert not ends.driver.sent
        assert driver.health()["warning"].startswith("not armed")
        assert not bench.device.armed
    assert not ends.driver.sent


def test_at_the_end_thrusters_are_closed_and_px4_is_disarmed():
    with flyer() as (bench, ends):
        with driven(bench, ends) as driver:
            drive(driver, opened(0), 0.1)
        assert not bench.device.armed
        assert bench.device.received["ActuatorMotors"].control[:8] == [0.0] * 8
        assert ends.driver.closed


def test_a_loss_of_the_stream_is_rehearsed_before_the_first_command():
    with flyer() as (bench, ends), driven(bench, ends, failsafe=BY_SILENCE):
        arms = [
            fields
            for kind, fields in ends.driver.sent
            if kind == "VehicleCommand" and fields["command"] == 400
        ]
        assert bench.device.armed
        assert len(arms) >= 2


def test_a_px4_that_stays_armed_without_the_stream_is_disarmed_and_refused_with_what_to_set():
    with flyer() as (bench, ends):
        bench.device.parameters.values["COM_OBL_RC_ACT"] = 0
        words = "still armed.*Set COM_OF_LOSS_T 0.4 and COM_OBL_RC_ACT 7"
        with pytest.raises(DeviceError, match=words), driven(bench, ends, failsafe=BY_SILENCE):
            pass
        assert not bench.device.armed


def test_a_px4_that_notices_the_loss_too_late_is_refused():
    with flyer() as (bench, ends):
        bench.device.parameters.values["COM_OF_LOSS_T"] = 5.0
        with pytest.raises(DeviceError, match="still armed"), driven(bench, ends, failsafe=BY_SILENCE):
            pass


def test_a_px4_that_refuses_offboard_mode_or_arming_is_not_started():
    for number, what in ((176, "mode OFFBOARD"), (400, "arming")):
        with flyer() as (bench, ends):
            bench.device.denied = {number}
            with pytest.raises(DeviceError, match=f"PX4 refuses {what}: denied"), driven(bench, ends):
                pass
            assert not bench.device.armed


def test_under_the_e_stop_thrusters_close_at_once_and_the_stream_goes_on():
    with flyer() as (bench, ends), driven(bench, ends) as driver:
        drive(driver, opened(0), 0.2)
        sample = drive(driver, opened(0), 0.05, CommandEnd.STOPPED)
        assert sample.applied == pytest.approx(CLOSED)
        assert not bench.device.command(time.monotonic()).any()
        drive(driver, CLOSED, 0.8, CommandEnd.STOPPED)
        assert (bench.device.armed, bench.device.nav_state) == (True, 14)


def test_in_silence_thrusters_close_at_once_the_stream_stops_and_px4_disarms():
    with flyer() as (bench, ends), driven(bench, ends) as driver:
        drive(driver, opened(0), 0.2)
        streamed = bench.device.counts["OffboardControlMode"]
        assert drive(driver, opened(0), 0.1, CommandEnd.SILENT).applied == pytest.approx(CLOSED)
        assert not bench.device.command(time.monotonic()).any()
        assert bench.device.counts["OffboardControlMode"] == streamed
        assert bench.device.armed
        sample = drive(driver, CLOSED, 0.6, CommandEnd.SILENT)
        assert not bench.device.armed
        assert sample.refusal == "PX4 is not armed: its thrusters are closed"


def test_a_short_silence_ends_without_a_failsafe():
    with flyer() as (bench, ends), driven(bench, ends) as driver:
        drive(driver, opened(0), 0.1)
        drive(driver, CLOSED, 0.2, CommandEnd.SILENT)
        assert drive(driver, opened(0), 0.2).refusal == ""
        assert bench.device.armed


def test_another_mode_disarming_and_a_silent_status_are_refusals_in_words():
    with flyer() as (bench, ends), driven(bench, ends) as driver:
        bench.device.nav_state = 2
        until(
            lambda: (
                drive(driver, CLOSED, 0.02).refusal
                == "PX4 is in mode 2 (POSCTL), not OFFBOARD: it takes no set points"
            )
        )
        assert driver.health()["warning"].startswith("PX4 is in mode 2")
        bench.device.armed = False
        until(lambda: drive(driver, CLOSED, 0.02).refusal.startswith("PX4 is not armed"))
        bench.device.lie = lambda kind, fields: {} if kind == "VehicleStatus" else fields
        assert driver.health()["autopilot_mode"]


def test_a_status_that_comes_no_more_makes_the_mode_unknown():
    with flyer() as (bench, ends), driven(bench, ends) as driver:
        bench.device._status_s, bench.device._said = 1e12, (14, True, False)
        until(lambda: "no status" in drive(driver, CLOSED, 0.05).refusal, timeout_s=5.0)


def test_a_px4_that_falls_silent_is_an_error_not_old_odometry():
    with flyer() as (bench, ends), driven(bench, ends) as driver:
        bench.device.mute = True
        with pytest.raises(DeviceError, match="no report for"):
            drive(driver, CLOSED, 1.0)


def test_odometry_that_stands_still_is_an_error():
    with flyer() as (bench, ends), driven(bench, ends) as driver:
        bench.device.frozen = True
        with pytest.raises(DeviceError, match="it stands still"):
            drive(driver, CLOSED, 1.0)


def test_a_place_that_jumps_and_a_pose_without_numbers_are_refused_and_counted():
    with flyer() as (bench, ends), driven(bench, ends) as driver:
        bench.device.lie = lambda kind, fields: (
            fields | {"position": [50.0, 0.0, 0.0]} if kind == "VehicleOdometry" else fields
        )
        until(lambda: drive(driver, CLOSED, 0.02) and int(driver.health()["refused_positions"]) > 0)
        bench.device.lie = lambda kind, fields: (
            fields | {"q": [float("nan")] * 4} if kind == "VehicleOdometry" else fields
        )
        with pytest.raises(DeviceError, match="not known yet"):
            drive(driver, CLOSED, 1.0)


def test_a_px4_that_is_not_there_is_an_error_that_names_the_agent():
    with flyer() as (bench, ends):
        bench.device.mute = True
        time.sleep(0.05)
        with pytest.raises(DeviceError, match="uXRCE-DDS agent"), driven(bench, ends):
            pass
        assert ends.driver.closed


def test_sixteen_thrusters_take_the_motors_and_four_servos():
    order = tuple(reversed(range(16)))
    with flyer("spacecraft_16", order) as (bench, ends), driven(bench, ends, order=order) as driver:
        command = opened(0, 15, count=16)
        drive(driver, command, 0.1)
        assert bench.device.command(time.monotonic()) == pytest.approx(command)
        assert bench.device.received["ActuatorServos"].control[:4] == [-1.0, -1.0, -1.0, 1.0]


def test_outputs_without_a_thruster_are_disarmed_and_a_command_without_numbers_closes_all():
    motors, servos = controls_of(np.array([0.5, np.nan, 1.0]), (0, 1, 2))
    assert motors[:3] == [0.0] * 3
    assert np.isnan(motors[3:]).all()
    assert np.isnan(servos).all()
    assert controls_of(np.array([0.5, -0.2, 3.0]), (2, 0, 1))[0][:3] == [1.0, 0.5, 0.0]


@pytest.mark.parametrize(
    ("action", "confirm", "more", "words"),
    [
        ("disarm", "mavlink", {}, "needs an address"),
        ("disarm", "silence", {"mavlink": "udpin:127.0.0.1:14540"}, "the others none"),
        ("disarm", "silence", {"loss_s": 30.0}, "from 0.2 to 2 s"),
    ],
)
def test_a_failsafe_that_cannot_be_confirmed_is_a_mistake_in_the_file(action, confirm, more, words):
    with pytest.raises(ValueError, match=words):
        Px4Failsafe(action, confirm, **more)


def test_an_lqr_brings_a_flyer_to_its_goal_through_px4():
    """The short twin of the whole run in tests/ros/test_px4.py."""
    robot = load_robot("modular_freeflyer")
    task = load_task("go_to_pose")
    law = load_classical(robot, task, control_hz=10.0, law="lqr")
    goal = goals_at(np.array([[START[0] + 0.15, START[1], START[2]]]))
    with flyer() as (bench, ends), driven(bench, ends) as driver:
        sample, sent, until_s = driver.step(CLOSED), CLOSED[None], time.monotonic() + 12.0

        def gap_m() -> float:
            return float(np.hypot(*(bench.sample.truth.position_in_world - goal.targets[0, 0])[:2]))

        while gap_m() > 0.03 and time.monotonic() < until_s:
            state = PlanarState.from_rigid(sample.odometry)[None].in_float64()
            inputs = Inputs(state, goal, np.zeros((1, 0)), sent, None, sample.stamp_ns, 0.1)
            sent = np.asarray(law.act(inputs))
            sample = drive(driver, sent[0], 0.1)
            assert sample.refusal == ""
        assert gap_m() <= 0.03
