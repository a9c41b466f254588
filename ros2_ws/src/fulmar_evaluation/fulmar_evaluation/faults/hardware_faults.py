"""Faults of hardware: a late air bearing, a driver that dies or hangs."""

from __future__ import annotations

import math
import signal
import time

from nav_msgs.msg import Odometry
from std_msgs.msg import Bool

from fulmar_core.robots.robot import Robot
from fulmar_core.robots.topics import AIR_BEARING, TRUTH
from fulmar_core.safety.arbiter import BEARING_OFF
from fulmar_core.worlds.scenario import load_scenario
from fulmar_evaluation.faults.fault import Fault, Outcome, killed_and_stopped
from fulmar_evaluation.faults.fault_environment import FaultEnvironment, goal_of
from fulmar_evaluation.faults.live_system import LiveSystem
from fulmar_evaluation.faults.observer import wait_for
from fulmar_evaluation.faults.process_faults import signalled
from fulmar_ros.qos import subscriber_qos
from hardware_drivers.hardware import hardware_of, load_hardware
from hardware_drivers.settings import KingfisherNmea, Kobuki
from sim_nodes.emulators import kingfisher, kobuki

SCENARIO = "bearing_late"
MARGIN_S = 5.0  # a run begins up to so long after everything is ready
APART_S = 0.05  # two messages that were sent one after the other may come so long apart in the other order
REACHED_M, WAY_S = 0.1, 40.0  # from the goal; a way of 6 m takes 15 s


def bearing_late(live: LiveSystem) -> Outcome:
    """Air comes 3 s after the start: no valve opens before it, and the goal is reached afterwards."""
    air: list[tuple[float, bool]] = []
    distance: list[float] = [math.inf]
    goal = goal_of(live.robot)[: live.robot.state_type.AXES]

    def on_air(message: Bool) -> None:
        air.append((time.monotonic(), bool(message.data)))

    def on_truth(message: Odometry) -> None:
        place = message.pose.pose.position
        distance[0] = math.dist((place.x, place.y, place.z)[: len(goal)], goal)

    subscribe, observer = live.bystander.create_subscription, live.observer
    subscribe(Bool, AIR_BEARING.name, on_air, subscriber_qos(AIR_BEARING))
    subscribe(Odometry, TRUTH.name, on_truth, subscriber_qos(TRUTH))
    live.begin()
    moved = wait_for(observer.moves, load_scenario(SCENARIO).bearing_late_s[1] + MARGIN_S)
    off_s = next((received_s for received_s, on in air if not on), None)
    on_s = next((received_s for received_s, on in air if on), math.inf)
    first_s = next((received_s for received_s, moves in observer.applied_since(0.0) if moves), math.inf)
    closed = next((status for status in observer.statuses_since(0.0) if status.text == BEARING_OFF), None)
    if not moved or off_s is None or closed is None:
        return Outcome(
            "", "no valve opened" if not moved else "no node reported that the air bearing is off", False
        )
    if first_s < on_s - APART_S:
        return Outcome(
            closed.who, f"valves opened {on_s - first_s:.2f} s before the air bearing was on", False
        )
    reached = wait_for(lambda: distance[0] < REACHED_M, WAY_S)
    words = (
        f"{closed.text} for {on_s - off_s:.1f} s, and no valve opens; then the goal is "
        f"{'reached' if reached else f'missed by {distance[0]:.2f} m'}"
    )
    return Outcome(closed.who, words, passed=reached)


def _without_bearing(robot: Robot) -> str:
    return "" if robot.air_bearing else f"'{robot.name}' has no air bearing"


# What a device waits for its driver before it stops by itself [s].
OWN_TIMEOUT_S = {Kobuki: kobuki.TIMEOUT_S, KingfisherNmea: kingfisher.TIMEOUT_S}
REPORTS_S = 0.05  # an emulator moves and reports at its own rate


def _driver(live: LiveSystem, number: signal.Signals) -> Outcome:
    """The node that owns the device: the device's own watchdog stops it."""
    own_s = OWN_TIMEOUT_S[type(load_hardware(live.plan.hardware).driver)]
    return signalled(live, "plant", number, own_s + live.tick_s + REPORTS_S)


def _without_watchdog(robot: Robot) -> str:
    files = hardware_of(robot.name)
    if not files:
        return f"there is no driver for '{robot.name}'"
    if load_hardware(files[0]).arms:
        return "its driver arms an autopilot, which only a person does"
    if type(load_hardware(files[0]).driver) not in OWN_TIMEOUT_S:
        return "its device has no watchdog of its own: only hardware can close the valves then"
    return ""


HARDWARE_FAULTS = (
    *killed_and_stopped(
        _driver, "driver_killed", "driver_hangs",
        about=FaultEnvironment(emulated=True), why_not=_without_watchdog,
    ),
    Fault(bearing_late, FaultEnvironment(scenario=SCENARIO), _without_bearing, begins=False),
)  # fmt: skip
