"""Sensors that die, freeze, drift or creep while a robot moves, and a second source of what it follows."""

from __future__ import annotations

import copy
import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from nav_msgs.msg import Odometry

from fulmar_bags.message_reader import stamp_ns
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.repetition import FEWEST
from fulmar_core.robots.topics import IMU, MOCAP, ODOMETRY
from fulmar_evaluation.faults.by_kind import FAULTS
from fulmar_evaluation.faults.command_faults import DISCOVERY_S
from fulmar_evaluation.faults.endurance import DistanceWatch, complaint, endured
from fulmar_evaluation.faults.fault import Fault, Outcome, stopped, went_on
from fulmar_evaluation.faults.fault_environment import ATTITUDE, RELAYED, FaultEnvironment, Injection, lost
from fulmar_evaluation.faults.input_faults import frozen, intercept
from fulmar_evaluation.faults.live_system import LiveSystem, NothingShown, repeated
from fulmar_evaluation.faults.observer import wait_for
from fulmar_ros.qos import publisher_qos

REPLACED_S = 10.0  # until the estimator has replaced a gyroscope that it lacks
GOES_ON_S = 5.0  # in which it is seen whether the controller goes on
NOISE_S = 1.0  # beyond the watchdog: what repeats of a noisy value, or slow drifts, take to tell
REPEATS = FEWEST + 2  # readings of a slow sensor until it is known to be frozen, the one under way among them
DRIFT_DEG = 0.05  # per second, of a star tracker [deg/s]
SAID_S = 20.0  # until a drift that slow has left the noise of gyroscope and wheels
ASIDE_M = 0.5  # of a second odometry
STRANGER_S = 0.02  # between its messages
FIRST_S = 5.0  # for a message that it repeats


def since_first(change: Callable[[Any, float], None]) -> Injection:
    """Change each message in place by the time since the first of them [s]."""
    first: list[int] = []

    def changed(message: Any) -> Any:
        first.append(stamp_ns(message.header.stamp))
        change(message, (first[-1] - first[0]) / 1e9)
        del first[1:]
        return message

    return changed


def mocap_frozen(live: LiveSystem) -> Outcome:
    """Motion capture has lost the robot and goes on with its last pose, under new stamps."""
    return intercept(live, frozen(), live.watchdog_s + NOISE_S)


def star_tracker_frozen(live: LiveSystem) -> Outcome:
    """The star tracker repeats its last attitude, under new stamps."""
    rate_hz = live.robot.sensors.specs["star_tracker"].rate_hz
    slow_s = REPEATS / rate_hz if rate_hz else 0.0
    return _said(live, frozen(), live.watchdog_s + NOISE_S + slow_s)


def star_tracker_drifts(live: LiveSystem) -> Outcome:
    """The attitude of the star tracker drifts about the body's z axis."""

    def drift(message: Any, passed_s: float) -> None:
        turned_by(message, math.radians(DRIFT_DEG) * passed_s)

    return _said(live, since_first(drift), SAID_S)


def turned_by(message: Any, angle: float) -> None:
    """Turn an attitude about the body's z axis, in place [rad]."""
    q, c, s = message.quaternion, math.cos(0.5 * angle), math.sin(0.5 * angle)
    q.x, q.y, q.z, q.w = c * q.x + s * q.y, c * q.y - s * q.x, c * q.z + s * q.w, c * q.w - s * q.z


def gnss_creeps(live: LiveSystem) -> Outcome:
    """A position from satellites creeps away, along y, while the velocity knows nothing of it."""
    speed = FAULTS[live.robot.kind.name].creep

    def creep(message: Odometry, passed_s: float) -> None:
        message.pose.pose.position.y += speed * passed_s

    return intercept(live, since_first(creep), live.watchdog_s + SAID_S)


def two_odometries(live: LiveSystem) -> Outcome:
    """A second node publishes odometry, half a metre aside: the controller follows neither, and names both."""
    newest: list[Odometry] = []

    def listen(message: Odometry) -> Odometry:
        newest[:] = [copy.deepcopy(message)]
        return message

    live.injector.change = listen
    with live.stranger() as node:
        since_s = live.until_a_move_is_on_record()
        if not wait_for(lambda: bool(newest), FIRST_S):
            raise NothingShown("no odometry came, so a second one would show nothing")
        publisher = node.create_publisher(Odometry, ODOMETRY.name, publisher_qos(ODOMETRY))

        def talk() -> None:
            message = copy.deepcopy(newest[0])
            message.pose.pose.position.y += ASIDE_M
            publisher.publish(message)

        with repeated(talk, STRANGER_S):
            outcome = stopped(live, since_s, DISCOVERY_S + live.watchdog_s + live.corrected_s)
    named = complaint(live, since_s, lambda words: "stranger" in words and "bystander" in words)
    if named is None:
        return replace(outcome, passed=False)
    return replace(outcome, detected_by=named.who, reaction=named.text)


def _said(live: LiveSystem, change: Injection, limit_s: float) -> Outcome:
    """Somebody says it in time; the satellite then stops, or copes by its gyroscope and wheels."""
    distance = DistanceWatch(live)
    live.until_it_moves()
    live.injector.change = change
    since_s = time.monotonic()
    return endured(live, since_s, limit_s, distance)


def gyroscope_dies(live: LiveSystem) -> Outcome:
    """The gyroscope falls silent: the attitude goes on with the turn rate that event cameras see in the stars."""
    since_s = live.until_it_moves()
    wait_for(lambda: _rate_source(live, since_s) == "gyroscope", REPLACED_S)
    live.injector.change = lost
    died_s = time.monotonic()
    replaced = wait_for(lambda: _rate_source(live, died_s) == "events", REPLACED_S)
    time.sleep(GOES_ON_S)
    source = _rate_source(live, died_s) or "nothing"
    return went_on(
        live,
        died_s,
        detected_by="estimator" if replaced else "",
        reaction=f"turn rate from {source}; control goes on",
        correct=replaced and source == "events",
    )


def _rate_source(live: LiveSystem, since_s: float) -> str:
    """What the estimator has last said that its turn rate comes from; empty if nothing since then."""
    statuses = live.observer.statuses_since(since_s)
    return next((each.values["rate_from"] for each in reversed(statuses) if "rate_from" in each.values), "")


def _without_events(robot: Robot) -> str:
    return "" if robot.event_cameras else f"'{robot.name}' has no event camera"


def _without_satellites(robot: Robot) -> str:
    outdoors = robot.kind.outdoors or robot.hydrodynamics is not None
    return "" if outdoors else "no satellite navigation is in its loop"


SENSOR_FAULTS = (
    # With event cameras at work; their scenario kills its own gyroscope later.
    Fault(
        gyroscope_dies, FaultEnvironment(scenario="gyro_dies", intercepted=IMU, nadir=True), _without_events
    ),
    Fault(mocap_frozen, FaultEnvironment(estimated=True, intercepted=MOCAP)),
    Fault(star_tracker_frozen, FaultEnvironment(estimated=True, intercepted=ATTITUDE)),
    Fault(star_tracker_drifts, FaultEnvironment(estimated=True, intercepted=ATTITUDE)),
    Fault(gnss_creeps, RELAYED, _without_satellites),
    Fault(two_odometries, RELAYED),
)
