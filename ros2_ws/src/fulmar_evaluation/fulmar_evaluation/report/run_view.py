"""One run prepared for a report: its record, result and colour, its sentences and its table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_bags.run_record import RunRecord
from fulmar_evaluation.report.style import colours
from fulmar_evaluation.run_evaluation import RunResult, evaluate_run
from fulmar_evaluation.run_summary import collision_text, degrees_text, latencies_ms, summarise
from policy_server.controllers import CONTROLLERS

DISPLAY_NAMES = {
    "lqr": "LQR",
    "lqi": "LQI",
    "pd": "PD",
    "mpc": "MPC",
    "mppi": "MPPI",
    "pid": "PID",
    "lqr_drift": "DRIFT's LQR",
    "policy": "policy",
    "classical": "classical law",
    "adaptive": "adaptive law",
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

    @property
    def strives(self) -> bool:
        """Whether the controller meant to meet the goal; one that is not known here counts as such."""
        name = str(self.record.info.get("controller", ""))
        return name not in CONTROLLERS or CONTROLLERS[name].strives


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
    touched = f" It {collision_text(result.touched)}." if result.touched else ""
    if not run.strives:
        return "Moved", "The controller moved the robot to show its parameters; there was no goal to meet."
    if not result.long_enough:
        return "Missed", f"The run ended after {result.duration_s:.1f} s, too early to evaluate.{touched}"
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
    what, place = f"the {result.task.subject}", run.summary["final_position_error_m"]
    turned = _known(run, "final_heading_error_deg", "final_attitude_error_deg")
    parts = [] if place is None else [_length(place)]
    parts += [] if turned is None else [degrees_text(turned)]
    at_end = (
        f"was {' and '.join(parts)} away" if place is not None else f"was {''.join(parts)} off in attitude"
    )
    if result.success:
        return "Reached", (
            f"The goal was reached after {result.figure('time_to_target_s'):.1f} s and held to the end. "
            f"At the end of {result.duration_s:.0f} s {what} {at_end}."
        )
    return "Missed", (
        f"{what.capitalize()} was not within the tolerance for all of the last {result.task.tolerance.hold_s:g} s. "
        f"At the end of {result.duration_s:.0f} s it {at_end}.{touched}"
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
            place = [f"{100 * tolerance.position:g} cm"] if tolerance.position > 0.0 else []
            within = " and ".join([*place, *([f"{angle_deg:g}°"] if angle_deg > 0.0 else [])])
            if not run.strives:
                return ""
            if run.result.progress is not None:
                return "A run counts as done if the goals of its file came to their end and the last one was kept."
            if run.result.counts:
                return (
                    f"A target counts as reached within {within}, and a run that reaches {task.required} of them as a "
                    "success."
                )
            if tolerance.velocity > 0.0:
                rate_deg = tolerance.rate_deg or tolerance.yaw_rate_deg
                return (
                    f"A run counts as kept if the velocity stays within {tolerance.velocity:g} m/s and the turn rate "
                    f"within {rate_deg:g}°/s of the target for all of the last {tolerance.hold_s:g} s."
                )
            return (
                f"A run counts as reached if the {task.subject} stays within {within} of the goal for all of the last "
                f"{tolerance.hold_s:g} s."
            )
    return ""


def _row(runs: Sequence[View], what: str, why: str, cell: Callable[[dict[str, Any]], str]) -> Row:
    return what, why, [cell(run.summary) for run in runs]


def use_row(runs: Sequence[View]) -> Row:
    """How much of its actuators a robot used, for those that have a command of rest."""
    return _row(runs, "Actuators in use", "average share of them", lambda s: _percent(s["actuator_use"]))


def belief_rows(runs: Sequence[View]) -> list[Row]:
    """What was believed of valves or fans, for robots of which that is estimated."""
    return [
        _row(
            runs,
            f"Believed {how}",
            "valves or fans",
            lambda s, key=f"believed_{how}": ", ".join(s[key]) or "none",
        )
        for how in ("dead", "open")
    ]


def table_rows(runs: Sequence[View], own: Sequence[Row]) -> list[Row]:
    """The figures of every run, one row each, without those that no run has; `own` are of the kind of robot."""

    def row(what: str, why: str, cell: Callable[[dict[str, Any]], str]) -> Row:
        return _row(runs, what, why, cell)

    def spread(key: str) -> Callable[[dict[str, Any]], str]:
        def cell(summary: dict[str, Any]) -> str:
            texts = [_value(summary[key][name], "", 2) for name in ("p50", "p99", "max")]
            return " / ".join(texts) if any(text != "–" for text in texts) else "–"

        return cell

    rows = [
        row("Final position error", "", lambda s: _length(s["final_position_error_m"])),
        row("Final heading error", "", lambda s: degrees_text(s["final_heading_error_deg"])),
        row("Final attitude error", "", lambda s: degrees_text(s["final_attitude_error_deg"])),
        row("Time to goal", "from when on it stayed", lambda s: _value(s["time_to_target_s"], " s", 1)),
        row("Targets reached", "", lambda s: _value(s["goals_reached"], "", 0)),
        row("Goals of the file", "", lambda s: s["goals_progress"] or "–"),
        row("Distance from the path", "mean", lambda s: _length(s["path_error_m"])),
        row("Distance from the path", "largest", lambda s: _length(s["path_error_most_m"])),
        row("Pointing error of the camera", "mean", lambda s: degrees_text(s["pointing_error_deg"])),
        row("Distance from the keep-out volume", "least", lambda s: _length(s["least_distance_m"])),
        row("Coverage", "share of the thing's surface seen", lambda s: _percent(s["coverage"])),
        row("Velocity error", "mean", lambda s: _value(s["velocity_error_m_s"], " m/s", 3)),
        row("Turn rate error", "mean", lambda s: _value(s["yaw_rate_error_deg_s"], "°/s", 1)),
        row("Turn rate error", "mean, about all axes", lambda s: _value(s["rate_error_deg_s"], "°/s", 1)),
        row("Length of the run", "simulated time", lambda s: _value(s["duration_s"], " s", 1)),
        *own,
        row("Fuel used", "by the valves' openings", lambda s: _grams(s["fuel_used_kg"])),
        row("Impulse", "of all nozzles", lambda s: _value(s["impulse_N_s"], " N·s", 1)),
        row("Fuel left", "of the full tank, by its gauge", lambda s: _percent(s["fuel_left_share"])),
        row("Commands", "answered measurements", lambda s: f"{s['steps']}"),
        row("Control rate", "in the robot's own time", lambda s: _value(s["control_rate_hz"], " Hz", 2)),
        row("Command rate", "wall-clock", lambda s: _value(s["wall_control_rate_hz"], " Hz", 2)),
        row(
            "Latency [ms]", "measurement sent to command taken: median / p99 / longest", spread("latency_ms")
        ),
        row("Period error [ms]", "median / p99 / largest", spread("period_error_ms")),
        row("Inference [ms]", "median / p99 / longest", spread("inference_ms")),
        row("Overruns", "deadlines missed", lambda s: _value(s["overruns"], "", 0)),
        row("Watchdog trips", "no fresh command", lambda s: _value(s["watchdog_trips"], "", 0)),
    ]
    return [line for line in rows if any(cell != "–" for cell in line[2])]


def _length(metres: float | None) -> str:
    if metres is None:
        return "–"
    if metres >= 1.0:
        return f"{metres:.2f} m"
    return f"{100 * metres:.1f} cm" if metres >= 0.01 else f"{1000 * metres:.1f} mm"


def _grams(kilograms: float | None) -> str:
    return "–" if kilograms is None else f"{1e3 * kilograms:.1f} g"


def _percent(share: float | None) -> str:
    return "–" if share is None else f"{100 * share:.0f} %"


def _value(value: float | None, unit: str, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}{unit}"
