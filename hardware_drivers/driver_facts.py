"""What is known of the devices of a driver, whatever a hardware file says of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class OwnWatchdog:
    """A watchdog below the driver."""

    by: str  # whose it is
    within_s: float  # after the last command or heartbeat [s]


class DriverFacts:
    """What is known of the devices of a driver, whatever their file says.

    Attributes:
        fits: Families of actuators that it can move.
        needs: Modules of the extra `hardware` that it imports.
        needs_messages: Package of ROS messages that `fulmar install-...` builds; empty: none.
        moves_on: What moves on where nothing stops the device, in capitals.
        emulator: Device of `sim_nodes.emulator_node` that stands in for theirs; empty: none does.
        arming: What the driver does where it may arm, in words.
        instead: What a user does about that; empty: builds in a supply that closes without the driver.
    """

    fits: ClassVar[tuple[str, ...]] = ()
    needs: ClassVar[tuple[str, ...]] = ()
    needs_messages: ClassVar[str] = ""
    moves_on: ClassVar[str] = "ACTUATORS"
    emulator: ClassVar[str] = ""
    instead: ClassVar[str] = ""
    arming: ClassVar[str] = "arms the device"

    @property
    def made_by(self) -> str:
        """Module and class of the driver that talks to the device; empty: the driver node publishes messages."""
        return ""

    @property
    def measures(self) -> bool:
        """Whether the device measures odometry; if not, motion capture or another node does."""
        return False

    @property
    def seen_from_outside(self) -> bool:
        """Whether only motion capture localises the robot."""
        return False

    @property
    def has_bearing(self) -> bool:
        """Whether the driver switches an air bearing, without which nothing may move."""
        return False

    @property
    def stopped_by(self) -> OwnWatchdog | None:
        """The watchdog that stops the device when the driver dies; None if none is known."""
        return None
