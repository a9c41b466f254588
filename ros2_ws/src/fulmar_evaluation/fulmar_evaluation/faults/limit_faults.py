"""Motion that a robot cannot have, places beyond its area and its geofence, and goals that it must not take."""

from __future__ import annotations

import copy
import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from nav_msgs.msg import Odometry

from fulmar_bags.message_reader import stamp_ns
from fulmar_core.config.errors import RunFailed
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.topics import GOAL_POSE, GOAL_WIRES, SIMULATION_START_NS
from fulmar_core.safety.envelope.braking import floats
from fulmar_core.safety.geofence import is_inside
from fulmar_core.states.rotation import rotate, rotate_inverse
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_at
from fulmar_evaluation.faults.by_kind import FAULTS, TOO_MUCH
from fulmar_evaluation.faults.fault import STAYS_S, WORDS_S, Fault, Outcome, braked, stopped, went_on
from fulmar_evaluation.faults.fault_environment import (
    RELAYED,
    ROOM_M,
    FaultEnvironment,
    goal_of,
    task_of,
)
from fulmar_evaluation.faults.input_faults import changing, intercept
from fulmar_evaluation.faults.live_system import LiveSystem
from fulmar_evaluation.faults.observer import wait_for
from fulmar_ros.goal_messages import TYPES, goal_message
from fulmar_ros.qos import publisher_qos

OF_LIMIT, FASTEST = 0.9, 10.0  # a robot is carried off at so much of its speed limit, at most so fast [m/s]
CARRIED_S = 15.0  # by then it is beyond any geofence
MATCH_S = 10.0


def odometry_too_fast(live: LiveSystem) -> Outcome:
    """Twice the speed that the robot can have."""

    def change(message: Odometry) -> None:
        message.twist.twist.linear.x = TOO_MUCH * live.robot.limits.speed

    return _because(intercept(live, changing(change), live.tick_s), "beyond the possible")


def odometry_turns_too_fast(live: LiveSystem) -> Outcome:
    """A turn rate that the robot cannot have; in space the rate about each axis alone is within the limit."""
    shares, limit = FAULTS[live.robot.kind.name].too_fast, live.robot.limits.yaw_rate

    def change(message: Odometry) -> None:
        for axis, share in shares.items():
            setattr(message.twist.twist.angular, axis, share * limit)

    return _because(intercept(live, changing(change), live.tick_s), "beyond the possible")


def odometry_leaves_the_area(live: LiveSystem) -> Outcome:
    """The robot is carried out of its area, without a jump: along y in the plane, along z in space."""
    area = live.plan.guards.area
    return _because(_carried_off(live, lambda place: not is_inside(place, area)), "outside its area")


def odometry_leaves_the_geofence(live: LiveSystem) -> Outcome:
    """The same, until it is too far from its goal."""
    goal, radius = goal_of(live.robot)[: live.robot.state_type.AXES], live.robot.limits.geofence
    outcome = _carried_off(live, lambda place: math.dist(place, goal) > radius)
    return _because(outcome, "beyond the geofence")


def _carried_off(live: LiveSystem, is_beyond: Callable[[list[float]], bool]) -> Outcome:
    """Odometry reports a motion out of its limits, which pose and twist agree on.

    It is a constant velocity, whatever the robot does.
    """
    axes, beyond_s = live.robot.state_type.AXES, list[float]()
    first: list[Odometry] = []

    def change(message: Odometry) -> None:
        first.append(copy.deepcopy(message))
        del first[1:]
        passed_s = 1e-9 * (stamp_ns(message.header.stamp) - stamp_ns(first[0].header.stamp))
        velocity = _with_drift(live.robot, _velocity_in_world(first[0]), axes - 1)
        place = _place(first[0]) + passed_s * velocity
        position, twist = message.pose.pose.position, message.twist.twist.linear
        position.x, position.y, position.z = place.tolist()
        twist.x, twist.y, twist.z = rotate_inverse(_attitude(message), velocity).tolist()
        if not beyond_s and is_beyond(place.tolist()[:axes]):
            beyond_s.append(time.monotonic())

    live.until_it_moves()
    live.injector.change = changing(change)
    if not wait_for(lambda: bool(beyond_s), CARRIED_S):
        raise RunFailed(f"the robot was not carried beyond its limit within {CARRIED_S:g} s")
    outcome = braked if floats(live.robot) else stopped
    return outcome(live, beyond_s[0], live.tick_s + live.corrected_s)


def _with_drift(robot: Robot, velocity: np.ndarray, axis: int) -> np.ndarray:
    """A velocity in the world that also leads down an axis, as fast as a robot may be [m/s]."""
    left = (OF_LIMIT * robot.limits.speed) ** 2 - float(velocity @ velocity)
    drifting = velocity.copy()
    drifting[axis] -= min(math.sqrt(max(left, 0.0)), FASTEST)
    return drifting


def _place(message: Odometry) -> np.ndarray:
    place = message.pose.pose.position
    return np.array([place.x, place.y, place.z])


def _velocity_in_world(message: Odometry) -> np.ndarray:
    twist = message.twist.twist.linear
    return np.asarray(rotate(_attitude(message), np.array([twist.x, twist.y, twist.z])), dtype=float)


def _attitude(message: Odometry) -> np.ndarray:
    attitude = message.pose.pose.orientation
    return np.array([attitude.x, attitude.y, attitude.z, attitude.w])


def _because(outcome: Outcome, words: str) -> Outcome:
    """Fail where it was stopped for another reason."""
    return replace(outcome, passed=outcome.passed and words in outcome.reaction)


def goal_with_a_wrong_quaternion(live: LiveSystem) -> Outcome:
    """A goal whose quaternion has twice the unit length."""

    def change(message: Any) -> None:
        attitude = message.pose.orientation
        for part in "xyzw":
            setattr(attitude, part, TOO_MUCH * getattr(attitude, part))

    return _offer_goal(live, list(goal_of(live.robot)), change, "quaternion")


def goal_outside_the_area(live: LiveSystem) -> Outcome:
    """A goal beyond the area: along y in the plane, along z in space."""
    axes, place = live.robot.state_type.AXES, list(goal_of(live.robot))
    place[axes - 1] += TOO_MUCH * ROOM_M
    return _offer_goal(live, place, lambda _message: None, "outside the area")


def _offer_goal(live: LiveSystem, numbers: list[float], change: Callable[[Any], None], words: str) -> Outcome:
    """Another node publishes a goal: it is rejected with the reason, and the robot goes on to the one before."""
    task = load_task(live.plan.task, live.plan.thing)
    wire, form = GOAL_WIRES[task.goal_topic], live.robot.state_type
    goal = goal_at(form.target_at(numbers).tolist())
    message = goal_message(goal, wire.name, SIMULATION_START_NS + 1, live.plan.frames, form=form)
    change(message)
    with live.stranger() as node:
        publisher = node.create_publisher(TYPES[wire.name], wire.name, publisher_qos(wire))
        wait_for(lambda: publisher.get_subscription_count() > 0, MATCH_S)
        since_s = live.until_it_moves()
        publisher.publish(message)
        wait_for(lambda: bool(_refusal(live, since_s)), WORDS_S)
        time.sleep(STAYS_S)
    reaction = _refusal(live, since_s)
    return went_on(
        live,
        since_s,
        detected_by="controller" if reaction else "",
        reaction=reaction,
        correct=words in reaction,
    )


def _refusal(live: LiveSystem, since_s: float) -> str:
    """Why the controller refused the newest goal, as it has reported since then; empty if it did not."""
    statuses = [status for status in live.observer.statuses_since(since_s) if status.who == "controller"]
    return next(
        (text for status in reversed(statuses) if (text := status.values.get("goal_refused", ""))), ""
    )


def _without_attitude(robot: Robot) -> str:
    task = task_of(robot)
    if task.goal_topic == GOAL_POSE.name:
        return ""
    return f"its policy does '{task.name}', whose goals have no attitude"


LIMIT_FAULTS = (
    Fault(odometry_too_fast, RELAYED),
    Fault(odometry_turns_too_fast, RELAYED),
    Fault(odometry_leaves_the_area, replace(RELAYED, has_area=True)),
    Fault(odometry_leaves_the_geofence, RELAYED),
    Fault(goal_with_a_wrong_quaternion, why_not=_without_attitude),
    Fault(goal_outside_the_area, FaultEnvironment(has_area=True)),
)
