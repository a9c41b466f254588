"""Whoever else sends to the port of a boat's autopilot is neither believed, nor answered, nor served."""

from __future__ import annotations

import socket
import time

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from fulmar_core.config.errors import DeviceError
from hardware_drivers.mavlink_signing import KEY_BYTES
from tests.hardware_drivers.bench import until
from tests.hardware_drivers.boat_bench import START, boat, drive, driven

KEY = bytes(range(KEY_BYTES))


@pytest.fixture
def key_file(tmp_path):
    path = tmp_path / "key"
    path.touch(mode=0o600)
    path.write_bytes(KEY)
    return str(path)


@pytest.fixture
def stranger():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
        port.settimeout(0.3)
        yield port


def address_of(bench) -> tuple[str, int]:
    _, host, number = bench.device.address.split(":")
    return host, int(number)


def spoofed(place: float) -> list[bytes]:
    """Messages like those of the autopilot itself, somewhere else."""
    speaker = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    now_ms = 10_000
    return [
        bytes(message.pack(speaker))
        for message in (
            speaker.heartbeat_encode(11, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, 0, 4, 4),
            speaker.attitude_encode(now_ms, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
            speaker.local_position_ned_encode(now_ms, place, place, 0.0, 0.0, 0.0, 0.0),
        )
    ]


def test_a_stranger_s_positions_are_not_believed_and_no_command_goes_to_it(stranger):
    with boat() as bench, driven(bench) as driver:
        for _ in range(30):
            for packet in spoofed(START[1] + 0.5):
                stranger.sendto(packet, address_of(bench))
            sample = drive(driver, (0.0, 0.0), 0.02)
        assert sample.odometry.position_in_world[:2] == pytest.approx(START[:2], abs=0.05)
        assert driver.health()["autopilot_mode"] == "0 (MANUAL)"  # the stranger says HOLD
        with pytest.raises(TimeoutError):
            stranger.recv(4096)


def test_twenty_thousand_datagrams_of_strangers_cost_a_write_nothing(stranger):
    """In processor time of the writing thread: other programs of this computer do not count."""
    with boat() as bench, driven(bench) as driver:
        took = []
        for number in range(20_000):
            stranger.sendto(b"\xfd", address_of(bench))
            if number % 100 == 0:
                began = time.thread_time()
                driver._driver.write(np.zeros(2))
                took.append(time.thread_time() - began)
        assert max(took) < 1e-3
        until(
            lambda: drive(driver, (0.5, 0.5), 0.02) and bench.command == pytest.approx([0.5, 0.5], abs=0.01)
        )


def test_datagrams_before_the_autopilot_speaks_do_not_keep_it_out(stranger):
    with boat() as bench:
        bench.device.mute = True
        for _ in range(200):
            stranger.sendto(b"x", address_of(bench))
        bench.device.mute = False
        with driven(bench) as driver:
            until(
                lambda: (
                    drive(driver, (0.4, 0.4), 0.02) and bench.command == pytest.approx([0.4, 0.4], abs=0.01)
                )
            )


def test_a_position_that_jumps_is_refused_and_one_that_stays_there_ends_the_reports():
    with boat() as bench, driven(bench) as driver:
        report = bench.device.report

        def elsewhere(sample, now_s):
            state = sample.odometry
            state.position_in_world[:] = state.position_in_world + np.array([40.0, 0.0, 0.0])
            report(sample, now_s)
            state.position_in_world[:] = state.position_in_world - np.array([40.0, 0.0, 0.0])

        bench.device.report = elsewhere
        with pytest.raises(DeviceError, match=r"refused, the last: its place jumped by"):
            drive(driver, (0.0, 0.0), 3.0)
        assert int(driver.health()["refused_positions"]) > 0
        assert "jumped" in driver.health()["warning"]


def test_an_autopilot_with_the_key_is_driven(key_file):
    with boat(KEY) as bench, driven(bench, signing_key=key_file) as driver:
        until(
            lambda: drive(driver, (0.5, 0.2), 0.02) and bench.command == pytest.approx([0.5, 0.2], abs=0.01)
        )
        assert driver.health()["refused_messages"] == "0"


@pytest.mark.parametrize(("key", "reason"), [(b"", "not signed"), (KEY[::-1], "signature is wrong")])
def test_an_autopilot_without_the_key_is_nobody(key, reason, key_file):
    with (
        boat(key) as bench,
        pytest.raises(DeviceError, match=f"no heartbeat for 1.5 s; .* refused, the last: .*{reason}"),
        driven(bench, signing_key=key_file, patience_s=1.5),
    ):
        pass
