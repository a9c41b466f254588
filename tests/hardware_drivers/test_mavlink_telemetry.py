"""The decoder of MAVLink against whatever a radio may bring: bytes of any kind, and messages of any content."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from hardware_drivers.mavlink_telemetry import UNKNOWN_MV, Telemetry

MESSAGES = ("HEARTBEAT", "SYS_STATUS", "ATTITUDE", "RAW_IMU", "LOCAL_POSITION_NED")
NOW_NS = 10**18
INTEGERS = {"uint8_t": (0, 2**8 - 1), "uint16_t": (0, 2**16 - 1), "uint32_t": (0, 2**32 - 1)}
INTEGERS |= {"int8_t": (-(2**7), 2**7 - 1), "int16_t": (-(2**15), 2**15 - 1)}
INTEGERS |= {"uint64_t": (0, 2**64 - 1), "int32_t": (-(2**31), 2**31 - 1), "int64_t": (-(2**63), 2**63 - 1)}


def decoder() -> mavlink.MAVLink:
    """As the driver has one."""
    made = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    made.robust_parsing = True
    return made


@st.composite
def messages(draw: st.DrawFn) -> mavlink.MAVLink_message:
    """One that the driver listens to, with anything in its fields."""
    name = draw(st.sampled_from(MESSAGES))
    kind = next(made for made in mavlink.mavlink_map.values() if made.msgname == name)
    values = [
        draw(st.floats(width=32, allow_nan=True, allow_infinity=True))
        if of == "float"
        else draw(st.integers(*INTEGERS[of]) | st.just(0))
        for of in kind.fieldtypes
    ]
    return kind(*values)


def check(telemetry: Telemetry, message: mavlink.MAVLink_message) -> None:
    with np.errstate(all="ignore"):
        report = telemetry.take(message, NOW_NS)
    if report is None:
        return
    state = report.odometry
    for part in (
        state.position_in_world,
        state.quat_xyzw,
        state.velocity_in_world,
        state.angular_velocity_in_body,
    ):
        assert np.isfinite(part).all()
    assert report.imu is None or np.isfinite([*report.imu.specific_force, *report.imu.angular_velocity]).all()
    assert report.stamp_ns <= NOW_NS


@given(st.lists(messages(), max_size=12))
def test_whatever_stands_in_the_fields_no_report_holds_what_is_not_finite(said):
    telemetry = Telemetry()
    for message in said:
        check(telemetry, message)


@given(
    st.lists(
        st.binary(max_size=80) | st.tuples(messages(), st.integers(0, 60), st.integers(0, 255)), max_size=12
    )
)
def test_spoilt_bytes_are_survived_and_the_next_message_is_found(chunks):
    """Noise, and messages with a byte changed or cut off in the middle."""
    parser, sender, telemetry = decoder(), decoder(), Telemetry()
    for chunk in chunks:
        if not isinstance(chunk, bytes):
            message, place, change = chunk
            packet = bytearray(message.pack(sender))
            packet[place % len(packet)] ^= change
            chunk = bytes(packet[: len(packet) - place % 3])
        for found in parser.parse_buffer(chunk) or []:
            if found.get_type() != "BAD_DATA":
                check(telemetry, found)
    parser.parse_buffer(bytes(600))  # whatever was begun has its end
    status = sender.sys_status_encode(0, 0, 0, 100, 15800, -1, 80, 0, 0, 0, 0, 0, 0)
    for found in parser.parse_buffer(status.pack(sender)) or []:
        if found.get_type() == "SYS_STATUS":
            telemetry.take(found, NOW_NS)
    assert telemetry.voltage == "15.8"


@pytest.mark.parametrize("unknown", [UNKNOWN_MV, 0])
def test_a_voltage_that_is_not_measured_is_not_known(unknown):
    telemetry, sender = Telemetry(), decoder()
    telemetry.take(sender.sys_status_encode(0, 0, 0, 100, 15800, -1, 80, 0, 0, 0, 0, 0, 0), NOW_NS)
    telemetry.take(sender.sys_status_encode(0, 0, 0, 100, unknown, -1, 80, 0, 0, 0, 0, 0, 0), NOW_NS)
    assert telemetry.voltage == ""
