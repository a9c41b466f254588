"""Simulated motion capture: poses at a rate of their own, sent and stamped late."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable

import numpy as np

from fulmar_core.config.process import PLANT_PRIORITY, take_priority
from fulmar_core.robots.robot import Robot
from fulmar_core.states.rotation import multiply
from fulmar_core.states.state import RigidBodyState
from fulmar_ros.deadline import Deadlines


class MotionCapture:
    """Not thread-safe; the plant's thread alone uses it."""

    def __init__(self, *, rate_hz: float = 0.0, late_s: float = 0.0) -> None:
        """Begin without a pose.

        Args:
            rate_hz: Captures; 0: with every measurement [Hz].
            late_s: From capture to sending; the stamp is that of the sending, as of sources that stamp on receipt [s].
        """
        self._period_ns = round(1e9 / rate_hz) if rate_hz else 0
        self._late_ns = round(1e9 * late_s)
        self._captured_ns: int | None = None
        self._under_way: deque[tuple[int, RigidBodyState]] = deque()

    def see(self, state: RigidBodyState, time_ns: int) -> list[tuple[int, RigidBodyState]]:
        """Note a measurement and its time [ns]; returns poses to send now, each with its stamp [ns]."""
        last = self._captured_ns
        if last is None or time_ns < last or time_ns - last >= self._period_ns:
            # Captures keep their own rate, whatever the rate of measurements.
            steps = (time_ns - last) // self._period_ns if last is not None and self._period_ns else 0
            self._captured_ns = last + steps * self._period_ns if last is not None and steps > 0 else time_ns
            self._under_way.append((time_ns + self._late_ns, state))
        due = []
        while self._under_way and self._under_way[0][0] <= time_ns:
            due.append(self._under_way.popleft())
        return due

    def close(self) -> None:
        """Nothing to end."""


class SteppedCapture:
    """Poses at a fixed rate above that of the measurements, in lock step.

    Between two measurements the pose moves on from the first at constant velocity, as in `PacedCapture`.
    """

    def __init__(self, *, rate_hz: float, late_s: float = 0.0) -> None:
        """Begin without a pose; arguments as in `MotionCapture`."""
        self._period_s = 1.0 / rate_hz
        self._line = MotionCapture(late_s=late_s)
        self._last: tuple[int, RigidBodyState] | None = None
        self._first_ns, self._count = 0, 0

    def see(self, state: RigidBodyState, time_ns: int) -> list[tuple[int, RigidBodyState]]:
        """Note a measurement and its time [ns]; returns poses to send now, each with its stamp [ns]."""
        if self._last is None or time_ns < self._last[0]:
            self._first_ns, self._count, self._last = time_ns, 0, (time_ns, state)
        due = []
        last_ns, last = self._last
        while (captured_ns := self._first_ns + round(1e9 * self._count * self._period_s)) <= time_ns:
            at_once = captured_ns == time_ns
            pose = state if at_once else moved_on(last, 1e-9 * (captured_ns - last_ns))
            due += self._line.see(pose, captured_ns)
            self._count += 1
        self._last = time_ns, state
        return due

    def close(self) -> None:
        """Nothing to end."""


Publish = Callable[[int, RigidBodyState], None]  # a stamp [ns] and a pose


class PacedCapture:
    """Publishes poses at a fixed rate in real time; between measurements the pose moves on at constant velocity.

    At 0.19 m/s² (the platform's largest acceleration) 20 ms of that are wrong by 0.04 mm.
    """

    def __init__(
        self, publish: Publish, *, rate_hz: float, late_s: float = 0.0, rate: float = 1.0, longest_s: float
    ) -> None:
        """Prepare; a thread starts with the first measurement.

        Args:
            publish: Called by the thread.
            rate_hz: Captures, in the time of the stamps [Hz].
            late_s: As in `MotionCapture` [s].
            rate: Seconds of the stamps a wall-clock second.
            longest_s: A measurement older than this is not moved on any further: the plant stands still [s].
        """
        self._publish, self._rate = publish, rate
        self._period_s = 1.0 / (rate_hz * rate)
        self._line = MotionCapture(late_s=late_s)
        self._longest_ns = round(1e9 * longest_s)
        self._lock = threading.Lock()
        self._newest: tuple[RigidBodyState, int, int] | None = None
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def see(self, state: RigidBodyState, time_ns: int) -> list[tuple[int, RigidBodyState]]:
        """Note a measurement and its time [ns]; the thread publishes the poses, so that none is returned."""
        with self._lock:
            self._newest = (state, time_ns, time.monotonic_ns())
        if self._thread is None:
            self._stop.clear()
            self._thread = threading.Thread(target=self._run, name="mocap", daemon=True)
            self._thread.start()
        return []

    def close(self) -> None:
        """End the thread; the next measurement starts another."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def _run(self) -> None:
        take_priority(PLANT_PRIORITY)
        deadlines, captured_ns = Deadlines(self._period_s), -1
        while deadlines.wait(self._stop):
            with self._lock:
                assert self._newest is not None
                state, time_ns, received_ns = self._newest
            passed_ns = round(self._rate * (time.monotonic_ns() - received_ns))
            ahead_ns = min(passed_ns, self._longest_ns)
            if 0 <= captured_ns - (time_ns + ahead_ns) <= self._longest_ns:
                continue  # the plant is late or stands still; further back, a new episode has begun
            captured_ns = time_ns + ahead_ns
            for stamp_ns, pose in self._line.see(moved_on(state, 1e-9 * ahead_ns), captured_ns):
                self._publish(stamp_ns, pose)


Capture = MotionCapture | SteppedCapture | PacedCapture
MakeCapture = Callable[[Publish], Capture]


def capture_maker(
    robot: Robot, *, rate_hz: float, late_s: float, rate: float = 1.0, lockstep: bool = False
) -> MakeCapture:
    """Choose the source of poses: with the plant's ticks, or beside them where it is faster.

    Args:
        robot: Says how often a plant ticks.
        rate_hz: Captures; 0: at every tick [Hz].
        late_s: As in `MotionCapture` [s].
        rate: Simulated seconds a wall-clock second.
        lockstep: Whether time stands still between commands; then poses are of the plant's own thread.
    """
    dt = robot.timing.physics_dt
    if rate_hz * dt <= 1.0:
        return lambda _publish: MotionCapture(rate_hz=rate_hz, late_s=late_s)
    if lockstep:
        return lambda _publish: SteppedCapture(rate_hz=rate_hz, late_s=late_s)
    return lambda publish: PacedCapture(publish, rate_hz=rate_hz, late_s=late_s, rate=rate, longest_s=dt)


def moved_on(state: RigidBodyState, seconds: float) -> RigidBodyState:
    """The state after some time at constant velocity and turn rate."""
    position = np.asarray(state.position_in_world) + seconds * np.asarray(state.velocity_in_world)
    half = 0.5 * seconds * np.asarray(state.angular_velocity_in_body)
    turn = np.array([*half, 1.0])  # of a small rotation
    attitude = multiply(np.asarray(state.quat_xyzw), turn / np.linalg.norm(turn))
    return RigidBodyState(position, attitude, state.velocity_in_world, state.angular_velocity_in_body)
