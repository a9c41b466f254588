"""X-Plane with the plugin XPlaneConnect, the simulator's side of its datagrams."""

from __future__ import annotations

import math
import socket
import struct
from collections.abc import Callable

import numpy as np

from fulmar_core.robots.actuators.control_surfaces import ControlSurfaces
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.backend import Sample
from fulmar_core.states.rotation import rotate, rotate_inverse
from fulmar_core.states.state import RigidBodyState

LATITUDE, LONGITUDE = (
    49.5,
    -3.0,
)  # [deg] of the simulator's origin, at sea level; any place will do
EQUATORIAL_M, POLAR_M = 6378137.0, 6356752.314245
LONGEST = 4096
BUFFER = 2**18  # bytes of what comes while the emulator does not read, of a second about
UNCHANGED = -998.0
RESTS = "sim/operation/override/override_planepath"  # whether the physics of each aircraft rest
AIRCRAFT = 20
PLACE = "sim/flightmodel/position/"
ENGINES = "sim/flightmodel/engine/ENGN_thro"


class XPlaneEmulator:
    """Moves the surfaces by CTRL and the throttles by DREF, and keeps them; answers GETP, GETC and GETD once a frame.

    Attributes:
        paused: Whether time stands still, as it does at first; SIMU changes it.
        mute: Answer nothing, as an X-Plane that has crashed.
        drop: Says of each datagram that comes whether it is lost on its way; None: none is.
        lie: Spoils the answers: takes each datagram, and gives the one to send; None: they are true.
    """

    def __init__(self, robot: Robot, clock: Callable[[], float], port: int = 0) -> None:
        """Listen on a UDP port of this host.

        Args:
            robot: The aircraft.
            clock: Simulated time, which stands still while `paused` [s].
            port: 0 takes any free one.
        """
        self._actuators, self._clock = robot.actuated_by(ControlSurfaces), clock
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", port))
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
        self.address = f"udp://127.0.0.1:{self._socket.getsockname()[1]}"
        self._stick = dict.fromkeys(("elevator", "aileron", "rudder"), 0.0)  # pitch, roll and yaw, -1 to 1
        self._throttles = [0.0] * len(self._actuators.motors)
        self._asked: list[tuple[bytes, tuple[str, int]]] = []
        self._frame: tuple[float, np.ndarray] | None = None  # time [s] and velocity of the last one
        self._acceleration = np.zeros(3)
        self.paused, self.mute = True, False
        self.drop: Callable[[bytes], bool] | None = None
        self.lie: Callable[[bytes], bytes] | None = None

    def command(self, now_s: float) -> np.ndarray:
        """See `EmulatedDevice`; there is no timeout: the last stick and throttles hold."""
        while True:
            try:
                datagram, sender = self._socket.recvfrom(LONGEST)
            except BlockingIOError:
                break
            except OSError:
                continue  # a client that is gone refuses its answer
            if self.drop is None or not self.drop(datagram):
                self._take(datagram, sender)
        # Stick back and pedals right move elevator and rudder against the signs of the robot's commands.
        signs = {"elevator": -1.0, "aileron": 1.0, "rudder": -1.0}
        shares = [signs[surface.name] * self._stick[surface.name] for surface in self._actuators.surfaces]
        return np.array([*shares, *self._throttles]) * self._actuators.scale

    def report(self, sample: Sample, now_s: float) -> None:
        """See `EmulatedDevice`: answer what was asked since the frame before."""
        state = sample.truth
        assert state is not None
        self._advance(state)
        asked, self._asked = self._asked, []
        for question, sender in asked:
            answer = self._answer(question, state)
            if self.lie is not None:
                answer = self.lie(answer)
            if answer and not self.mute:
                try:
                    self._socket.sendto(answer, sender)
                except OSError:
                    continue  # no client

    def close(self) -> None:
        """See `EmulatedDevice`."""
        self._socket.close()

    def _take(self, datagram: bytes, sender: tuple[str, int]) -> None:
        head = datagram[:4]
        if head in (b"GETP", b"GETC", b"GETD"):
            self._asked.append((datagram, sender))
        elif head == b"SIMU" and len(datagram) == 6:
            self.paused = {0: False, 1: True, 2: not self.paused}.get(datagram[5], self.paused)
        elif head == b"CTRL" and len(datagram) in (26, 27, 31):
            pitch, roll, yaw, throttle = struct.unpack_from("<4f", datagram, 5)
            for name, value in zip(self._stick, (pitch, roll, yaw), strict=True):
                if value != UNCHANGED:
                    self._stick[name] = min(1.0, max(-1.0, value))
            if throttle != UNCHANGED:
                self._throttles = [min(1.0, max(0.0, throttle))] * len(self._throttles)
        elif head == b"DREF":
            self._set(datagram)

    def _set(self, datagram: bytes) -> None:
        at = 5
        while at < len(datagram):
            end = at + 1 + datagram[at]
            name, count = datagram[at + 1 : end].decode(), datagram[end]
            values = struct.unpack_from(f"<{count}f", datagram, end + 1)
            if name == ENGINES:
                for engine, value in enumerate(values[: len(self._throttles)]):
                    self._throttles[engine] = min(1.0, max(0.0, value))
            at = end + 1 + 4 * count

    def _advance(self, state: RigidBodyState) -> None:
        """Find the acceleration since the frame before."""
        time_s, velocity = self._clock(), np.array(state.velocity_in_world)
        if self._frame is not None and time_s > self._frame[0]:
            self._acceleration = (velocity - self._frame[1]) / (time_s - self._frame[0])
        self._frame = (time_s, velocity)

    def _answer(self, question: bytes, state: RigidBodyState) -> bytes:
        head = question[:4]
        if head == b"GETP":
            return struct.pack("<4sxB3d4f", b"POSI", 0, *_place(state), *_angles(state), 0.0)
        if head == b"GETC":
            stick = (*self._stick.values(), self._throttles[0])
            return struct.pack("<4sx4fbfBf", b"CTRL", *stick, 0, 0.0, 0, 0.0)
        values = self._references(state)
        body, at = b"", 6
        for _ in range(question[5]):
            name = question[at + 1 : at + 1 + question[at]].decode()
            at += 1 + question[at]
            if name == RESTS:
                body += struct.pack(f"<B{AIRCRAFT}f", AIRCRAFT, *[float(self.paused)] * AIRCRAFT)
            else:
                body += struct.pack("<Bf", 1, values[name]) if name in values else b"\0"
        return b"RESP\0" + question[5:6] + body

    def _references(self, state: RigidBodyState) -> dict[str, float]:
        """Data references by name, in X-Plane's units: east, up and south, degrees."""
        (ve, vn, vu), (ae, an, au) = state.velocity_in_world, self._acceleration
        p, q, r = np.degrees(state.angular_velocity_in_body)
        ahead, left, up = rotate_inverse(state.quat_xyzw, np.asarray(state.velocity_in_world))
        speed = math.sqrt(ahead**2 + left**2 + up**2)
        heading_beyond_path = math.degrees(math.asin(left / speed)) if speed else 0.0
        named = {
            "local_vx": ve, "local_vy": vu, "local_vz": -vn, "local_ax": ae, "local_ay": au, "local_az": -an,
            "P": p, "Q": -q, "R": -r, "true_airspeed": speed, "alpha": math.degrees(math.atan2(-up, ahead)),
            "beta": heading_beyond_path, "y_agl": state.position_in_world[2],
        }  # fmt: skip
        found = {PLACE + name: float(value) for name, value in named.items()}
        return found | {"sim/time/total_flight_time_sec": self._clock()}


def _place(state: RigidBodyState) -> tuple[float, float, float]:
    """Latitude, longitude [deg] and altitude [m], by the radii of curvature at the origin."""
    east, north, up = (float(part) for part in state.position_in_world)
    a, b, latitude = EQUATORIAL_M, POLAR_M, math.radians(LATITUDE)
    root = math.hypot(a * math.cos(latitude), b * math.sin(latitude))
    meridian, parallel = (a * b) ** 2 / root**3, a * a / root * math.cos(latitude)
    return LATITUDE + math.degrees(north / meridian), LONGITUDE + math.degrees(east / parallel), up


def _angles(state: RigidBodyState) -> tuple[float, float, float]:
    """Pitch up, roll right and true heading [deg], from where nose and left wing point."""
    nose = rotate(state.quat_xyzw, np.array([1.0, 0.0, 0.0]))
    up = rotate_inverse(state.quat_xyzw, np.array([0.0, 0.0, 1.0]))
    pitch = math.asin(max(-1.0, min(1.0, float(nose[2]))))
    return (
        math.degrees(pitch),
        math.degrees(math.atan2(up[1], up[2])),
        math.degrees(math.atan2(nose[0], nose[1])) % 360.0,
    )
