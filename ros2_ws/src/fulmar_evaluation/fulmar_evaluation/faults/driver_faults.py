"""Drivers that die or hang: what the emulated device does then by itself."""

from __future__ import annotations

import signal

from fulmar_core.robot import Robot
from fulmar_evaluation.faults.fault import Fault
from fulmar_evaluation.faults.fault_environment import Surroundings
from fulmar_evaluation.faults.fault_result import Outcome
from fulmar_evaluation.faults.live_system import LiveSystem
from fulmar_evaluation.faults.process_faults import signalled
from hardware_drivers.settings import KingfisherNmea, Kobuki, hardware_of, load_hardware
from sim_nodes.emulators import kingfisher, kobuki

# What a device waits for its driver before it stops by itself [s].
OWN_TIMEOUT_S = {Kobuki: kobuki.TIMEOUT_S, KingfisherNmea: kingfisher.TIMEOUT_S}
REPORTS_S = 0.05  # an emulator moves and is heard at its own beat


def driver_killed(live: LiveSystem) -> Outcome:
    """SIGKILL of the node that owns the device: the device's own watchdog stops it."""
    return _driver(live, signal.SIGKILL)


def driver_hangs(live: LiveSystem) -> Outcome:
    """SIGSTOP of the same."""
    return _driver(live, signal.SIGSTOP)


def _driver(live: LiveSystem, number: signal.Signals) -> Outcome:
    own_s = OWN_TIMEOUT_S[type(load_hardware(live.plan.hardware).driver)]
    return signalled(live, "plant", number, own_s + live.tick_s + REPORTS_S)


def _why_not(robot: Robot) -> str:
    files = hardware_of(robot.name)
    if not files:
        return f"there is no driver for '{robot.name}'"
    if type(load_hardware(files[0]).driver) not in OWN_TIMEOUT_S:
        return "its device has no watchdog of its own: only hardware can close the valves then"
    return ""


DRIVER_FAULTS = tuple(
    Fault(do, Surroundings(emulated=True), _why_not) for do in (driver_killed, driver_hangs)
)
