"""An air bearing that does not carry the robot yet when everything else is ready."""

from __future__ import annotations

import math
import time

from nav_msgs.msg import Odometry
from std_msgs.msg import Bool

from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.robot import Robot
from fulmar_core.safety.arbiter import BEARING_OFF
from fulmar_core.topics import AIR_BEARING, TRUTH
from fulmar_evaluation.faults.fault import Fault
from fulmar_evaluation.faults.fault_environment import FAR_M, Surroundings
from fulmar_evaluation.faults.fault_result import Outcome
from fulmar_evaluation.faults.live_system import LiveSystem
from fulmar_evaluation.faults.observer import wait_for
from fulmar_ros.qos import subscriber_qos

SCENARIO = "bearing_late"
MARGIN_S = 5.0  # a run begins up to so long after everything is ready
APART_S = 0.05  # two messages that were sent one after the other may come so long apart in the other order
REACHED_M, WAY_S = 0.1, 40.0  # from the goal; a way of 6 m takes 15 s


def bearing_late(live: LiveSystem) -> Outcome:
    """Air comes 3 s after the start: no valve opens before it, and the goal is reached afterwards."""
    air: list[tuple[float, bool]] = []
    distance: list[float] = [math.inf]

    def on_air(message: Bool) -> None:
        air.append((time.monotonic(), bool(message.data)))

    def on_truth(message: Odometry) -> None:
        place = message.pose.pose.position
        distance[0] = math.hypot(place.x - FAR_M, place.y)

    subscribe, witness = live.bystander.create_subscription, live.witness
    subscribe(Bool, AIR_BEARING.name, on_air, subscriber_qos(AIR_BEARING))
    subscribe(Odometry, TRUTH.name, on_truth, subscriber_qos(TRUTH))
    live.begin()
    moved = wait_for(witness.moves, load_scenario(SCENARIO).bearing_late_s[1] + MARGIN_S)
    off_s = next((heard_s for heard_s, on in air if not on), None)
    on_s = next((heard_s for heard_s, on in air if on), math.inf)
    first_s = next((heard_s for heard_s, moves in witness.applied_since(0.0) if moves), math.inf)
    said = next((word for word in witness.words_since(0.0) if word.text == BEARING_OFF), None)
    if not moved or off_s is None or said is None:
        return Outcome(
            "", "no valve opened" if not moved else "nothing said that the air bearing is off", False
        )
    if first_s < on_s - APART_S:
        return Outcome(said.who, f"valves opened {on_s - first_s:.2f} s before the air bearing was on", False)
    reached = wait_for(lambda: distance[0] < REACHED_M, WAY_S)
    words = (
        f"{said.text} for {on_s - off_s:.1f} s, and no valve opens; then the goal is "
        f"{'reached' if reached else f'missed by {distance[0]:.2f} m'}"
    )
    return Outcome(said.who, words, passed=reached)


def _why_not(robot: Robot) -> str:
    return "" if robot.air_bearing else f"'{robot.name}' has no air bearing"


BEARING_FAULTS = (Fault(bearing_late, Surroundings(scenario=SCENARIO), _why_not, begins=False),)
