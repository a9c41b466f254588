"""The front seat of a Kingfisher, the boat's side of its sentences."""

from __future__ import annotations

import math
import time
from functools import reduce
from operator import xor

import numpy as np

from fulmar_core.simulation.backend import Sample
from fulmar_core.states.rotation import rotate_inverse
from fulmar_core.states.state import RigidBodyState
from sim_nodes.emulators.device import Link

TIMEOUT_S = 0.5  # without $PYDIR for so long the propellers stand (heron_controller)
NAVIGATION_S, INERTIAL_S, BATTERY_S = 0.1, 0.05, 1.0  # periods of the sentences; our values
LATITUDE, LONGITUDE = 49.6266, 6.1587  # [deg] of the simulator's origin; any place will do
POLAR_M, EQUATORIAL_M = 6356752.314245, 6378137.0
G = 9.80665


class KingfisherEmulator:
    """Turns its propellers by `$PYDIR` alone; reports navigation, velocities, inertial unit and battery.

    Attributes:
        mute: Report nothing, as a boat whose cable is cut.
        lost: Have no fix, as below a bridge.
    """

    def __init__(self, link: Link) -> None:
        self._link, self.address = link, link.address
        self._pending = b""
        self._command, self._commanded_s = np.zeros(2), -math.inf
        self._due = dict.fromkeys(("navigation", "inertial", "battery"), -math.inf)
        self.mute = self.lost = False

    def command(self, now_s: float) -> np.ndarray:
        """See `EmulatedDevice`."""
        *lines, self._pending = (self._pending + self._link.read()).split(b"\r\n")
        for line in lines:
            shares = _shares(line)
            if shares is not None:
                self._command, self._commanded_s = shares, now_s
        return self._command if now_s - self._commanded_s <= TIMEOUT_S else np.zeros(2)

    def report(self, sample: Sample, now_s: float) -> None:
        """See `EmulatedDevice`."""
        state = sample.odometry
        assert state is not None
        if self.mute:
            return
        clock = _clock(time.time())
        if self._is_due("inertial", INERTIAL_S, now_s) and sample.imu is not None:
            turn = np.degrees(sample.imu.angular_velocity) * (1.0, -1.0, -1.0)
            force = sample.imu.specific_force / G * (1.0, -1.0, -1.0)
            self._send(f"CPIMU,{clock}," + ",".join(f"{value:.6f}" for value in (*turn, *force)))
        if self._is_due("navigation", NAVIGATION_S, now_s):
            self._navigation(state, clock)
        if self._is_due("battery", BATTERY_S, now_s):
            self._send(f"CPRBS,{clock},0,15.8,3.95,3.94,25.0")

    def close(self) -> None:
        """See `EmulatedDevice`."""
        self._link.close()

    def _navigation(self, state: RigidBodyState, clock: str) -> None:
        ve, vn, _ = state.velocity_in_world
        p, q, r = np.degrees(state.angular_velocity_in_body)
        self._send(f"CPNVR,{clock},{ve:.5f},{vn:.5f},0,{-q:.6f},{p:.6f},{-r:.6f}")
        latitude, longitude = _place(*state.position_in_world[:2])
        ahead = rotate_inverse(state.quat_xyzw, np.array([0.0, 0.0, 1.0]))  # the world's up in the body
        roll = math.degrees(math.atan2(ahead[1], ahead[2]))
        pitch = math.degrees(math.asin(max(-1.0, min(1.0, float(ahead[0])))))
        heading = (90.0 - math.degrees(float(state.yaw))) % 360.0
        self._send(
            f"CPNVG,{clock},{_minutes(latitude, 'NS')},{_minutes(longitude, 'EW')},{int(not self.lost)},,,"
            f"{heading:.5f},{roll:.5f},{pitch:.5f},{clock}"
        )

    def _is_due(self, what: str, period_s: float, now_s: float) -> bool:
        if now_s < self._due[what]:
            return False
        self._due[what] = max(self._due[what] + period_s, now_s + 0.5 * period_s)
        return True

    def _send(self, body: str) -> None:
        self._link.write(f"${body}*{reduce(xor, body.encode()):02X}\r\n".encode())


def _shares(line: bytes) -> np.ndarray | None:
    """Shares of a `$PYDIR`, -1 to 1 a side; None for other or damaged sentences."""
    body, _, total = line.removeprefix(b"$").partition(b"*")
    name, *values = body.split(b",")
    try:
        if not line.startswith(b"$") or int(total, 16) != reduce(xor, body) or name != b"PYDIR":
            return None
        left, right = (float(value) for value in values)
    except ValueError:
        return None
    return np.clip((0.01 * left, 0.01 * right), -1.0, 1.0)


def _place(east: float, north: float) -> tuple[float, float]:
    """Latitude and longitude of metres from the origin, by the radii of curvature there."""
    a, b, latitude = EQUATORIAL_M, POLAR_M, math.radians(LATITUDE)
    root = math.hypot(a * math.cos(latitude), b * math.sin(latitude))
    meridian, parallel = (a * b) ** 2 / root**3, a * a / root * math.cos(latitude)
    return LATITUDE + math.degrees(north / meridian), LONGITUDE + math.degrees(east / parallel)


def _minutes(degrees: float, sides: str) -> str:
    whole, part = divmod(abs(degrees), 1.0)
    return f"{int(whole):02d}{60.0 * part:09.6f},{sides[degrees < 0.0]}"


def _clock(seconds: float) -> str:
    """UTC as hhmmss.sss."""
    millis = round(1e3 * (seconds % 86400.0)) % 86_400_000
    hours, rest = divmod(millis, 3_600_000)
    minutes, rest = divmod(rest, 60_000)
    return f"{hours:02d}{minutes:02d}{rest // 1000:02d}.{rest % 1000:03d}"
