"""Driver of a fixed wing behind PX4, by px4_msgs: attitudes or turn rates, and thrust, in offboard mode."""

from __future__ import annotations

import time

import numpy as np

from fulmar_core.config.errors import DeviceError
from fulmar_core.robots.robot import Robot
from hardware_drivers.flight_set_points import FlightSetPoints, SetPoint
from hardware_drivers.px4_driver import Px4Driver
from hardware_drivers.px4_messages import attitude_fields, rate_fields
from hardware_drivers.px4_offboard import (
    CUSTOM,
    HOLD_MODE,
    OFFBOARD_MODE,
    PROOF_S,
    SET_MODE,
    Px4Link,
    now_us,
)
from hardware_drivers.px4_settings import Px4Wing
from hardware_drivers.px4_vehicle import FIXED_WING
from hardware_drivers.takeover import Doing, Takeover

CONTROLS = {"attitude": "attitude", "rates": "body_rate"}  # of OffboardControlMode


class Px4WingDriver(Px4Driver):
    """Takes a wing over in flight with the first command, and gives it back to PX4 where commands end.

    A decision, such as the e-stop, sets Hold at once. After a silence the stream stops, and PX4's own failsafe acts.
    """

    def __init__(self, robot: Robot, settings: Px4Wing, link: Px4Link, *, patience_s: float) -> None:
        """See `Px4Driver`."""
        super().__init__(robot, settings, link, controls=CONTROLS[settings.set_points], patience_s=patience_s)
        self._set_points, self._kind = FlightSetPoints(robot, settings.lead_s), settings.set_points
        self._takeover = Takeover("PX4", "OFFBOARD", proof_s=PROOF_S)

    def begin(self, x: float, y: float, heading: float) -> None:
        """Check that a wing flies; see `DeviceDriver`.

        Raises:
            DeviceError: It is no fixed wing, or not armed.
        """
        if not self._settings.arm:
            return
        if self._vehicle.kind != FIXED_WING:
            raise DeviceError(
                f"PX4 is no fixed wing: its vehicle_type is {self._vehicle.kind}, not {FIXED_WING}."
            )
        if not self._vehicle.armed:
            raise DeviceError(
                "PX4 is not armed, and this driver takes over in flight: take off in a mode of PX4's, then start it."
            )
        self._begun = True

    def write(self, command: np.ndarray) -> np.ndarray | None:
        """Ask for what deflections and throttles would do; sends nothing if it must not take over."""
        if not self._begun:
            return self._safe
        doing = self._takeover.doing(self._end, self._vehicle.offboard, time.monotonic())
        if doing is Doing.HOLD:
            self._offboard.ask(SET_MODE, CUSTOM, *HOLD_MODE)
        if doing in (Doing.HOLD, Doing.REST):
            return self._safe
        self._offboard.stream()
        if doing is Doing.ASK:
            self._offboard.ask(SET_MODE, CUSTOM, *OFFBOARD_MODE)
        elif doing is Doing.FLY:
            assert self._state is not None  # as of the first report
            self._ask_for(self._set_points.of(self._state, command))
        return None

    def refusal(self) -> str:
        """See `Answering`."""
        vehicle, now_s = self._vehicle, time.monotonic()
        if not self._begun:
            return ""
        if vehicle.is_stale(now_s):
            return "PX4 has sent no status for 2.5 s: its mode is not known"
        if not vehicle.armed:
            return "PX4 is not armed: it does not fly"
        mode, answer = vehicle.mode_name, vehicle.answer(SET_MODE)
        return self._takeover.refusal(self._end, vehicle.offboard, now_s, mode=mode, answer=answer)

    def close(self) -> None:
        """Set Hold where the driver has the craft, and release the link; see `DeviceDriver`."""
        try:
            if self._begun and self._vehicle.offboard:
                self._offboard.command(SET_MODE, CUSTOM, *HOLD_MODE)
        finally:
            self._link.close()

    def _ask_for(self, point: SetPoint) -> None:
        thrust = {"timestamp": now_us(), "thrust_body": [point.thrust, 0.0, 0.0]}
        if self._kind == "attitude":
            fields = {"q_d": attitude_fields(point.quat_xyzw), "yaw_sp_move_rate": 0.0}
            self._link.send("VehicleAttitudeSetpoint", thrust | fields)
        else:
            self._link.send("VehicleRatesSetpoint", thrust | rate_fields(point.rates))
