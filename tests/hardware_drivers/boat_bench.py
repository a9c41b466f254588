"""An emulated boat with ArduPilot on the bench, and its driver."""

from __future__ import annotations

import contextlib
import socket
import time
from collections.abc import Iterator

import numpy as np

from fulmar_core.simulation.backend import Sample
from hardware_drivers.driver_backend import DriverBackend, backend_of
from hardware_drivers.mavlink_driver import MavlinkDriver
from hardware_drivers.settings import MavlinkBoat, Thrust
from sim_nodes.emulators.ardupilot import ArdupilotEmulator
from tests.hardware_drivers.bench import Bench, episode_at

START = (3.0, -2.0, 0.7)
THRUST = Thrust(45.0, 25.0)


def free_udp_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextlib.contextmanager
def boat(key: bytes = b"") -> Iterator[Bench]:
    """A boat that is switched on; it signs where it has a key."""
    bench = Bench("kingfisher", lambda _: ArdupilotEmulator(free_udp_port(), key), start=START)
    try:
        yield bench
    finally:
        bench.stop()


@contextlib.contextmanager
def driven(bench: Bench, *, signing_key: str = "", patience_s: float = 5.0) -> Iterator[DriverBackend]:
    """A driver that has armed the boat."""
    settings = MavlinkBoat("mavlink_boat", bench.device.address, THRUST, arm=True, signing_key=signing_key)
    made = backend_of(bench.robot, MavlinkDriver(bench.robot, settings, patience_s=patience_s))
    try:
        made.reset(episode_at(bench.robot, *START), seed=0)
        yield made
    finally:
        made.close()


def drive(driver: DriverBackend, command: tuple[float, float], seconds: float) -> Sample:
    """Send a command fifty times a second."""
    end = time.monotonic() + seconds
    while True:
        sample = driver.step(np.array(command))
        time.sleep(0.02)
        if time.monotonic() >= end:
            return sample
