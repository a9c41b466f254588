"""Offboard mode of PX4: the stream that keeps it, the commands that enter and leave it, and its loss."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any, Protocol

from fulmar_core.config.errors import DeviceError
from hardware_drivers.px4_vehicle import Px4Vehicle
from hardware_drivers.takeover import OBEYS_S

SET_MODE, ARM_DISARM = 176, 400  # VEHICLE_CMD
CUSTOM = 1.0  # MAV_MODE_FLAG_CUSTOM_MODE_ENABLED, without which PX4 ignores the mode
OFFBOARD_MODE = (6.0, 0.0)  # PX4_CUSTOM_MAIN_MODE_OFFBOARD
HOLD_MODE = (4.0, 3.0)  # PX4_CUSTOM_MAIN_MODE_AUTO, PX4_CUSTOM_SUB_MODE_AUTO_LOITER
HOST_SYSTEM, HOST_COMPONENT = 255, 190  # as in `mavlink_link`
STREAM_S = (
    0.05  # between two messages of the stream while the driver waits; PX4 asks for more than two a second
)
PROOF_S = 1.1  # PX4 takes set points once the stream has lasted a second
AGAIN_S = 0.3  # a command without an effect is sent again after so long
GONE_S = 0.7  # so much later than its time PX4 may notice the loss: status twice a second, and its loop
CONTROL = (
    "position",
    "velocity",
    "acceleration",
    "attitude",
    "body_rate",
    "thrust_and_torque",
    "direct_actuator",
)


class Px4Link(Protocol):
    """Messages to and from PX4, by the names of their types."""

    def listen(self, receive: Callable[[str, Any], None]) -> None:
        """Give every message that comes to a function, with the name of its type, from one thread."""
        ...

    def send(self, kind: str, fields: Mapping[str, Any]) -> None:
        """Send a message; fields that are not named are 0."""
        ...

    def close(self) -> None:
        """Release it."""
        ...


def now_us() -> int:
    """Time of this computer, which PX4's client maps to its own [µs]."""
    return time.time_ns() // 1000


class Offboard:
    """Enters, keeps and leaves offboard mode."""

    def __init__(self, link: Px4Link, vehicle: Px4Vehicle, controls: str, system: int) -> None:
        """Control one of `CONTROL` of the PX4 with this system id."""
        self._link, self.vehicle, self._system = link, vehicle, system
        self._controls = {name: name == controls for name in CONTROL}
        self._asked_s = -1e9

    def stream(self) -> None:
        """Send the proof that a controller lives."""
        self._link.send("OffboardControlMode", {"timestamp": now_us(), **self._controls})

    def command(self, number: int, *parameters: float) -> None:
        """Send a command once, and wait for nothing."""
        named = {f"param{k}": float(value) for k, value in enumerate(parameters, 1)}
        whom = {"target_system": self._system, "target_component": 1}
        us = {"source_system": HOST_SYSTEM, "source_component": HOST_COMPONENT, "from_external": True}
        self._link.send("VehicleCommand", {"timestamp": now_us(), "command": number, **named, **whom, **us})

    def ask(self, number: int, *parameters: float) -> None:
        """Send a command now and then, for an effect that is looked for at every tick."""
        now_s = time.monotonic()
        if now_s - self._asked_s >= AGAIN_S:
            self._asked_s = now_s
            self.command(number, *parameters)

    def prove(self) -> None:
        """Stream for as long as PX4 wants to see it before it takes set points."""
        self._until(lambda: False, PROOF_S)

    def reach(self, number: int, *parameters: float, what: str, done: Callable[[], bool]) -> None:
        """Stream, and send a command until the status shows its effect.

        Raises:
            DeviceError: It does not, with PX4's answer.
        """
        self.vehicle.forget(number)
        end_s = time.monotonic() + OBEYS_S
        while not done() and time.monotonic() < end_s:
            self.command(number, *parameters)
            self._until(done, AGAIN_S)
            if self.vehicle.answer(number) in ("denied", "not supported", "failed") and not done():
                break
        if not done():
            why = self.vehicle.answer(number) or "no effect"
            raise DeviceError(
                f"PX4 refuses {what}: {why}; it is in mode {self.vehicle.mode_name}. A ground station shows its checks."
            )

    def enter(self) -> None:
        """Enter offboard mode, and arm; raises DeviceError."""
        vehicle = self.vehicle
        self.reach(SET_MODE, CUSTOM, *OFFBOARD_MODE, what="mode OFFBOARD", done=lambda: vehicle.offboard)
        self.reach(ARM_DISARM, 1.0, what="arming", done=lambda: vehicle.armed and vehicle.offboard)

    def rehearse_loss(self, loss_s: float) -> None:
        """Stop the stream once, armed and with closed thrusters, and see PX4 disarm.

        Raises:
            DeviceError: It does not in time; it is then disarmed by command.
        """
        vehicle, end_s = self.vehicle, time.monotonic() + loss_s + GONE_S
        while vehicle.armed and time.monotonic() < end_s:
            vehicle.wait(STREAM_S)
        if vehicle.armed:
            mode = vehicle.mode_name
            self.command(ARM_DISARM, 0.0)
            raise DeviceError(
                f"PX4 is still armed, in mode {mode}, {loss_s + GONE_S:.1f} s after the stream of offboard mode "
                f"stopped: nothing would close its thrusters. Set COM_OF_LOSS_T {loss_s:g} and COM_OBL_RC_ACT 7 "
                "(disarm). Nothing is armed."
            )

    def _until(self, done: Callable[[], bool], within_s: float) -> None:
        end_s = time.monotonic() + within_s
        while not done() and (left_s := end_s - time.monotonic()) > 0.0:
            self.stream()
            until_s = time.monotonic() + min(STREAM_S, left_s)
            while not done() and (rest_s := until_s - time.monotonic()) > 0.0:
                self.vehicle.wait(rest_s)
