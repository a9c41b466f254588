"""Kobuki's packets, byte by byte, and whatever else a cable may bring."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hardware_drivers.kobuki_protocol import BASE_CONTROL, Decoder, base_control, packet
from sim_nodes.emulators.kobuki import KobukiEmulator


def report(time_ms=1000, bumpers=0, left=10, right=65535, battery=160, angle=-4500, rate=900) -> bytes:
    core = struct.pack("<BBHBBBHHbbBBBB", 1, 15, time_ms, bumpers, 0, 0, left, right, 0, 0, 0, 0, battery, 0)
    return packet(core + bytes([3, 3, 0, 0, 0]) + struct.pack("<BBhhxxx", 4, 7, angle, rate))


class Wire:
    """A link that keeps what it is given."""

    address = "wire"

    def __init__(self) -> None:
        self.coming, self.sent = b"", b""

    def read(self) -> bytes:
        coming, self.coming = self.coming, b""
        return coming

    def write(self, data: bytes) -> None:
        self.sent += data

    def close(self) -> None:
        pass


def test_driving_straight_is_the_packet_of_the_specification():
    """0.2 m/s: speed 200 mm/s, radius 0, and the exclusive or of all bytes after AA 55."""
    assert base_control(0.2, 0.0) == bytes([0xAA, 0x55, 6, BASE_CONTROL, 4, 200, 0, 0, 0, 6 ^ 1 ^ 4 ^ 200])


@pytest.mark.parametrize(
    ("speed", "turn", "words"),
    [
        (0.0, 1.0, (115, 1)),  # on the spot: the wheels run at half the track times the turn rate
        (0.3, 0.5, (358, 600)),  # an arc to the left of 0.6 m: the outer wheel is 115 mm further out
        (0.3, -0.5, (358, -600)),
        (-0.2, 0.0, (-200, 0)),
        (0.4, 1e-6, (400, 0)),
        (0.4, 0.001, (400, 0)),  # an arc of 400 m is a straight line to sixteen bits
    ],
)
def test_arcs_are_the_speed_of_the_outer_wheel_and_a_radius(speed, turn, words):
    sent = struct.unpack_from("<hh", base_control(speed, turn), 5)
    assert sent == pytest.approx(words, abs=1)


@given(st.floats(-0.45, 0.45), st.floats(-0.9, 0.9))
def test_the_base_understands_every_command_as_it_was_meant(speed, turn):
    """To the protocol's millimetres: within 1 mm/s, and within 0.02 rad/s."""
    wire = Wire()
    base = KobukiEmulator(wire, lambda: (0.0, 0.0))
    wire.coming = base_control(speed, turn)
    assert base.command(1.0) == pytest.approx([speed, turn], abs=0.02)


def test_a_report_is_read_in_whatever_pieces_it_comes():
    whole, decoder = report(), Decoder()
    packets = [found for byte in whole for found in decoder.feed(bytes([byte]))]
    assert len(packets) == 1
    core, inertia = packets[0].core, packets[0].inertia
    assert (core.time_ms, core.left, core.right, core.battery) == (1000, 10, 65535, 16.0)
    assert (inertia.angle, inertia.rate) == (-45.0, 9.0)
    assert decoder.lost == 0


@given(st.integers(3, 34), st.integers(1, 255))
def test_a_spoilt_byte_never_makes_another_report(place, change):
    """Any but those of the header and the length, which one exclusive or cannot vouch for."""
    spoilt = bytearray(report())
    spoilt[place] ^= change
    assert all(found.core is None or found.core.time_ms != 1000 for found in Decoder().feed(bytes(spoilt)))


@given(st.binary(max_size=300), st.binary(max_size=40))
def test_noise_is_survived_and_the_next_reports_are_found(noise, more):
    """A start of a packet in the noise may swallow what follows it, but not for longer than the longest packet."""
    decoder = Decoder()
    decoder.feed(noise + more)
    found = decoder.feed(report(time_ms=7) * 8)
    assert [packet.core.time_ms for packet in found if packet.core][-1:] == [7]


@given(st.binary(max_size=250))
def test_any_payload_with_a_right_checksum_is_survived(payload):
    for found in Decoder().feed(packet(payload)):
        assert found.core is None or 0 <= found.core.left < 65536


@given(st.binary(max_size=400))
def test_noise_does_not_drive_the_base(noise):
    """What is not a sound packet is no command: the emulated base has no other way to move."""
    wire = Wire()
    base = KobukiEmulator(wire, lambda: (0.0, 0.0))
    wire.coming = noise.replace(b"\xaa\x55", b"\xaa\x54")
    assert not np.any(base.command(1.0))


def test_a_base_without_commands_stands_after_its_own_timeout():
    wire = Wire()
    base = KobukiEmulator(wire, lambda: (0.0, 0.0))
    wire.coming = base_control(0.3, 0.0)
    assert base.command(10.0)[0] == pytest.approx(0.3)
    assert base.command(10.55)[0] == pytest.approx(0.3)
    assert not base.command(10.65).any()
