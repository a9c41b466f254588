"""A recorded run in a few figures, ready for JSON."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from fulmar_bags.run_record import HealthSample, RunRecord
from fulmar_core.estimators.actuator_health.supply_check import TANK_EMPTY
from fulmar_core.robots.wire_check import BETWEEN, WARNINGS, WIRE_WARNINGS
from fulmar_core.safety.command_range import CommandRange
from fulmar_core.safety.estop import HOLDS
from fulmar_evaluation.guard_figures import guard_figures, guard_text
from fulmar_evaluation.run_evaluation import KEEP_OUT_OF, RunResult, evaluate_run
from policy_server.controllers import EXTERNAL, controller_entry

ASKED = ("robot", "task", "controller", "backend", "seed")
PERCENTILES = ("p50", "p99", "max")
FIGURES = (
    "final_position_error_m",
    "final_heading_error_deg",
    "final_attitude_error_deg",
    "time_to_target_s",
    "goals_reached",
    "velocity_error_m_s",
    "yaw_rate_error_deg_s",
    "rate_error_deg_s",
    "impulse_N_s",
    "fuel_used_kg",
)  # of `metrics.episode_metrics`; None where the task does not ask
BESIDE = (
    "path_error_most_m",
    "pointing_error_deg",
    "least_distance_m",
    "coverage",
    "coverage_possible",
    "drift_enters_s",
)
Spread = dict[str, float | None]


def summarise(record: RunRecord) -> dict[str, Any]:
    """Sum up a run.

    Returns:
        Figures by name, ready for JSON; None for what is not known.

    Raises:
        FulmarError: The record names no goal, or no task that is known here.
    """
    result = evaluate_run(record)
    plant, controller = record.last_health("plant"), record.last_health("controller")
    period_error = _spread(controller, "period_error_ms")
    wall_hz = _number(controller, "control_rate_hz") or _wall_rate_hz(record)
    return {
        **{key: record.info.get(key) for key in ASKED},
        "name": record.info.get("name") or record.info.get("robot"),
        "steps": len(latencies_ms(record)) or _unanswering(record),
        "duration_s": result.duration_s if result else 0.0,
        "success": result is not None and result.success,
        **{name: result.figure(name) if result else None for name in FIGURES},
        "collided": None if result is None else bool(result.figures["collided"]),
        "touched": (result.touched or None) if result else None,
        **{name: result.figure(name) if result else None for name in BESIDE},
        "path_error_m": result.path_error_m if result else None,
        **_tracking(result),
        "goals_progress": result.progress if result else None,
        "fuel_left_share": _fuel_left(record),
        "tank_empty": tank_empty(record) or None,
        "control_rate_hz": _own_rate_hz(record, wall_hz),
        "wall_control_rate_hz": wall_hz,
        "latency_ms": _known(_spread(plant, "latency_ms")) or percentiles(latencies_ms(record)),
        "period_error_ms": _known(period_error) or _spread(plant, "period_error_ms"),
        "inference_ms": _spread(controller, "inference_ms"),
        "overruns": _total(plant, controller, "overruns"),
        "watchdog_trips": _total(plant, None, "watchdog_trips"),
        "actuator_use": _use(result),
        "guard": guard_figures(record, result.robot if result else None),
        "estop_pressed": estop_pressed(record),
        "warnings": [*warnings_of(record), *_beyond_limits(record, result)],
        "believed_dead": believed(record, "believed_dead"),
        "believed_open": believed(record, "believed_open"),
        "beliefs": last_beliefs(record),
        "bag": str(record.path),
    }


def estop_pressed(record: RunRecord) -> bool:
    """Whether a press of the e-stop stopped the robot while the plant ran."""
    return any(_stopped_by(sample, f"{HOLDS} pressed") for sample in record.health)


def warnings_of(record: RunRecord) -> list[str]:
    """What a reader of the result should know, each once: a press of the e-stop, and the warnings of every node."""
    found = dict.fromkeys(
        warning
        for sample in record.health
        for key in (WIRE_WARNINGS, WARNINGS)
        for warning in sample.values.get(key, "").split(BETWEEN)
        if warning
    )
    pressed = ["the e-stop was pressed and held the robot until a reset"] if estop_pressed(record) else []
    empty = tank_empty(record)
    return [*pressed, *([empty] if empty else []), *found]


def tank_empty(record: RunRecord) -> str:
    """What the plant said when its tank was empty; empty if it did not."""
    said = (sample.values.get(TANK_EMPTY, "") for sample in record.health if sample.name.endswith(": plant"))
    return next(filter(None, said), "")


def _fuel_left(record: RunRecord) -> float | None:
    """Share of the full tank by the newest reading."""
    found = record.fuel
    return _finite(found.values[-1, found.names.index("share")]) if "share" in found.names else None


def _beyond_limits(record: RunRecord, result: RunResult | None) -> list[str]:
    """That a controller of the user's own mostly asked for more than the actuators can do."""
    if result is None or not len(record.actions):
        return []
    seen = CommandRange(result.robot.actuators)
    seen.see(record.actions.values)
    return [seen.warning] if seen.warning else []


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


def _use(result: RunResult | None) -> float | None:
    """Mean share of actuators in use."""
    if result is None or np.isnan(result.run.shares).any():
        return None
    return _finite(np.mean(result.run.actuators_in_use))


def _tracking(result: RunResult | None) -> dict[str, float | None]:
    """Mean errors from a target that moves."""
    place, angle = (None, None) if result is None else result.tracking_error
    return {"tracking_error_m": place, "tracking_error_deg": None if angle is None else math.degrees(angle)}


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


STANDS_S = 1.0  # a belief that went sooner, and before the end, is none that a run is remembered for [s]


def believed(record: RunRecord, key: str) -> list[str]:
    """Valves or fans that `controller/status` named, for a while or at the end of the run.

    Args:
        record: The run.
        key: What is believed of them: `believed_dead` or `believed_open`.

    Returns:
        Their names, in the order in which they were first named.
    """
    said = [sample for sample in record.health if key in sample.values]
    ends = [sample.log_s for sample in said[1:]] + [math.inf]
    lasted: dict[str, float] = {}
    for sample, end_s in zip(said, ends, strict=False):  # of none at all there is an end, too
        length = end_s - sample.log_s
        for name in filter(None, sample.values[key].split(", ")):
            lasted[name] = lasted.get(name, 0.0) + length
    return [name for name, length in lasted.items() if length >= STANDS_S]


def last_beliefs(record: RunRecord) -> str:
    """What the newest `controller/status` says is believed of valves and push; empty if nothing is wrong."""
    status = record.last_health("controller")
    return status.values.get("beliefs", "") if status else ""


FINEST_DEG = 0.001  # finer differences of attitudes are not said


def degrees_text(value: float | None) -> str:
    """An angle for people, with as many digits as small ones need [deg]."""
    if value is None:
        return "–"
    if value < FINEST_DEG:
        return f"below {FINEST_DEG:g}°"
    return f"{value:.1f}°" if value >= 0.95 else f"{value:.2f}°" if value >= 0.095 else f"{value:.3f}°"


FIGURE_TEXTS: dict[str, Callable[[Any], str]] = {
    "final_position_error_m": "{:.3f} m off".format,
    "final_heading_error_deg": lambda value: f"{degrees_text(value)} off",
    "final_attitude_error_deg": lambda value: f"attitude {degrees_text(value)} off",
    "goals_reached": "{:.0f} targets reached".format,
    "velocity_error_m_s": "velocity {:.3f} m/s off".format,
    "yaw_rate_error_deg_s": "turn rate {:.1f}°/s off".format,
    "rate_error_deg_s": "turn rate {:.1f}°/s off".format,
    "path_error_m": "path {:.3f} m off".format,
    "path_error_most_m": "at most {:.3f} m".format,
    "pointing_error_deg": lambda value: f"camera {degrees_text(value)} off",
    "least_distance_m": "{:.2f} m from the keep-out volume at least".format,
    "coverage": "{:.0%} of the surface seen".format,
    "coverage_possible": "{:.0%} could be from there".format,
    "drift_enters_s": "adrift from the end on, it enters that volume after {:.0f} s".format,
    "tracking_error_m": "moving target {:.3f} m off".format,
    "tracking_error_deg": "its attitude {:.1f}° off".format,
    "goals_progress": str,
    "fuel_used_kg": lambda value: f"{1e3 * value:.0f} g of fuel used",
}


def collision_text(touched: str) -> str:
    """What a robot touched or entered, with the verb for it."""
    return f"{'entered' if touched.startswith(KEEP_OUT_OF) else 'touched'} {touched}"


def summary_text(summary: dict[str, Any]) -> str:
    """A summary in a few lines for people."""
    if summary["success"] is None:
        return f"{summary['controller']}: no fault, so the recorder wrote no bag; no result for the goal"
    if controller_entry(summary["controller"]).strives:
        result = "goal met" if summary["success"] else "goal missed"
        if summary["success"] and summary["time_to_target_s"] is not None:
            result += f" after {summary['time_to_target_s']:.1f} s"
    else:
        result = "moved without a goal"
    known = [text(summary[key]) for key, text in FIGURE_TEXTS.items() if summary[key] is not None]
    known += [collision_text(summary["touched"])] if summary["touched"] else []
    length = f"; length of the run {summary['duration_s']:.0f} s"
    lines = [f"{summary['controller']}: {', '.join([result, *known])}{length}"]
    if summary["steps"]:
        latency = summary["latency_ms"]
        answers = latency["p50"] is not None
        spread = f", latency p50 {latency['p50']:.2f} ms, p99 {latency['p99']:.2f} ms" if answers else ""
        counts = [(summary[key], key) for key in ("overruns", "watchdog_trips")]
        counted = ", ".join(f"{count} {key.replace('_', ' ')}" for count, key in counts if count is not None)
        lines.append(f"  {summary['steps']} commands{spread}" + (f"; {counted}" if counted else ""))
    lines += guard_text(summary["guard"])
    lines += [f"  warning: {warning}" for warning in summary["warnings"]]
    for key in ("believed_dead", "believed_open"):
        if summary[key]:
            lines.append(f"  {key.replace('_', ' ')}: {', '.join(summary[key])}")
    if summary["beliefs"]:
        lines.append(f"  at the end: {summary['beliefs']}")
    bag = summary["bag"]
    lines.append(
        "  nothing was recorded" if bag is None else f"  recorded in {bag}; view it: fulmar report {bag}"
    )
    return "\n".join(lines)
