"""PX4 at the other end of px4_msgs, by the names and fields of its messages; shares no code with the driver."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from scipy.spatial.transform import Rotation

from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.backend import Sample
from fulmar_core.states.state import RigidBodyState
from sim_nodes.emulators.inner_loop import InnerLoop
from sim_nodes.emulators.parameters import EmulatedParameters

MANUAL, POSCTL, LOITER, RTL, TERMINATION, OFFBOARD = 0, 2, 4, 5, 13, 14  # of nav_state
DISARMED, ARMED = 1, 2
ACTIONS = {
    0: POSCTL,
    1: 1,
    2: MANUAL,
    3: RTL,
    4: 18,
    5: LOITER,
    6: TERMINATION,
}  # of COM_OBL_RC_ACT; 7 disarms
DISARM = 7
SET_MODE, ARM_DISARM = 176, 400
ACCEPTED, TEMPORARILY_REJECTED, DENIED = 0, 1, 2
PROOF_S, FRESH_S = 1.0, 0.5  # of the stream: how long it must have lasted, and how old the newest may be
STATUS_S, CLOCK_S = 0.5, 1.0
NED_FROM_ENU = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
FRD = np.diag([1.0, -1.0, -1.0])
MOTORS = 12
NAMES = ("thrusters", "wing")


class Sender(Protocol):
    """Sends and receives messages."""

    def send(self, kind: str, fields: Mapping[str, Any]) -> None:
        """Send one by the name of its type."""
        ...

    def listen(self, receive: Callable[[str, Any], None]) -> None:
        """Give every message that comes to a function."""
        ...


class Px4Emulator:
    """Keeps offboard mode while the stream lasts, arms, and moves thrusters or a wing.

    Attributes:
        armed: Whether its outputs may move; an operator may change it.
        nav_state: Its mode; an operator may change it.
        parameters: COM_OF_LOSS_T and COM_OBL_RC_ACT.
        denied: Numbers of commands that it refuses.
        mute: Send nothing, as where the agent has ended.
        frozen: Send the newest odometry again and again.
        lie: Spoils the fields of what it sends, by the message's name; None: nothing is spoilt.
        clock_us: How far its clock, which the stamps go by, is from that of this computer [µs].
    """

    address = ""

    def __init__(self, robot: Robot, order: Sequence[int], *, wing: bool) -> None:
        """Switch it on, without a companion; a wing flies already, in Hold."""
        self._robot, self._order, self._wing = robot, list(order), wing
        self._inner = InnerLoop(robot) if wing else None
        self.armed, self.nav_state = wing, LOITER if wing else MANUAL
        self.failsafe = False
        self.parameters = EmulatedParameters(
            {"COM_OF_LOSS_T": 1.0, "COM_OBL_RC_ACT": 0 if wing else 7}, bytewise=True
        )
        self.denied: set[int] = set()
        self.mute = self.frozen = False
        self.lie: Callable[[str, dict[str, Any]], dict[str, Any]] | None = None
        self.clock_us = 0
        self.received: dict[str, Any] = {}  # the newest message by its name
        self.counts: dict[str, int] = {}
        self._lock = threading.Lock()
        self._streamed_s = self._stream_began_s = -math.inf
        self._sender: Sender | None = None
        self._state: RigidBodyState | None = None
        self._odometry: dict[str, Any] | None = None
        self._status_s = self._clock_s = -math.inf
        self._said: tuple[int, bool, bool] | None = None

    def connect(self, sender: Sender) -> None:
        """Speak and receive by a link."""
        self._sender = sender
        sender.listen(self.receive)

    def receive(self, kind: str, message: Any) -> None:
        """Take a message of the companion; from any thread."""
        now_s = time.monotonic()
        with self._lock:
            self.received[kind] = message
            self.counts[kind] = self.counts.get(kind, 0) + 1
            if kind == "OffboardControlMode":
                if now_s - self._streamed_s > FRESH_S:
                    self._stream_began_s = now_s
                self._streamed_s = now_s
        if kind == "VehicleCommand":
            self._obey(message, now_s)

    def command(self, now_s: float) -> np.ndarray:
        """See `EmulatedDevice`."""
        with self._lock:
            self._see_loss(now_s)
            controls = self.received.get("OffboardControlMode")
            if self._wing:
                return self._flown(controls, now_s)
            if controls is None or not (
                self.armed and self.nav_state == OFFBOARD and controls.direct_actuator
            ):
                return np.zeros(len(self._order))
            return self._opened()

    def report(self, sample: Sample, now_s: float) -> None:
        """See `EmulatedDevice`."""
        self._state = sample.truth
        measured = sample.odometry
        if self._sender is None or self.mute or measured is None:
            return
        stamp_us = time.time_ns() // 1000 + self.clock_us
        if not self.frozen or self._odometry is None:
            self._odometry = _odometry(measured, stamp_us)
        self._send("VehicleOdometry", self._odometry)
        if sample.imu is not None:
            force, turn = sample.imu.specific_force @ FRD, sample.imu.angular_velocity @ FRD
            self._send(
                "SensorCombined",
                {"timestamp": stamp_us, "accelerometer_m_s2": _floats(force), "gyro_rad": _floats(turn)},
            )
        with self._lock:
            said = self.nav_state, self.armed, self.failsafe
        if said != self._said or now_s - self._status_s >= STATUS_S:
            self._said, self._status_s = said, now_s
            state = {
                "nav_state": said[0],
                "arming_state": ARMED if said[1] else DISARMED,
                "failsafe": said[2],
            }
            kind = {"vehicle_type": 2 if self._wing else 1, "system_id": 1, "component_id": 1}
            self._send("VehicleStatus", {"timestamp": stamp_us, **state, **kind})
        if now_s - self._clock_s >= CLOCK_S:
            self._clock_s = now_s
            exchange = {"source_protocol": 2, "estimated_offset": self.clock_us, "round_trip_time": 900}
            self._send("TimesyncStatus", {"timestamp": stamp_us, **exchange})

    def close(self) -> None:
        """See `EmulatedDevice`; its link is closed by who made it."""

    def _send(self, kind: str, fields: dict[str, Any]) -> None:
        assert self._sender is not None
        self._sender.send(kind, fields if self.lie is None else self.lie(kind, dict(fields)))

    def _obey(self, message: Any, now_s: float) -> None:
        with self._lock:
            result = ACCEPTED
            if message.target_system != 1:
                return
            if message.command in self.denied:
                result = DENIED
            elif message.command == ARM_DISARM:
                self.armed = message.param1 == 1.0
                self.failsafe = self.failsafe and self.armed
            elif message.command == SET_MODE and message.param1 == 1.0:
                result = self._change_mode((int(message.param2), int(message.param3)), now_s)
            else:
                result = 3
        if self._sender is not None and not self.mute:
            self._sender.send("VehicleCommandAck", {"command": int(message.command), "result": result})

    def _change_mode(self, mode: tuple[int, int], now_s: float) -> int:
        proven = now_s - self._streamed_s <= FRESH_S and now_s - self._stream_began_s >= PROOF_S
        if mode[0] == 6:
            if not proven:
                return TEMPORARILY_REJECTED
            self.nav_state, self.failsafe = OFFBOARD, False
        elif mode == (4, 3):
            self.nav_state = LOITER
        else:
            return DENIED
        return ACCEPTED

    def _see_loss(self, now_s: float) -> None:
        """Leave offboard mode, armed, without its stream; a PX4 that is not armed stays in it."""
        values = self.parameters.values
        lost = now_s - self._streamed_s > values["COM_OF_LOSS_T"]
        if not (lost and self.armed and self.nav_state == OFFBOARD):
            return
        action, self.failsafe = int(values["COM_OBL_RC_ACT"]), True
        if action == DISARM:
            self.armed, self.nav_state = False, POSCTL
        else:
            self.nav_state = ACTIONS.get(action, POSCTL)
            self.armed = action != 6

    def _opened(self) -> np.ndarray:
        valves = np.zeros(len(self._order))
        motors, servos = self.received.get("ActuatorMotors"), self.received.get("ActuatorServos")
        if motors is None:
            return valves
        values = [float(value) for value in motors.control[:MOTORS]]
        values += [0.5 * (float(value) + 1.0) for value in servos.control] if servos is not None else []
        for output, thruster in enumerate(self._order):
            value = values[output] if output < len(values) else math.nan
            valves[thruster] = min(1.0, max(0.0, value)) if math.isfinite(value) else 0.0
        return valves

    def _flown(self, controls: Any, now_s: float) -> np.ndarray:
        inner, state = self._inner, self._state
        assert inner is not None
        if state is None:
            return inner.trim
        attitude, rates = (
            self.received.get("VehicleAttitudeSetpoint"),
            self.received.get("VehicleRatesSetpoint"),
        )
        if controls is not None and self.nav_state == OFFBOARD and self.armed:
            if controls.attitude and attitude is not None:
                w, x, y, z = (float(part) for part in attitude.q_d)
                _, pitch, roll = Rotation.from_quat([x, y, z, w]).as_euler("ZYX")
                return inner.by_attitude(roll, pitch, float(attitude.thrust_body[0]), state, now_s)
            if controls.body_rate and rates is not None:
                wanted = np.array([rates.roll, -rates.pitch, -rates.yaw], dtype=float)
                return inner.by_rates(wanted, float(rates.thrust_body[0]), state, now_s)
        return inner.level(state, now_s)


def _odometry(state: RigidBodyState, stamp_us: int) -> dict[str, Any]:
    turn = NED_FROM_ENU @ Rotation.from_quat(np.asarray(state.quat_xyzw)).as_matrix() @ FRD
    x, y, z, w = Rotation.from_matrix(turn).as_quat().tolist()
    return {
        "timestamp": stamp_us,
        "timestamp_sample": stamp_us,
        "pose_frame": 1,
        "position": _floats(NED_FROM_ENU @ np.asarray(state.position_in_world)),
        "q": [w, x, y, z],
        "velocity_frame": 1,
        "velocity": _floats(NED_FROM_ENU @ np.asarray(state.velocity_in_world)),
        "angular_velocity": _floats(FRD @ np.asarray(state.angular_velocity_in_body)),
    }


def _floats(values: np.ndarray) -> list[float]:
    return [float(value) for value in values]
