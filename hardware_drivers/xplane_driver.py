"""Driver of an aircraft in X-Plane, by the plugin XPlaneConnect."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence

import numpy as np

from fulmar_core.config.errors import DeviceError
from fulmar_core.robots.actuators.control_surfaces import ControlSurfaces
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.air_data import NAME as AIR_DATA
from fulmar_core.robots.sensors.air_data import AirData
from fulmar_core.wires.reading import Reading
from hardware_drivers.believable_motion import unbelievable
from hardware_drivers.driver import DeviceDriver
from hardware_drivers.earth_frame import LocalFrame
from hardware_drivers.feedback import Feedback, Report
from hardware_drivers.ports import Reader, open_port
from hardware_drivers.settings import XPlane
from hardware_drivers.xplane_messages import (
    KEEP,
    RUN,
    AskPosition,
    AskReferences,
    Controls,
    Message,
    Position,
    References,
    Simulation,
    Values,
)
from hardware_drivers.xplane_pause import AGAIN_S, Pause
from hardware_drivers.xplane_protocol import MalformedError, decode, encode
from hardware_drivers.xplane_state import ASKED, Flight, Placed, check_place, flight_of

THROTTLES = "sim/flightmodel/engine/ENGN_thro"  # of each engine, from the left, 0 to 1
# A positive elevator lowers the nose and a positive rudder turns it left; stick and pedals do the opposite.
STICK = {"elevator": -1.0, "aileron": 1.0, "rudder": -1.0}
STILL_NS = 150_000_000  # between two frames of an X-Plane that runs there is less
HALT_S = 0.3  # for X-Plane to say that it is paused, of which it has time once a frame
HINT = "Does X-Plane run there, not paused, with the plugin XPlaneConnect?"


class XPlaneDriver(DeviceDriver):
    """Flies by CTRL and DREF, measures by GETP and GETD.

    The driver pauses X-Plane until `begin` and again where commands end, since an aircraft without commands falls.
    """

    def __init__(self, robot: Robot, settings: XPlane, *, patience_s: float) -> None:
        """Open the link, wait for the first answer, and pause X-Plane.

        Raises:
            DeviceError: Nothing answers.
        """
        self._robot, self._actuators, self._settings = robot, robot.actuated_by(ControlSurfaces), settings
        self._feedback = Feedback(f"X-Plane at {settings.port}", settings.silent_s, hint=HINT)
        origin = settings.origin
        self._frame = LocalFrame(origin.latitude, origin.longitude) if origin else None
        self._odom = Placed.unmoved(settings.elevation)
        self._position: Position | None = None
        self._believed: tuple[Flight, int, int] | None = None  # and when, by steady and wall clock [ns]
        self._placing = threading.Lock()  # no report is placed by an `odom` that has just moved
        self._running, self._refused = False, 0  # before it runs, a person may move the aircraft
        self._lost = False  # X-Plane, and `read` has said so
        self._pause = Pause(self._send)
        self._over, self._answered = threading.Event(), threading.Event()
        self._port = open_port(settings.port, 0, patience_s)
        self._reader = Reader(self._port, self._take, self._feedback.fail)
        self._asking = threading.Thread(target=self._ask, name="X-Plane asker", daemon=True)
        self._asking.start()
        try:
            self._feedback.wait(patience_s)
        except Exception:
            self._release()
            raise
        self.halt()

    def begin(self, x: float, y: float, heading: float) -> None:
        """Let X-Plane run; without an origin, set the aircraft's pose in `odom`. See `DeviceDriver`."""
        with self._placing:
            assert self._believed is not None  # as of the first report
            flight, _, stamp_ns = self._believed
            if self._settings.origin is None:
                self._odom = Placed.at(flight.state, x, y, heading, self._settings.elevation)
            self._feedback.put(self._report(flight, stamp_ns))
            self._running = True
        self._send(Simulation(RUN))

    def write(self, command: np.ndarray) -> None:
        """Send deflections [rad] and throttles; see `DeviceDriver`."""
        surfaces = self._actuators.positions
        shares = np.asarray(command, dtype=float)[:surfaces] / self._actuators.scale[:surfaces]
        stick = dict.fromkeys(STICK, 0.0)
        for surface, share in zip(self._actuators.surfaces, shares.tolist(), strict=True):
            stick[surface.name] = STICK[surface.name] * share
        self._send(Controls(stick["elevator"], stick["aileron"], stick["rudder"], KEEP))
        throttles = tuple(float(value) for value in command[surfaces:])
        self._send(References(((THROTTLES, throttles),)))

    def read(self) -> Report:
        """See `DeviceDriver`."""
        try:
            return self._feedback.read()
        except DeviceError:
            self._lost = True
            raise

    def health(self) -> dict[str, str]:
        """Refused datagrams; see `DeviceDriver`."""
        return {"refused_datagrams": str(self._refused), "warning": self._feedback.refusal}

    def halt(self) -> None:
        """Pause X-Plane; see `Halting`."""
        with self._placing:
            self._running = False
        self._pause.confirmed(HALT_S)

    def close(self) -> None:
        """Pause X-Plane, and close the link; see `DeviceDriver`.

        Raises:
            DeviceError: X-Plane does not say that it is paused, and `read` has not reported that it is lost.
        """
        paused = self._pause.confirmed(HALT_S)
        self._release()
        if not paused and not self._lost:
            raise DeviceError(
                f"X-Plane at {self._settings.port}: {HALT_S:g} s of PAUSE were not confirmed, and the aircraft may fly "
                "on without commands. Pause it by the key P."
            )

    def _release(self) -> None:
        self._over.set()
        self._asking.join(0.5)
        self._reader.stop()

    def _send(self, message: Message) -> None:
        self._port.write(encode(message))

    def _ask(self) -> None:
        """Ask as soon as an answer has come: once a frame, and never more than X-Plane works off."""
        while not self._over.wait(1.0 / self._settings.rate_hz):
            self._answered.wait(AGAIN_S)
            self._answered.clear()
            try:
                self._send(AskPosition())
                self._send(AskReferences(ASKED))
            except OSError as error:
                self._feedback.fail(f"the link is gone ({error})")
                return

    def _take(self, data: bytes) -> None:
        now_ns = time.time_ns()
        try:
            message = decode(data)
            if isinstance(message, Position):
                self._position = message
            elif isinstance(message, Values):
                if not self._pause.take(message):
                    self._answered.set()
                    self._answer(message, now_ns)
            else:
                raise MalformedError(f"{type(message).__name__} was not asked for")
        except MalformedError as error:
            self._refuse(str(error))

    def _answer(self, values: Values, now_ns: int) -> None:
        """Take the second answer of a frame; its place came before it."""
        position, self._position = self._position, None
        if position is None:
            return  # that datagram is lost
        check_place(position)
        with self._placing:
            if self._settings.origin is None and not self._running:  # a person may still move the aircraft
                self._frame = LocalFrame(position.latitude, position.longitude)
            assert self._frame is not None  # of the origin, or of the first answer
            self._believe(flight_of(position, values, self._frame), now_ns)

    def _believe(self, flight: Flight, now_ns: int) -> None:
        """Report a frame if it is new, and no lie."""
        steady_ns, last = time.monotonic_ns(), self._believed if self._running else None
        if last is not None and flight.time_s == last[0].time_s:  # no new frame
            if steady_ns - last[1] > STILL_NS:
                self._feedback.refuse("X-Plane's time stands still")
            return
        before = None if last is None else (last[0].state, last[1])
        reason = unbelievable(flight.state, steady_ns, before, self._robot.limits, turns_freely=True)
        if reason:
            self._refuse(reason)
            return
        self._believed = flight, steady_ns, now_ns
        self._feedback.put(self._report(flight, now_ns))

    def _report(self, flight: Flight, now_ns: int) -> Report:
        """A report of the sensors that the robot's file has."""
        state, sensors = self._odom.seen(flight.state), self._robot.sensors.specs
        others = {}
        if AIR_DATA in sensors:
            others[AIR_DATA] = Reading(_chosen(flight.air, sensors[AIR_DATA].names), stamp_ns=now_ns)
        return Report(state, flight.imu if "imu" in sensors else None, now_ns, others)

    def _refuse(self, reason: str) -> None:
        self._refused += 1
        self._feedback.refuse(reason)


def _chosen(air: AirData, names: Sequence[str]) -> AirData:
    """The air data that a robot's file names."""
    every = dict(zip(air.names, air.values.tolist(), strict=True))
    return AirData(tuple(names), np.array([every[name] for name in names]))
