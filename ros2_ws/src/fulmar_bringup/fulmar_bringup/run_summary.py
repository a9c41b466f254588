"""A recorded run in a few figures, ready for JSON."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fulmar_bringup.run_beliefs import believed_dead, last_beliefs
from fulmar_bringup.run_judgement import Judgement, judge
from fulmar_bringup.run_record import HealthSample, RunRecord
from fulmar_core.safety.estop import HOLDS
from fulmar_core.wire_check import BETWEEN, WIRE_WARNINGS
from policy_server.controllers import EXTERNAL

ASKED = ("robot", "task", "controller", "backend", "seed")
PERCENTILES = ("p50", "p99", "max")
FIGURES = (
    "final_position_error_m",
    "final_heading_error_deg",
    "time_to_target_s",
    "goals_reached",
    "velocity_error_m_s",
    "yaw_rate_error_deg_s",
)  # of `metrics.episode_metrics`; None where the task does not ask
Spread = dict[str, float | None]


def summarise(record: RunRecord) -> dict[str, Any]:
    """Sum up a run.

    Args:
        record: The run.

    Returns:
        Figures by name, ready for JSON; None for what is not known.

    Raises:
        FulmarError: The record names no goal, or no task that is known here.
    """
    judgement = judge(record)
    plant, controller = record.last_health("plant"), record.last_health("controller")
    period_error = _spread(controller, "period_error_ms")
    wall_hz = _number(controller, "control_rate_hz") or _wall_rate_hz(record)
    return {
        **{key: record.info.get(key) for key in ASKED},
        "name": record.info.get("name") or record.info.get("robot"),
        "steps": len(latencies_ms(record)) or _unanswering(record),
        "duration_s": judgement.duration_s if judgement else 0.0,
        "success": judgement is not None and judgement.success,
        **{name: judgement.figure(name) if judgement else None for name in FIGURES},
        "collided": None if judgement is None else bool(judgement.figures["collided"]),
        "path_error_m": judgement.path_error_m if judgement else None,
        "goals_progress": judgement.progress if judgement else None,
        "control_rate_hz": _own_rate_hz(record, wall_hz),
        "wall_control_rate_hz": wall_hz,
        "latency_ms": _known(_spread(plant, "latency_ms")) or percentiles(latencies_ms(record)),
        "period_error_ms": _known(period_error) or _spread(plant, "period_error_ms"),
        "inference_ms": _spread(controller, "inference_ms"),
        "overruns": _total(plant, controller, "overruns"),
        "watchdog_trips": _total(plant, None, "watchdog_trips"),
        "actuator_use": _use(judgement),
        "estop_pressed": estop_pressed(record),
        "warnings": warnings_of(record),
        "believed_dead": believed_dead(record),
        "beliefs": last_beliefs(record),
        "bag": str(record.path),
    }


def estop_pressed(record: RunRecord) -> bool:
    """Whether a press of the e-stop stopped the robot while the plant ran."""
    return any(_stopped_by(sample, f"{HOLDS} pressed") for sample in record.health)


def warnings_of(record: RunRecord) -> list[str]:
    """What a reader of the result should know, each once: a press of the e-stop, and wires that do not fit."""
    found = dict.fromkeys(
        warning
        for sample in record.health
        for warning in sample.values.get(WIRE_WARNINGS, "").split(BETWEEN)
        if warning
    )
    pressed = ["the e-stop was pressed and held the robot until a reset"] if estop_pressed(record) else []
    return [*pressed, *found]


def _stopped_by(sample: HealthSample, reason: str) -> bool:
    running = sample.name.endswith(": plant") and sample.values.get("mode") == "running"
    return running and sample.message.startswith(reason)


def latencies_ms(record: RunRecord) -> np.ndarray:
    """From the sending of an odometry message to the sending of the command that answers it.

    Both times are wall clock, also in lock step and with simulated time: how busy the recorder is does not count. Where
    plant and controller run on two machines, the difference of their clocks does.

    Returns:
        One value for each stamp that was answered [ms].
    """
    odom, commanded = record.odom, record.commanded
    sent: dict[float, float] = {}
    for stamp_s, publish_s in zip(odom.stamp_s, odom.publish_s, strict=True):
        sent.setdefault(stamp_s, publish_s)
    answered: dict[float, float] = {}
    for stamp_s, publish_s in zip(commanded.stamp_s, commanded.publish_s, strict=True):
        if stamp_s in sent:
            answered.setdefault(stamp_s, publish_s)
    return np.array([1e3 * (publish_s - sent[stamp_s]) for stamp_s, publish_s in answered.items()])


def percentiles(values: np.ndarray) -> Spread:
    """Median, 99th percentile and largest of some values; None if there are none."""
    if not values.size:
        return dict.fromkeys(PERCENTILES)
    p50, p99 = np.percentile(values, (50, 99))
    return {"p50": float(p50), "p99": float(p99), "max": float(values.max())}


def _unanswering(record: RunRecord) -> int:
    """Commands of an external controller that stamps none of them as the odometry that it answers."""
    external = record.info.get("controller") == EXTERNAL
    return len(record.commanded) if external and not len(latencies_ms(record)) else 0


def _use(judgement: Judgement | None) -> float | None:
    """Mean share of actuators in use."""
    if judgement is None or np.isnan(judgement.run.shares).any():
        return None
    return _finite(np.mean(judgement.run.actuators_in_use))


def _own_rate_hz(record: RunRecord, wall_hz: float | None) -> float | None:
    """Commands a second of the robot's own time, which in lock step goes by commands."""
    if record.info.get("lockstep"):
        asked = record.info.get("control_hz")
        return float(asked) if asked else None
    return wall_hz / float(record.info.get("rate") or 1.0) if wall_hz else None


def _wall_rate_hz(record: RunRecord) -> float | None:
    """Answers a second of wall-clock time, from when the first of each was recorded; of none, commands."""
    stamps, first = np.unique(record.commanded.stamp_s, return_index=True)
    times = np.unique(record.commanded.log_s[first[np.isin(stamps, record.odom.stamp_s)]])
    if _unanswering(record):
        times = np.unique(record.commanded.log_s)
    return float((len(times) - 1) / (times[-1] - times[0])) if len(times) > 1 else None


def _spread(sample: HealthSample | None, name: str) -> Spread:
    return {key: _number(sample, f"{name}_{key}") for key in PERCENTILES}


def _known(spread: Spread) -> Spread | None:
    return spread if any(value is not None for value in spread.values()) else None


def _total(first: HealthSample | None, second: HealthSample | None, name: str) -> int | None:
    numbers = [_number(first, name), _number(second, name)]
    known = [number for number in numbers if number is not None]
    return round(sum(known)) if known else None


def _number(sample: HealthSample | None, name: str) -> float | None:
    try:
        return _finite(float(sample.values[name])) if sample else None
    except (KeyError, ValueError):
        return None


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
