"""A Kobuki base at the end of a serial cable, the device's side of its protocol."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from functools import reduce
from operator import xor

import numpy as np

from fulmar_core.simulation.backend import Sample
from sim_nodes.emulators.device import Link

TIMEOUT_S = 0.6  # without base control for so long it stands (kobuki_node, cmd_vel_timeout_sec)
REPORT_S = 0.02
TRACK_MM = 230.0
COUNTS_PER_RAD = 1.0 / 0.002436916871363930
BATTERY = 160  # tenths of a volt
GYRO_NOISE = 0.05  # [deg/s], our value: a MEMS gyroscope at 50 Hz

Wheels = Callable[[], tuple[float, float]]


class KobukiEmulator:
    """Drives by base control alone; reports core sensors and gyroscope fifty times a second.

    Attributes:
        bumpers, cliffs, wheel_drops, overcurrent: Bits that the next reports carry.
        mute: Report nothing, as a base whose cable is cut.
    """

    def __init__(self, link: Link, wheels: Wheels, *, seed: int = 0) -> None:
        """Switch it on.

        Args:
            link: The cable.
            wheels: Angles of the left and the right wheel, any number of turns [rad].
            seed: Of the gyroscope's noise.
        """
        self._link, self._wheels, self.address = link, wheels, link.address
        self._pending = bytearray()
        self._command, self._commanded_s = np.zeros(2), -math.inf
        self._reported_s = -math.inf
        self._began_s: float | None = None
        self._angle = 0.0  # that the gyroscope sums up [deg]
        self._rng = np.random.default_rng(seed)
        self.bumpers = self.cliffs = self.wheel_drops = self.overcurrent = 0
        self.mute = False

    def command(self, now_s: float) -> np.ndarray:
        """See `EmulatedDevice`."""
        self._pending += self._link.read()
        for payload in self._payloads():
            at = 0
            while at + 2 <= len(payload):
                kind, length = payload[at], payload[at + 1]
                if kind == 1 and length == 4:
                    self._command = _motion(*struct.unpack_from("<hh", payload, at + 2))
                    self._commanded_s = now_s
                at += 2 + length
        return self._command if now_s - self._commanded_s <= TIMEOUT_S else np.zeros(2)

    def report(self, sample: Sample, now_s: float) -> None:
        """See `EmulatedDevice`."""
        assert sample.truth is not None
        if self._began_s is None:
            self._began_s = now_s
        passed_s = min(REPORT_S, max(0.0, now_s - self._reported_s))
        if now_s - self._reported_s < 0.9 * REPORT_S:
            return
        self._reported_s = now_s
        rate = math.degrees(float(sample.truth.angular_velocity_in_body[2]))
        true_angle = math.degrees(float(sample.truth.yaw))
        rate += GYRO_NOISE * float(self._rng.standard_normal())
        self._angle += GYRO_NOISE * passed_s * float(self._rng.standard_normal())  # what it drifts by
        angle = (true_angle + self._angle + 180.0) % 360.0 - 180.0
        left, right = (round(wheel * COUNTS_PER_RAD) % 65536 for wheel in self._wheels())
        core = struct.pack(
            "<BBHBBBHHbbBBBB", 1, 15, round(1e3 * (now_s - self._began_s)) % 65536,
            self.bumpers, self.wheel_drops, self.cliffs, left, right, 0, 0, 0, 0, BATTERY, self.overcurrent,
        )  # fmt: skip
        inertia = struct.pack("<BBhhxxx", 4, 7, round(100.0 * angle), round(100.0 * rate))
        dock = bytes([3, 3, 0, 0, 0])
        payload = core + dock + inertia
        body = bytes([len(payload)]) + payload
        if not self.mute:
            self._link.write(b"\xaa\x55" + body + bytes([reduce(xor, body)]))

    def close(self) -> None:
        """See `EmulatedDevice`."""
        self._link.close()

    def _payloads(self) -> list[bytes]:
        found: list[bytes] = []
        pending = self._pending
        while True:
            start = pending.find(b"\xaa\x55")
            if start < 0:
                del pending[:-1]
                return found
            del pending[:start]
            if len(pending) < 3 or len(pending) < pending[2] + 4:
                return found
            body, total = pending[2 : pending[2] + 3], pending[pending[2] + 3]
            if reduce(xor, body) == total:
                found.append(bytes(body[1:]))
                del pending[: len(body) + 3]
            else:
                del pending[:2]


def _motion(speed: int, radius: int) -> np.ndarray:
    """Speed [m/s] and turn rate [rad/s] of a base control, in mm/s of the outer wheel and mm."""
    half = 0.5 * TRACK_MM
    if radius == 0:
        return np.array([1e-3 * speed, 0.0])
    if radius == 1:
        return np.array([0.0, speed / half])
    turn = speed / (radius + math.copysign(half, radius))
    return np.array([1e-3 * radius * turn, turn])
