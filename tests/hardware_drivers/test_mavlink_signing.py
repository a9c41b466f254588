"""Keys and signatures of MAVLink 2, against pymavlink's own signing; and addresses of autopilots."""

from __future__ import annotations

import os

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from fulmar_core.config.errors import ConfigError
from hardware_drivers.mavlink_address import place_of
from hardware_drivers.mavlink_signing import (
    BEHIND,
    GOOD,
    KEY_BYTES,
    OLD,
    UNSIGNED,
    WRONG,
    Signatures,
    read_key,
)
from hardware_drivers.settings import MavlinkBoat, Thrust

KEY = bytes(range(KEY_BYTES))
NOW = 10**12


def packet(time_of: int, key: bytes = KEY, link: int = 0) -> bytes:
    speaker = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    if key:
        speaker.signing.secret_key, speaker.signing.sign_outgoing = key, True
        speaker.signing.timestamp, speaker.signing.link_id = time_of, link
    return bytes(speaker.heartbeat_encode(11, 3, 0, 0, 4).pack(speaker))


@pytest.fixture
def signatures():
    return Signatures(KEY, now=lambda: NOW)


def test_what_pymavlink_signs_is_good_once(signatures):
    assert signatures.problem(packet(NOW)) == GOOD
    assert signatures.problem(packet(NOW)) == OLD
    assert signatures.problem(packet(NOW + 1)) == GOOD


def test_without_a_signature_or_with_another_key_nothing_is_good(signatures):
    assert signatures.problem(packet(0, key=b"")) == UNSIGNED
    assert signatures.problem(packet(NOW, key=KEY[::-1])) == WRONG


def test_a_stream_may_not_begin_with_what_was_recorded_long_ago(signatures):
    assert signatures.problem(packet(NOW - BEHIND - 1)) == OLD
    assert signatures.problem(packet(NOW - BEHIND)) == GOOD


def test_a_forged_packet_from_the_future_shuts_nobody_out(signatures):
    assert signatures.problem(packet(NOW)) == GOOD
    assert signatures.problem(packet(NOW + 10**9, key=KEY[::-1])) == WRONG
    assert signatures.problem(packet(NOW + 1)) == GOOD


@given(st.binary(max_size=60), st.integers(0, 40), st.integers(1, 255))
def test_no_other_bytes_are_good(noise, place, change):
    sound = bytearray(packet(NOW))
    sound[place % len(sound)] ^= change
    for data in (noise, bytes(sound)):
        assert Signatures(KEY, now=lambda: NOW).problem(data) != GOOD


@pytest.mark.parametrize("content", [KEY, KEY.hex().encode(), KEY.hex().upper().encode() + b"\n"])
def test_a_key_is_32_bytes_or_64_digits(content, tmp_path):
    path = tmp_path / "key"
    path.write_bytes(content)
    path.chmod(0o600)
    assert read_key(str(path)) == KEY


@pytest.mark.parametrize(
    ("content", "mode", "words"),
    [
        (KEY, 0o640, "chmod 600"),
        (KEY, 0o604, "chmod 600"),
        (KEY[1:], 0o600, "31 bytes"),
        (b"z" * 64, 0o600, "64 bytes"),
        (b"", 0o600, "0 bytes"),
    ],
)
def test_a_key_that_others_may_read_or_that_is_none_is_refused(content, mode, words, tmp_path):
    path = tmp_path / "key"
    path.write_bytes(content)
    path.chmod(mode)
    with pytest.raises(ConfigError, match=words):
        read_key(str(path))


def test_what_is_no_file_of_a_key_is_refused(tmp_path):
    os.mkfifo(tmp_path / "fifo", 0o600)
    for path, words in (
        (tmp_path / "none", "No such file"),
        (tmp_path, "Is a directory"),
        (tmp_path / "fifo", "regular"),
    ):
        with pytest.raises(ConfigError, match=words):
            read_key(str(path))


@pytest.mark.parametrize(
    ("port", "kind", "is_open"),
    [
        ("udpin:0.0.0.0:14550", "udpin", True),
        ("udpin:127.0.0.1:14550", "udpin", False),
        ("udpin:localhost:14550", "udpin", False),
        ("udpout:10.0.0.2:14550", "udpout", False),
        ("tcp:10.0.0.2:5760", "tcp", False),
        ("tcp://10.0.0.2:5760", "tcp", False),
        ("/dev/ttyACM0,57600", "serial", False),
    ],
)
def test_an_address_is_read_as_pymavlink_names_it(port, kind, is_open):
    assert (place_of(port).kind, place_of(port).is_open) == (kind, is_open)


@pytest.mark.parametrize("port", ["udpin:14550", "udpin:host:0", "tcpin:a:1", "udpbcast:a:1", "tcp:a:99999"])
def test_an_address_that_is_none_is_refused_in_the_hardware_file(port):
    with pytest.raises(ValueError, match="udpin:host:port"):
        MavlinkBoat("mavlink_boat", port, Thrust(1.0, 1.0))


def test_a_relative_key_is_refused_in_the_hardware_file():
    with pytest.raises(ValueError, match="whole path"):
        MavlinkBoat("mavlink_boat", "/dev/ttyACM0", Thrust(1.0, 1.0), signing_key="key")
