"""Settings of the drivers of PX4, as read from `driver` of a hardware file."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

from hardware_drivers.driver_facts import DriverFacts, OwnWatchdog
from hardware_drivers.mavlink_address import place_of

MOTORS, SERVOS = 12, 8  # controls of ActuatorMotors and ActuatorServos
PREFIX = re.compile(r"(/[A-Za-z][A-Za-z0-9_]*)*")
ACTIONS = {
    "position": 0,
    "altitude": 1,
    "manual": 2,
    "return": 3,
    "land": 4,
    "hold": 5,
    "terminate": 6,
    "disarm": 7,
}
STOPS_FLYER, STOPS_WING = ("disarm", "terminate"), ("hold", "return")
BY_SILENCE, BY_MAVLINK, BY_HAND = "silence", "mavlink", "set_by_hand"

Action = Literal["return", "hold", "terminate", "disarm"]


@dataclass(frozen=True)
class Px4Failsafe:
    """What PX4 does when the stream of its offboard mode ends, and how the driver confirms it before it arms."""

    action: Action  # COM_OBL_RC_ACT
    # silence: it arms with closed thrusters, stops the stream once, and sees PX4 disarm. mavlink: it sets and reads the
    # parameters at `mavlink`. set_by_hand: a person has set them, and the driver believes it.
    confirm: Literal["silence", "mavlink", "set_by_hand"]
    loss_s: float = 1.0  # COM_OF_LOSS_T [s]
    mavlink: str = ""  # udpin:host:port, udpout:host:port, tcp:host:port, /dev/ttyACM0

    def __post_init__(self) -> None:
        if not 0.2 <= self.loss_s <= 2.0:
            raise ValueError(f"loss_s = {self.loss_s:g} must be from 0.2 to 2 s.")
        if (self.confirm == BY_MAVLINK) != bool(self.mavlink):
            raise ValueError(
                "'confirm: mavlink' needs an address, 'mavlink: udpin:127.0.0.1:14540', and the others none."
            )
        if self.mavlink:
            place_of(self.mavlink)


def _check(topics: str, silent_s: float, system: int) -> None:
    if not PREFIX.fullmatch(topics):
        raise ValueError(
            f"topics = '{topics}' must be empty or a namespace that begins with /, such as /crackle."
        )
    if not 0.05 <= silent_s <= 5.0:
        raise ValueError(f"silent_s = {silent_s:g} must be from 0.05 to 5 s.")
    if not 1 <= system <= 255:
        raise ValueError(f"system = {system} must be from 1 to 255.")


@dataclass(frozen=True)
class Px4Thrusters(DriverFacts):
    """Thrusters of a free flyer behind PX4, by px4_msgs: direct actuators in offboard mode."""

    kind: Literal["px4_thrusters"]
    failsafe: Px4Failsafe
    order: tuple[int, ...]  # which thruster, counted from 0, each motor opens; beyond 12 each servo
    topics: str = ""  # namespace before fmu/in and fmu/out, such as /crackle; empty: none
    system: int = 1  # MAV_SYS_ID of PX4
    silent_s: float = 0.3  # a PX4 without new odometry for so long is gone [s]
    arm: bool = False  # whether the driver enters offboard mode and arms; else it only receives

    fits = ("thrusters",)
    emulator = "px4_thrusters"
    measures = True
    needs_messages = "px4_msgs"
    moves_on = "THRUSTERS"
    arming = "enters PX4's offboard mode, arms it and opens its thrusters"

    def __post_init__(self) -> None:
        _check(self.topics, self.silent_s, self.system)
        if sorted(self.order) != list(range(len(self.order))):
            raise ValueError(f"'order' must hold each of 0 to {len(self.order) - 1} once.")
        if len(self.order) > MOTORS + SERVOS:
            raise ValueError(
                f"PX4 takes {MOTORS} motors and {SERVOS} servos, and 'order' has {len(self.order)} entries."
            )
        if self.failsafe.action not in STOPS_FLYER:
            raise ValueError(
                f"action = {self.failsafe.action} does not close thrusters: {' or '.join(STOPS_FLYER)} does."
            )
        if self.failsafe.confirm == BY_MAVLINK and self.failsafe.action == "terminate":
            return
        if self.failsafe.confirm == BY_SILENCE and self.failsafe.action != "disarm":
            raise ValueError(
                "'confirm: silence' needs 'action: disarm': PX4 does not come back from a termination."
            )

    @property
    def stopped_by(self) -> OwnWatchdog:
        """See `DriverFacts`."""
        return OwnWatchdog(
            "PX4, without the stream of offboard mode: COM_OF_LOSS_T, COM_OBL_RC_ACT", self.failsafe.loss_s
        )


@dataclass(frozen=True)
class Px4Wing(DriverFacts):
    """A fixed wing behind PX4, by px4_msgs: attitudes or turn rates, and thrust; taken over in flight."""

    kind: Literal["px4_wing"]
    failsafe: Px4Failsafe
    set_points: Literal["attitude", "rates"] = "rates"
    lead_s: float = (
        0.2  # so far ahead of the measured state PX4 is asked for the flight of the robot's model [s]
    )
    topics: str = ""  # namespace before fmu/in and fmu/out; empty: none
    system: int = 1  # MAV_SYS_ID of PX4
    silent_s: float = 0.3  # a PX4 without new odometry for so long is gone [s]
    arm: bool = False  # whether the driver takes over in flight; else it only receives

    fits = ("control_surfaces",)
    emulator = "px4_wing"
    measures = True
    needs_messages = "px4_msgs"
    moves_on = "AIRCRAFT"
    arming = "takes the aircraft over in PX4's offboard mode"

    def __post_init__(self) -> None:
        _check(self.topics, self.silent_s, self.system)
        if not 0.02 <= self.lead_s <= 1.0:
            raise ValueError(f"lead_s = {self.lead_s:g} must be from 0.02 to 1 s.")
        if self.failsafe.action not in STOPS_WING:
            raise ValueError(
                f"action = {self.failsafe.action} ends a flight: {' or '.join(STOPS_WING)} goes on with it."
            )
        if self.failsafe.confirm == BY_SILENCE:
            raise ValueError(
                "'confirm: silence' is for thrusters: a wing on the ground shows nothing. Use 'mavlink'."
            )

    @property
    def stopped_by(self) -> OwnWatchdog:
        """See `DriverFacts`."""
        return OwnWatchdog(
            f"PX4, without the stream of offboard mode: COM_OF_LOSS_T, then it flies {self.failsafe.action}",
            self.failsafe.loss_s,
        )


Px4 = Px4Thrusters | Px4Wing
