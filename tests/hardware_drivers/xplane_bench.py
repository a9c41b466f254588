"""An emulated X-Plane at a UDP port, which flies the core's dynamics by the clock, and one that answers at once."""

from __future__ import annotations

import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from fulmar_core.dynamics.flight_trim import find_trim, flying_at
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import Episode, draw_episode
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from hardware_drivers.driver_backend import DriverBackend, backend_of
from hardware_drivers.settings import Geodetic, XPlane
from hardware_drivers.xplane_driver import XPlaneDriver
from sim_nodes.emulators.xplane import XPlaneEmulator
from sim_nodes.mock_backend import MockBackend

ROBOT = load_robot("airship_v7")
START = (30.0, -20.0, 4.0, 0.0, 0.0, 70.0)  # m, deg: nose a little east of north

ORIGIN = Geodetic(49.5, -3.0)
SILENT_S = 0.3


def episode_at(start: tuple[float, ...]) -> Episode:
    """A still world with an aircraft in trim."""
    task = load_task("fly_hold").fitted(ROBOT)
    drawn = draw_episode(ROBOT, task, load_scenario("ideal"), seed=1, number=0)
    return replace(drawn, start=flying_at(ROBOT, np.asarray(SpatialState.target_at(start))))


def trim() -> np.ndarray:
    """The command that keeps level flight at the start, for a while."""
    return np.asarray(find_trim(ROBOT, ROBOT.airframe.speed, START[2]).command)


class XPlaneBench:
    """Steps an emulated X-Plane and its physics in real time, in a thread of its own."""

    def __init__(self, start: tuple[float, ...] = START) -> None:
        self.backend = MockBackend(ROBOT)
        self.sample = self.backend.reset(episode_at(start), seed=1)
        self.device = XPlaneEmulator(ROBOT, lambda: self.backend.time_s)
        self.command = ROBOT.actuators.safe_command
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        dt = ROBOT.timing.physics_dt
        due = time.monotonic()
        while not self._over.wait(max(0.0, due - time.monotonic())):
            self.command = self.device.command(time.monotonic())
            if not self.device.paused:
                self.sample = self.backend.step(self.command)
            self.device.report(self.sample, time.monotonic())
            due = max(due + dt, time.monotonic() - 0.1)

    def stop(self) -> None:
        self._over.set()
        self._thread.join()
        self.device.close()


class Peer:
    """An X-Plane that answers at once, of an aircraft in uniform flight; a thread, for a `with`.

    Attributes:
        lie: Spoils the answers: takes each datagram, and gives the one to send; empty: none.
        paused: As of the last SIMU.
    """

    def __init__(self, receive: Callable[[bytes], object] = lambda _datagram: None, port: int = 0) -> None:
        """Listen on a port, 0: on a free one; `receive` gets every datagram."""
        self._receive = receive
        self.paused = False
        self.lie: Callable[[bytes], bytes] = lambda answer: answer
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", port))
        self._socket.settimeout(0.05)
        self.port = self._socket.getsockname()[1]
        self.address = f"udp://127.0.0.1:{self.port}"
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> Peer:
        self._thread.start()
        return self

    def __exit__(self, *_error: object) -> None:
        self._over.set()
        self._thread.join()
        self._socket.close()

    def _run(self) -> None:
        began = time.monotonic()
        while not self._over.is_set():
            try:
                question, sender = self._socket.recvfrom(4096)
            except TimeoutError:
                continue
            self._receive(question)
            if question[:4] == b"SIMU":
                self.paused = question[5] == 1
            answer = self._answer(question, time.monotonic() - began)
            answer = answer and self.lie(answer)
            if answer:
                self._socket.sendto(answer, sender)

    def _answer(self, question: bytes, time_s: float) -> bytes:
        head = question[:4]
        if head == b"GETP":
            latitude = 49.5 + 2.5e-4 * time_s  # 28 m/s
            return struct.pack("<4sxB3d4f", b"POSI", 0, latitude, -3.0, 5.0, 0.0, 0.0, 0.0, 0.0)
        if question == b"GETD\0\1\x29sim/operation/override/override_planepath":
            return b"RESP\0\x01\x14" + struct.pack("<20f", *[float(self.paused)] * 20)
        if head == b"GETD":
            values = (0.0, 0.0, -28.0, *[0.0] * 6, 28.0, 0.0, 0.0, 5.0, time_s)
            return b"RESP\0\x0e" + b"".join(struct.pack("<Bf", 1, value) for value in values)
        return b""


def until(condition: Callable[[], bool], timeout_s: float = 5.0) -> None:
    """Wait for something."""
    end = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.005)


def settings_of(address: str, **more: object) -> XPlane:
    """Settings of an X-Plane at an address, which counts as lost after `SILENT_S`."""
    return replace(XPlane("xplane", address, origin=ORIGIN, silent_s=SILENT_S), **more)


def running_bench() -> Iterator[XPlaneBench]:
    """Fixture `bench` of tests."""
    bench = XPlaneBench()
    yield bench
    bench.stop()


def driver_at(bench: XPlaneBench) -> Iterator[DriverBackend]:
    """Fixture `driver` of tests."""
    driver = backend_of(ROBOT, XPlaneDriver(ROBOT, settings_of(bench.device.address), patience_s=5.0))
    yield driver
    driver.close()


def begin(driver: DriverBackend) -> None:
    """Let the flight begin at the start."""
    driver.reset(episode_at(START), seed=0)
