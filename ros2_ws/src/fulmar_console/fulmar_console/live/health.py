"""What pages show of a robot beside its pose: one JSON object, in words where a person asks why. Knows no ROS."""

from __future__ import annotations

import math
from typing import Any

from fulmar_bringup.system_events import distance_of, mode_of
from fulmar_console.live.places import angle_between, placed
from fulmar_console.live.robot_state import Report, RobotState
from fulmar_core.estimators.actuator_health.supply_check import TANK_EMPTY

POSE = 7  # numbers of one
LEVELS = ("ok", "warn", "silent", "error")  # the worse the later
MOST_TARGETS = 200  # of a path that are sent: more are no different on a page


def health_of(robot: RobotState) -> dict[str, Any]:
    """Everything that is known, without what is not; the keys are in docs/console.md."""
    plant, values, goal = robot.plant, robot.plant.values, goal_of(robot)
    return known(
        {
            "mode": mode_of(plant, robot.controller) if plant.received_s else "starting",
            "level": level_of(robot),
            "words": why(robot),
            "estop": robot.estopped,
            "estop_by": values.get("estop_by") or None,
            "stopped": robot.estopped and not plant.silent,
            "commanded_by": values.get("commanded_by"),
            "operator": (robot.info or {}).get("operator") or None,
            "age_s": round(plant.age_s, 1) if plant.received_s else None,
            "sim_time_s": round(robot.time_s, 1),
            "paused": values["paused"] == "true" if "paused" in values else None,
            "rate": number(values.get("simulation_rate")) or number(values.get("rate")),
            "disturbances": values.get("disturbances"),
            "latency_ms": number(values.get("latency_ms_p99")),
            "plant_mode": values.get("mode"),
            "supply_bar": number(values.get("supply_pressure_bar")),
            "tank": values.get(TANK_EMPTY) or None,
            "failed_parts": values.get("failed_parts") or None,
            "watchdog_trips": _count(values.get("watchdog_trips")),
            "rejected_commands": _count(values.get("rejected_commands")),
            "host": values.get("host"),
            "controller": _controller(robot),
            "envelope": _envelope(robot),
            "goal": goal,
            "obstacles": robot.obstacles or None,
            "things": [{"name": name, "pose": pose} for name, pose in robot.things.items()] or None,
            "nodes": {name: _node(report) for name, report in robot.nodes.items()},
            "last_command": robot.last_command or None,
            "plots": _plots(robot, goal),
        }
    )


def why(robot: RobotState) -> str:
    """The one sentence that says best why the robot does what it does."""
    plant, controller = robot.plant, robot.controller
    if not plant.received_s:
        return "it is being started: nothing has come from its plant yet"
    if plant.silent:
        return f"nothing has come from its plant for {plant.age_s:.0f} s; it was: {plant.message}"
    if plant.level != "ok" or not robot.running or robot.rests:
        return plant.message
    if controller.silent:
        return "no controller runs" if not controller.received_s else "its controller is silent"
    said = controller.values.get("unconverged") or guard_words(robot)
    return said or controller.message or plant.message


def guard_words(robot: RobotState) -> str:
    """Why the envelope guard drives instead of the controller; empty where it does not."""
    event = robot.envelope
    return f"the envelope guard drives: {event.cause}" if event is not None and event.tripped else ""


def _envelope(robot: RobotState) -> dict[str, Any] | None:
    """Trips of the envelope guard; None where there was none."""
    event = robot.envelope
    if event is None:
        return None
    return known(
        {
            "holds": event.tripped,
            "trips": robot.envelope_trips,
            "cause": event.cause or None,
            "room_m": round(event.room, 3) if math.isfinite(event.room) else None,
            "side": event.side or None,
        }
    )


def level_of(robot: RobotState) -> str:
    """`ok`, `warn`, `error` or, where its plant is, `silent`."""
    if robot.plant.silent:
        return "silent"
    levels = [robot.plant.level]
    if not robot.controller.silent:
        levels.append(robot.controller.level)
    return max(levels, key=LEVELS.index)


def _node(report: Report) -> dict[str, Any]:
    return {
        "level": "silent" if report.silent else report.level,
        "words": report.message,
        "age_s": round(report.age_s),
    }


def _controller(robot: RobotState) -> dict[str, Any] | None:
    report, values = robot.controller, robot.controller.values
    if not report.received_s:
        return None
    believed = "; ".join(text for text in (values.get("beliefs"), values.get("unconverged")) if text)
    return known(
        {
            "mode": values.get("mode"),
            "level": "silent" if report.silent else report.level,
            "words": values.get("reason") or guard_words(robot) or report.message,
            "name": values.get("controller"),
            "swap": values.get("swap") or None,
            "fell_back": values.get("fell_back") or None,
            "latency_ms": number(values.get("inference_ms_p99")),
            "rate_hz": number(values.get("control_rate_hz")),
            "overruns": _count(values.get("overruns")),
            "believed": believed or None,
            "believed_dead": values.get("believed_dead") or None,
            "believed_open": values.get("believed_open") or None,
            "keep_out": values.get("keep_out") or None,
        }
    )


def goal_of(robot: RobotState) -> dict[str, Any] | None:
    """The goal that counts, and why the newest one was refused; None without either."""
    values = robot.controller.values
    stamp = _count(values.get("goal_stamp_ns")) or 0
    refused = values.get("goal_refused")
    if not stamp and not refused:
        return None
    targets = robot.goals.get(stamp) if stamp else None
    done = _count(values.get("goals_done")) or 0
    distance = distance_of(values) if values.get("goal_distance_m") else None
    return known(
        {
            "stamp_ns": str(stamp),
            "form": (robot.info or {}).get("goal", {}).get("form"),
            "targets": [list(placed(robot.origin, each)) for each in targets[:MOST_TARGETS]]
            if targets
            else None,
            "done": done,
            "by": values.get("goal_by") or None,
            "distance_m": None if distance is None else round(distance, 3),
            "angle_deg": _angle(robot, targets, done),
            "at_goal": values.get("at_goal") == "true",
            "refused": refused or None,
            "refused_stamp_ns": values.get("goal_refused_stamp_ns") if refused else None,
        }
    )


def _angle(robot: RobotState, targets: list[list[float]] | None, done: int) -> float | None:
    """From its attitude to that of its target, where one counts [deg]."""
    if not targets or not (robot.info or {}).get("goal", {}).get("faces"):
        return None
    target = targets[done % len(targets)]
    return round(angle_between(robot.pose, target), 2) if len(target) == POSE else None


def _plots(robot: RobotState, goal: dict[str, Any] | None) -> dict[str, float | str]:
    """What pages plot over time: distance from the goal, or the angle to it of what only turns, and latency."""
    found = goal or {}
    turns = found.get("form") == "attitude" and "angle_deg" in found
    error = found.get("angle_deg") if turns else found.get("distance_m")
    latency = number(robot.plant.values.get("latency_ms_p99"))
    return known({"error": error, "unit": "deg" if turns else "m", "latency_ms": latency})


def number(text: str | None) -> float | None:
    """A finite number of a status; None where it has none."""
    try:
        found = float(text or "nan")
    except ValueError:
        return None
    return found if math.isfinite(found) else None


def _count(text: str | None) -> int | None:
    return int(text) if text and text.isdecimal() else None


def known(values: dict[str, Any]) -> dict[str, Any]:
    """Without what is None."""
    return {key: value for key, value in values.items() if value is not None}
