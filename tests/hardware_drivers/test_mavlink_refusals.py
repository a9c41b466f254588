"""What an ArduPilot boat answers: a mode that is denied or changed, arming, and overrides without effect."""

from __future__ import annotations

import time

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from fulmar_core.config.errors import DeviceError
from hardware_drivers.mavlink_autopilot import ARMED, BEATLESS_S, LAG_S, Autopilot
from tests.hardware_drivers.bench import until
from tests.hardware_drivers.boat_bench import boat, drive, driven

HOLD, GUIDED = 4, 15


def test_a_boat_that_denies_manual_is_not_started():
    with boat() as bench:
        bench.device.mode = GUIDED
        bench.device.denied = {mavlink.MAV_CMD_DO_SET_MODE: "Flight mode change failed"}
        words = (
            r"refuses mode MANUAL: denied; it is in mode 15 \(GUIDED\)\. It says 'Flight mode change failed'"
        )
        with pytest.raises(DeviceError, match=words), driven(bench):
            pass
        assert not bench.device.armed


def test_a_boat_that_refuses_to_arm_is_not_started_and_says_why():
    with boat() as bench:
        bench.device.denied = {mavlink.MAV_CMD_COMPONENT_ARM_DISARM: "PreArm: GPS 1: Bad fix"}
        with (
            pytest.raises(DeviceError, match=r"refuses arming: denied; .*'PreArm: GPS 1: Bad fix'"),
            driven(bench),
        ):
            pass


@pytest.mark.parametrize(
    ("what", "words"),
    [
        ("hold", "the autopilot is in mode 4 (HOLD), not MANUAL: overrides do nothing"),
        ("disarm", "the autopilot is not armed: its propellers stand"),
        ("deaf", "the autopilot does not take the overrides: "),
    ],
)
def test_a_boat_that_does_not_do_what_is_sent_is_a_refusal_in_words(what, words):
    with boat() as bench, driven(bench) as driver:
        assert drive(driver, (0.8, 0.8), 1.3).refusal == ""
        if what == "hold":
            bench.device.mode = HOLD
        elif what == "disarm":
            bench.device.armed = False
        else:
            bench.device.deaf = True
        until(lambda: drive(driver, (-0.5, 0.4), 0.02).refusal.startswith(words), timeout_s=5.0)
        assert driver.health()["warning"].startswith(words)


@pytest.fixture
def state():
    """An autopilot in MANUAL, armed, that has spoken at second 0."""
    made = Autopilot(1, 3)
    made.take(beat(), 0.0)
    return made


def beat(mode: int = 0, armed: bool = True, status: int = 4) -> mavlink.MAVLink_message:
    return mavlink.MAVLink_heartbeat_message(11, 3, ARMED if armed else 0, mode, status, 3)


def channels(steering: int, throttle: int) -> mavlink.MAVLink_message:
    return mavlink.MAVLink_rc_channels_message(0, 16, steering, 1500, throttle, *[0] * 15, 255)


@pytest.mark.parametrize(("autopilot", "kind"), [(12, 11), (3, 2), (3, 1), (0, 6)])
def test_an_autopilot_whose_modes_mean_something_else_is_a_refusal(state, autopilot, kind):
    """PX4, and ArduPilot's Copter, whose mode 0 is STABILIZE."""
    state.take(mavlink.MAVLink_heartbeat_message(kind, autopilot, ARMED, 0, 4, 3), 0.0)
    assert state.refusal(0.0).startswith(
        f"the autopilot is no ArduPilot Rover or boat (MAV_AUTOPILOT {autopilot}, MAV_TYPE {kind})"
    )


def test_a_copter_is_neither_set_to_manual_nor_armed(monkeypatch):
    monkeypatch.setattr(mavutil.mavlink, "MAV_TYPE_SURFACE_BOAT", mavlink.MAV_TYPE_QUADROTOR)
    with boat() as bench:
        received, take = [], bench.device._take
        bench.device._take = lambda message, now_s: (received.append(message), take(message, now_s))
        with pytest.raises(DeviceError, match="is no ArduPilot Rover or boat"), driven(bench):
            pass
        time.sleep(0.2)  # for what was sent last
        assert not bench.device.armed
    assert {message.get_type() for message in received} <= {"HEARTBEAT", "COMMAND_LONG"}
    commands = {message.command for message in received if message.get_type() == "COMMAND_LONG"}
    assert commands == {mavlink.MAV_CMD_SET_MESSAGE_INTERVAL}


def test_without_heartbeats_the_mode_is_not_known(state):
    assert state.refusal(BEATLESS_S) == ""
    assert "no heartbeat" in state.refusal(BEATLESS_S + 0.1)


def test_a_channel_that_follows_late_is_no_refusal(state):
    for k in range(200):
        now_s = 0.02 * k
        state.take(beat(), now_s)
        state.note_sent(1500 + k, 1500 - k, now_s)
        late = max(0, k - 40)
        state.take(channels(1500 + late, 1500 - late), now_s)
        assert state.refusal(now_s) == ""


def test_a_channel_that_does_not_follow_is_a_refusal_until_it_does(state):
    for k in range(200):
        state.note_sent(1500, 1900, 0.02 * k)
        state.take(channels(1500, 1500), 0.02 * k)
    state.take(beat(), 4.0)
    assert "SYSID_MYGCS" in state.refusal(4.0)
    state.take(channels(1500, 1895), 4.0)
    assert state.refusal(4.0) == ""


def test_without_overrides_channels_may_be_anything(state):
    for k in range(100):
        state.take(channels(1100, 1900), 0.1 * k)
        state.take(beat(), 0.1 * k)
    assert state.refusal(10.0) == ""
    assert LAG_S < 10.0


def test_words_are_kept_for_a_while_and_hold_nothing_that_a_terminal_carries_out(state):
    state.take(mavlink.MAVLink_statustext_message(2, b"PreArm: \x1b[31mfail"), 1.0)
    assert state.words(2.0) == "'PreArm: ?[31mfail'"
    assert state.words(2.0, worst=1) == ""
    assert state.words(60.0) == ""


def test_a_failsafe_and_an_unknown_mode_have_words(state):
    state.take(beat(mode=33, status=5), 1.0)
    assert state.failsafe
    assert state.refusal(1.0) == "the autopilot is in mode 33, not MANUAL: overrides do nothing"
