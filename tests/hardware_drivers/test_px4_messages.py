"""Messages of PX4: frames against rotations worked out by hand, and the bytes of each message on the wire."""

from __future__ import annotations

import math
import struct
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hardware_drivers.px4_messages import attitude_fields, imu_of, odometry_of, rate_fields
from tests.hardware_drivers.px4_bench import DEFINITIONS, fields_of, message

FORMATS = {
    "bool": "?", "uint8": "B", "int8": "b", "uint16": "H", "int16": "h", "uint32": "I", "int32": "i",
    "uint64": "Q", "int64": "q", "float32": "f", "float64": "d",
}  # fmt: skip
KINDS = sorted(path.stem for path in DEFINITIONS.glob("*.msg"))


def odometry(**fields: Any) -> SimpleNamespace:
    usual = {"pose_frame": 1, "velocity_frame": 1, "q": [1.0, 0.0, 0.0, 0.0]}
    return message("VehicleOdometry", usual | fields)


def test_a_body_that_looks_north_in_ned_looks_along_y_in_ros():
    state, problem = odometry_of(
        odometry(position=[3.0, 1.0, -2.0], velocity=[0.5, 0.0, 0.1], angular_velocity=[1, 2, 3])
    )
    assert not problem
    assert state.position_in_world == pytest.approx([1.0, 3.0, 2.0])
    assert state.velocity_in_world == pytest.approx([0.0, 0.5, -0.1])
    assert float(state.yaw) == pytest.approx(math.pi / 2)
    assert state.angular_velocity_in_body == pytest.approx([1.0, -2.0, -3.0])


def test_any_attitude_turns_as_its_matrix():
    rng = np.random.default_rng(1)
    swap, flip = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]]), np.diag([1.0, -1, -1])
    for _ in range(20):
        turn = Rotation.random(random_state=rng)
        x, y, z, w = turn.as_quat()
        state, _ = odometry_of(odometry(q=[w, x, y, z]))
        wanted = swap @ turn.as_matrix() @ flip
        assert Rotation.from_quat(state.quat_xyzw).as_matrix() == pytest.approx(wanted, abs=1e-9)
        assert attitude_fields(state.quat_xyzw) == pytest.approx(
            np.array([w, x, y, z]) * (1 if w >= 0 else -1)
        )


def test_a_world_of_an_own_origin_is_turned_about_x_alone():
    state, _ = odometry_of(
        odometry(pose_frame=2, velocity_frame=2, position=[3.0, 1.0, -2.0], velocity=[1.0, 2.0, 3.0])
    )
    assert state.position_in_world == pytest.approx([3.0, -1.0, 2.0])
    assert state.velocity_in_world == pytest.approx([1.0, -2.0, -3.0])
    assert float(state.yaw) == pytest.approx(0.0)


def test_a_velocity_in_the_body_follows_the_attitude():
    east = [math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)]  # nose to the east
    state, _ = odometry_of(odometry(q=east, velocity_frame=3, velocity=[2.0, 1.0, 0.0]))
    assert state.velocity_in_world == pytest.approx([2.0, -1.0, 0.0])


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"pose_frame": 0}, "pose is in frame 0"),
        ({"velocity_frame": 0}, "velocity is in frame 0"),
        ({"position": [math.nan, 0.0, 0.0]}, "not known yet"),
        ({"velocity": [math.inf, 0.0, 0.0]}, "not known yet"),
        ({"q": [0.5, 0.0, 0.0, 0.0]}, "length 0.500"),
    ],
)
def test_odometry_of_no_frame_or_without_numbers_is_refused(fields, words):
    state, problem = odometry_of(odometry(**fields))
    assert state is None
    assert words in problem


def test_an_inertial_reading_turns_with_the_body_and_an_invalid_one_is_none():
    rest = message("SensorCombined", {"accelerometer_m_s2": [0.1, 0.2, -9.8], "gyro_rad": [0.1, 0.2, 0.3]})
    reading = imu_of(rest)
    assert reading.specific_force == pytest.approx([0.1, -0.2, 9.8])
    assert reading.angular_velocity == pytest.approx([0.1, -0.2, -0.3])
    rest.accelerometer_timestamp_relative = 2147483647
    assert imu_of(rest) is None


def test_turn_rates_to_the_left_are_to_the_left_of_px4s_frame():
    assert rate_fields(np.array([0.1, 0.2, 0.3])) == pytest.approx({"roll": 0.1, "pitch": -0.2, "yaw": -0.3})


def cdr(kind: str, made: Any) -> bytes:
    """Plain CDR, little endian, by hand: each number at a multiple of its size."""
    return numbers(kind, made)[0]


def numbers(kind: str, made: Any) -> tuple[bytes, bytes]:
    """The same, and for each byte whether it is one of a number: what lies between them is left as it was."""
    data = mask = b""
    for type_name, name in fields_of(kind):
        base, _, length = type_name.partition("[")
        for value in getattr(made, name) if length else [getattr(made, name)]:
            size = struct.calcsize(FORMATS[base])
            gap = -len(data) % size
            data += b"\0" * gap + struct.pack("<" + FORMATS[base], value)
            mask += b"\0" * gap + b"\1" * size
    return b"\0\1\0\0" + data, b"\1\1\1\1" + mask


@pytest.mark.parametrize("kind", KINDS)
def test_the_bytes_of_each_message_are_those_of_its_definition(kind):
    """Every field has another value, so that an exchanged pair shows."""
    import px4_msgs.msg
    from rclpy.serialization import serialize_message

    values: dict[str, Any] = {}
    for number, (type_name, name) in enumerate(fields_of(kind), start=1):
        base, _, length = type_name.partition("[")
        one = bool(number % 2) if base == "bool" else 0.5 + number if base.startswith("float") else number
        values[name] = [one + 1 * k for k in range(int(length[:-1]))] if length else one
    made = getattr(px4_msgs.msg, kind)(**values)
    packed, counts = numbers(kind, message(kind, values))
    sent = serialize_message(made)
    assert len(packed) <= len(sent) < len(packed) + 4
    assert bytes(byte for byte, of in zip(sent, counts, strict=False) if of) == bytes(
        byte for byte, of in zip(packed, counts, strict=True) if of
    )


GOLDEN = {
    "OffboardControlMode": (
        {"timestamp": 1_000_000, "direct_actuator": True},
        "0001000040420f000000000000000000000001",
    ),
    "VehicleRatesSetpoint": (
        {"timestamp": 1, "roll": 0.5, "pitch": -0.25, "yaw": 0.0, "thrust_body": [0.75, 0.0, 0.0]},
        "0001000001000000000000000000003f000080be000000000000403f000000000000000000",
    ),
}


@pytest.mark.parametrize("kind", GOLDEN)
def test_the_bytes_of_what_flies_a_craft_are_these(kind):
    fields, golden = GOLDEN[kind]
    assert cdr(kind, message(kind, fields)).hex() == golden


def test_the_fields_are_those_of_release_1_16():
    """Order and types decide the bytes; PX4 leaves no room for a name."""
    assert fields_of("ActuatorMotors") == [
        ("uint64", "timestamp"), ("uint64", "timestamp_sample"), ("uint16", "reversible_flags"),
        ("float32[12]", "control"),
    ]  # fmt: skip
    command = [name for _, name in fields_of("VehicleCommand")]
    assert command[1:8] == [f"param{k}" for k in range(1, 8)]
    assert command[8:] == [
        "command", "target_system", "target_component", "source_system", "source_component", "confirmation",
        "from_external",
    ]  # fmt: skip
    assert len(fields_of("VehicleStatus")) == 39
