"""Settings of the driver of a fixed wing with ArduPilot, as read from `driver` of a hardware file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from hardware_drivers.driver_facts import DriverFacts, OwnWatchdog
from hardware_drivers.mavlink_address import place_of

ACTIONS = {"return": 1, "glide": 2, "autoland": 5}  # of FS_LONG_ACTN


@dataclass(frozen=True)
class MavlinkPlane(DriverFacts):
    """A fixed wing with ArduPlane, by MAVLink: roll, pitch and thrust in GUIDED mode, taken over in flight."""

    kind: Literal["mavlink_plane"]
    port: str  # udpin:host:port (listens there), udpout:host:port, tcp:host:port, /dev/ttyACM0
    action: Literal["return", "glide", "autoland"] = "return"  # FS_LONG_ACTN, without our heartbeats
    loss_s: float = 2.0  # FS_LONG_TIMEOUT [s]
    lead_s: float = (
        0.5  # so far ahead of the measured state it is asked for the flight of the robot's model [s]
    )
    baud: int = 115200
    rc_failsafe: bool = True  # whether THR_FAILSAFE must be on; false for a craft without a transmitter
    silent_s: float = 0.5  # an autopilot without a new position for so long is gone [s]
    arm: bool = (
        False  # whether the driver sets failsafe and GUIDED and takes over in flight; else it only receives
    )
    signing_key: str = ""  # file with the key of MAVLink 2's signatures; empty: nothing is signed

    fits = ("control_surfaces",)
    emulator = "arduplane"
    made_by = "hardware_drivers.plane_driver:PlaneDriver"
    needs = ("pymavlink",)
    measures = True
    moves_on = "AIRCRAFT"
    arming = "sets the parameters of its failsafe, and takes the aircraft over in GUIDED"

    def __post_init__(self) -> None:
        place_of(self.port)
        if self.signing_key and not self.signing_key.startswith(("/", "~/")):
            raise ValueError(f"signing_key = '{self.signing_key}' must be a whole path, from / or ~/.")
        if not 1.0 <= self.loss_s <= 10.0:
            raise ValueError(f"loss_s = {self.loss_s:g} must be from 1 to 10 s, as ArduPlane takes it.")
        if not 0.02 <= self.lead_s <= 1.0:
            raise ValueError(f"lead_s = {self.lead_s:g} must be from 0.02 to 1 s.")
        if not 0.05 <= self.silent_s <= 5.0:
            raise ValueError(f"silent_s = {self.silent_s:g} must be from 0.05 to 5 s.")

    @property
    def stopped_by(self) -> OwnWatchdog:
        """See `DriverFacts`."""
        by = f"ArduPlane, without heartbeats: FS_GCS_ENABL 1, FS_LONG_TIMEOUT, then {self.action}"
        return OwnWatchdog(by, self.loss_s)
