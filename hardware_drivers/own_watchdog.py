"""What stops a device when the driver process is dead, whatever the driver would have done."""

from __future__ import annotations

from dataclasses import dataclass

from hardware_drivers.settings import (
    Driver,
    GpioValves,
    KingfisherNmea,
    Kobuki,
    MavlinkBoat,
    OwnDriver,
    ThrustTopic,
    ValveTopic,
    VelocityTopic,
)

UNPROTECTED = "NOTHING BELOW THE DRIVER STOPS THE"  # how the warning begins, also in hardware files


@dataclass(frozen=True)
class OwnWatchdog:
    """A watchdog below the driver."""

    by: str  # whose it is
    within_s: float  # after the last command or heartbeat [s]


WATCHDOGS: dict[type, OwnWatchdog] = {
    Kobuki: OwnWatchdog("the firmware of the base, without base control", 0.6),
    KingfisherNmea: OwnWatchdog("the front seat of the boat, without $PYDIR", 0.5),
    MavlinkBoat: OwnWatchdog("ArduPilot, without heartbeats: FS_GCS_ENABLE 1, FS_TIMEOUT", 1.5),
    VelocityTopic: OwnWatchdog("kobuki_node, without a velocity; another node may have no timeout", 0.6),
}
# The chip's pins and the lab's node keep the valves as they are; RoboRAN's bridge to /action is not public.
MOVES_ON: dict[type, str] = {
    GpioValves: "VALVES",
    ValveTopic: "VALVES",
    ThrustTopic: "PROPELLERS",
    OwnDriver: "ACTUATORS",
}


def own_watchdog(driver: Driver) -> OwnWatchdog | None:
    """What stops the device when the driver dies; None if nothing is known to."""
    if isinstance(driver, OwnDriver) and driver.device_timeout_s:
        return OwnWatchdog("the device, says its hardware file", driver.device_timeout_s)
    return WATCHDOGS.get(type(driver))


def when_the_driver_dies(driver: Driver) -> str:
    """One sentence for people, in capitals where nothing stops the device."""
    watchdog = own_watchdog(driver)
    if watchdog is not None:
        return f"if the driver dies, stopped within {watchdog.within_s:g} s by {watchdog.by}"
    return (
        f"{UNPROTECTED} {MOVES_ON[type(driver)]} WHEN IT DIES: build in a supply that closes without the driver "
        "(docs/hardware.md)"
    )
