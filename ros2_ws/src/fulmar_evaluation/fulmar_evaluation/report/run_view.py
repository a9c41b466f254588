"""One run prepared for a report: its record, result and colour, its sentences and its table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_bags.run_record import RunRecord
from fulmar_evaluation.report.style import colours
from fulmar_evaluation.run_evaluation import RunResult, evaluate_run
from fulmar_evaluation.run_summary import latencies_ms, summarise

DISPLAY_NAMES = {
    "lqr": "LQR",
    "pd": "PD",
    "mpc": "MPC",
    "mppi": "MPPI",
    "pid": "PID",
    "lqr_drift": "DRIFT's LQR",
    "policy": "policy",
    "classical": "classical law",
    "excite": "excitation",
    "external": "external controller",
}


Row = tuple[str, str, list[str]]  # quantity, explanation, and the cell of each run


@dataclass(frozen=True)
class View:
    """Everything that a plot or a sentence about one run needs."""

    label: str
    colour: str
    record: RunRecord
    result: RunResult | None  # None: the record is too short to evaluate
    summary: dict[str, Any]
    latencies_ms: np.ndarray

    @property
    def binary(self) -> bool:
        """Whether the actuators are valves, open or closed."""
        return self.result is None or self.result.robot.actuators.binary


def views(records: Sequence[RunRecord]) -> list[View]:
    """Prepare runs for one report.

    Raises:
        FulmarError: A record names no task or goal.
    """
    controllers = [str(record.info.get("controller", "unknown")) for record in records]
    labels = [DISPLAY_NAMES.get(name, name) for name in controllers]
    if len(set(labels)) < len(labels):  # the bag's name separates runs of one controller
        labels = [f"{label} ({record.path.name})" for label, record in zip(labels, records, strict=True)]
    return [
        View(label, colour, record, evaluate_run(record), summarise(record), latencies_ms(record))
        for label, colour, record in zip(labels, colours(controllers), records, strict=True)
    ]


def evaluated(runs: Sequence[View]) -> list[tuple[View, RunResult]]:
    """Those runs that have a result, with it."""
    return [(run, run.result) for run in runs if run.result is not None]


def result_of(run: View) -> tuple[str, str]:
    """One word and one or two sentences on how a run went."""
    result = run.result
    if result is None:
        return "No result", "The bag holds fewer than two states, so there is nothing to evaluate."
    if not result.long_enough:
        return "Missed", f"The run ended after {result.duration_s:.1f} s, too early to evaluate."
    touched = " It touched an obstacle." if result.figures["collided"] else ""
    if result.progress is not None:
        path = run.summary["path_error_m"]
        way = "" if path is None else f" On average the robot was {_length(path)} from the path."
        end = "there it stayed to the end" if result.success else "it was not where it should be at the end"
        return ("Done" if result.success else "Missed"), (
            f"Of the goal file: {result.progress} in {result.duration_s:.0f} s; {end}.{way}{touched}"
        )
    if result.counts:
        reached, required = run.summary["goals_reached"] or 0, result.task.required
        word = "Reached" if result.success else "Missed"
        return word, (
            f"The robot reached {reached:.0f} targets in {result.duration_s:.0f} s; "
            f"{required} make a success.{touched}"
        )
    if run.summary["velocity_error_m_s"] is not None:
        return ("Kept" if result.success else "Missed"), (
            f"Over {result.duration_s:.0f} s the velocity was {run.summary['velocity_error_m_s']:.3f} m/s off "
            f"and the turn rate {_known(run, 'yaw_rate_error_deg_s', 'rate_error_deg_s'):.1f}°/s, on average, "
            "changes of the target included."
        )
    what, error = f"the {result.task.subject}", _length(run.summary["final_position_error_m"])
    turned = _known(run, "final_heading_error_deg", "final_attitude_error_deg")
    if turned is not None:
        error += f" and {_value(turned, '°', 1)}"
    if result.success:
        return "Reached", (
            f"The goal was reached after {result.figure('time_to_target_s'):.1f} s and held to the end. "
            f"At the end of {result.duration_s:.0f} s {what} was {error} away."
        )
    return "Missed", (
        f"{what.capitalize()} was not within the tolerance for all of the last {result.task.tolerance.hold_s:g} s. "
        f"At the end of {result.duration_s:.0f} s it was {error} away.{touched}"
    )


def _known(run: View, *names: str) -> float | None:
    """The first of some figures that there is: one of the plane, or its like in space."""
    return next((run.summary[name] for name in names if run.summary[name] is not None), None)


def rule(runs: Sequence[View]) -> str:
    """What counts as success, for the first run that has a result."""
    for run in runs:
        if run.result is not None:
            task, tolerance = run.result.task, run.result.task.tolerance
            angle_deg = tolerance.attitude_deg or tolerance.heading_deg
            heading = f" and {angle_deg:g}°" if angle_deg > 0.0 else ""
            if run.result.progress is not None:
                return "A run counts as done if the goals of its file came to their end and the last one was kept."
            if run.result.counts:
                return (
                    f"A target counts as reached within {100 * tolerance.position:g} cm{heading}, and a run that "
                    f"reaches {task.required} of them as a success."
                )
            if tolerance.velocity > 0.0:
                rate_deg = tolerance.rate_deg or tolerance.yaw_rate_deg
                return (
                    f"A run counts as kept if the velocity stays within {tolerance.velocity:g} m/s and the turn rate "
                    f"within {rate_deg:g}°/s of the target for all of the last {tolerance.hold_s:g} s."
                )
            return (
                f"A run counts as reached if the {task.subject} stays within {100 * tolerance.position:g} cm"
                f"{heading} of the goal for all of the last {tolerance.hold_s:g} s."
            )
    return ""


def table_rows(runs: Sequence[View]) -> list[Row]:
    """The figures of every run, one row each."""

    def row(what: str, why: str, cell: Callable[[dict[str, Any]], str]) -> Row:
        return what, why, [cell(run.summary) for run in runs]

    def spread(key: str) -> Callable[[dict[str, Any]], str]:
        return lambda s: " / ".join(_value(s[key][name], "", 2) for name in ("p50", "p99", "max"))

    asked = [
        row("Final position error", "", lambda s: _length(s["final_position_error_m"])),
        row("Final heading error", "", lambda s: _value(s["final_heading_error_deg"], "°", 1)),
        row("Final attitude error", "", lambda s: _value(s["final_attitude_error_deg"], "°", 1)),
        row("Time to goal", "from when on it stayed", lambda s: _value(s["time_to_target_s"], " s", 1)),
        row("Targets reached", "", lambda s: _value(s["goals_reached"], "", 0)),
        row("Goals of the file", "", lambda s: s["goals_progress"] or "–"),
        row("Distance from the path", "mean", lambda s: _length(s["path_error_m"])),
        row("Velocity error", "mean", lambda s: _value(s["velocity_error_m_s"], " m/s", 3)),
        row("Turn rate error", "mean", lambda s: _value(s["yaw_rate_error_deg_s"], "°/s", 1)),
        row("Turn rate error", "mean, about all axes", lambda s: _value(s["rate_error_deg_s"], "°/s", 1)),
    ]
    return [
        *(line for line in asked if any(cell != "–" for cell in line[2])),
        row("Length of the run", "simulated time", lambda s: _value(s["duration_s"], " s", 1)),
        row("Actuators in use", "average share of them", lambda s: _percent(s["actuator_use"])),
        row("Commands", "answered measurements", lambda s: f"{s['steps']}"),
        row("Control rate", "in the robot's own time", lambda s: _value(s["control_rate_hz"], " Hz", 2)),
        row("Command rate", "wall-clock", lambda s: _value(s["wall_control_rate_hz"], " Hz", 2)),
        row("Latency [ms]", "median / p99 / longest", spread("latency_ms")),
        row("Period error [ms]", "median / p99 / largest", spread("period_error_ms")),
        row("Inference [ms]", "median / p99 / longest", spread("inference_ms")),
        row("Overruns", "deadlines missed", lambda s: _value(s["overruns"], "", 0)),
        row("Believed dead", "valves or fans", lambda s: ", ".join(s["believed_dead"]) or "none"),
        row("Believed open", "valves or fans", lambda s: ", ".join(s["believed_open"]) or "none"),
        row("Watchdog trips", "no fresh command", lambda s: _value(s["watchdog_trips"], "", 0)),
    ]


def _length(metres: float | None) -> str:
    return "–" if metres is None else f"{metres:.2f} m" if metres >= 1.0 else f"{100 * metres:.1f} cm"


def _percent(share: float | None) -> str:
    return "–" if share is None else f"{100 * share:.0f} %"


def _value(value: float | None, unit: str, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}{unit}"
