"""The flight of an aircraft: path with its reference, height and side over time, surfaces and energy."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from fulmar_core.robots.actuators.control_surfaces import is_throttle
from fulmar_core.states.attitude import euler_of
from fulmar_core.states.spatial import quat_of
from fulmar_core.tasks.follow_reference import FollowReference
from fulmar_evaluation.report.run_view import Row, View, evaluated
from fulmar_evaluation.report.style import BODY_AXES, DASHED, INK, PARTS, STROKES, legend_over, quiet_grid
from fulmar_evaluation.run_evaluation import RunResult

PATH_ROWS, FLIGHT_ROWS, FLIGHT_MOTION_ROWS = 2, 3, 3
LEAST_SPAN = 0.5  # of an axis of height or side: less is noise [m]
REFERENCE: dict[str, Any] = {"color": INK, "linestyle": DASHED, "linewidth": 0.9, "label": "reference"}


def draw_flight_path(rows: Sequence[Axes] | np.ndarray, runs: Sequence[View]) -> None:
    """Side and height over the way ahead, each at a scale of its own, beside the reference."""
    for axes, up in zip(rows, (1, 2), strict=True):
        for order, (run, result) in enumerate(evaluated(runs)):
            way, aims = run.record.motion.position[result.samples], reference_places(result)
            axes.plot(way[:, 0], way[:, up], color=run.colour, label=run.label)
            if order == 0 and aims is not None:
                axes.plot(way[:, 0], aims[:, up], **REFERENCE)
        _at_least(axes)
        quiet_grid(axes)
        axes.set_ylabel("y [m]" if up == 1 else "z [m]")
    rows[0].set_title("from above (x, y)")
    rows[1].set_title("from the side (x, z)")
    rows[0].tick_params(labelbottom=False)
    rows[-1].set_xlabel("x [m]")


def draw_flight(rows: Sequence[Axes] | np.ndarray, runs: Sequence[View]) -> None:
    """Height, where there is a reference its error, and energy over time, in `flight_rows` rows."""
    height, energy = rows[0], rows[-1]
    for order, (run, result) in enumerate(evaluated(runs)):
        place, aims = run.record.motion.position[result.samples], reference_places(result)
        look = {"color": run.colour, "linewidth": 1.2}
        height.plot(result.time_s, place[:, 2], label=run.label, **look)
        energy.plot(result.time_s, _energy(result), **look)
        if aims is not None:
            rows[1].plot(result.time_s, place[:, 2] - aims[:, 2], **look)
            if order == 0:
                height.plot(result.time_s, aims[:, 2], **REFERENCE)
    _at_least(height)
    labels = ("height [m]", *(["height error [m]"] if len(rows) == FLIGHT_ROWS else []), "full throttle [s]")
    for axes, label in zip(rows, labels, strict=True):
        quiet_grid(axes)
        axes.set_xlim(0.0, max((result.duration_s for _, result in evaluated(runs)), default=1.0))
        axes.set_ylabel(label)
    energy.set_ylim(bottom=0.0)
    for axes in rows[:-1]:
        axes.tick_params(labelbottom=False)
    energy.set_xlabel("time [s]")


def flight_rows(runs: Sequence[View]) -> int:
    """Rows of `draw_flight`."""
    follows = any(reference_places(result) is not None for _, result in evaluated(runs))
    return FLIGHT_ROWS if follows else FLIGHT_ROWS - 1


def draw_flight_motion(rows: Sequence[Axes] | np.ndarray, runs: Sequence[View]) -> None:
    """Speed through the air and over the ground, how it lies in the air, and how it turns, below one another."""
    speed, attitude, rates = rows
    for stroke, (run, result) in zip(cycle(STROKES), evaluated(runs), strict=False):
        motion, air, before = (
            run.record.motion,
            run.record.air_data,
            f"{run.label}, " if len(runs) > 1 else "",
        )
        look = {"color": run.colour, "linewidth": 1.1}
        if "airspeed" in air.names:
            measured = air.values[:, air.names.index("airspeed")]
            time_s = air.stamp_s - float(motion.stamp_s[0])
            speed.plot(time_s, measured, alpha=0.6, label=f"{before}through the air", **look)
        over = {"color": INK if len(runs) == 1 else run.colour, "linewidth": 1.1, "linestyle": DASHED}
        speed.plot(result.time_s, result.run.speed[0], label=f"{before}over the ground", **over)
        x, y, z, w = motion.quat_xyzw[result.samples].T
        roll, pitch, _ = np.rad2deg(np.stack(euler_of((x, y, z, w))))
        if result.task.tolerance.attitude_deg > 0.0:
            wanted, nose, _ = np.rad2deg(np.stack(euler_of(quat_of(result.aims))))
            for values, colour in ((wanted, BODY_AXES[0]), (-nose, BODY_AXES[1])):
                attitude.plot(result.time_s, values, color=colour, linestyle=DASHED, linewidth=0.9)
        turning = np.rad2deg(motion.angular_velocity_in_body[result.samples]).T
        lines = [
            (attitude, roll, "roll, right wing down", BODY_AXES[0]),
            (attitude, -pitch, "pitch, nose up", BODY_AXES[1]),
        ]
        for values, axis, colour in zip(turning, "xyz", BODY_AXES, strict=True):
            lines.append((rates, values, f"about {axis}", colour))
        for axes, values, label, colour in lines:
            axes.plot(
                result.time_s, values, label=before + label, color=colour, linestyle=stroke, linewidth=1.0
            )
    for axes, label in zip(rows, ("speed [m/s]", "attitude [°]", "turn rate [°/s]"), strict=True):
        quiet_grid(axes)
        axes.set_xlim(0.0, max((result.duration_s for _, result in evaluated(runs)), default=1.0))
        axes.set_ylabel(label)
        legend_over(axes)
        axes.tick_params(labelbottom=axes is rates)
    _at_least(speed)
    rates.set_xlabel("time [s]")


def reference_places(result: RunResult) -> np.ndarray | None:
    """Places of the reference over time, between its known places in a straight line, shape (n, 3) [m]; None: none.

    The aim of a time is the place that the reference passed last; places lie `spacing_s` apart. After the last one
    that the run has passed the reference is not known: NaN.
    """
    if not isinstance(result.task, FollowReference):
        return None
    spacing_s = result.task.spacing_s
    time_s = result.run.control_dt * np.arange(len(result.aims))
    passed, first = np.unique(np.floor(time_s / spacing_s + 1e-6), return_index=True)
    known_s = spacing_s * passed
    return np.stack(
        [np.interp(time_s, known_s, result.aims[first, axis], right=np.nan) for axis in range(3)], axis=-1
    )


def _energy(result: RunResult) -> np.ndarray:
    """Mean square of the throttles, added up: seconds at full throttle that would cost as much, shape (n,) [s]."""
    craft = result.robot.actuators
    throttles = result.run.shares[0, :, craft.positions :]
    return np.asarray(np.cumsum(np.mean(throttles**2, axis=-1)) * result.run.control_dt)


def draw_surfaces(rows: Sequence[Axes] | np.ndarray, run: View) -> None:
    """Deflections in the first row and throttles in the second: as measured, else as applied."""
    for _, result in evaluated([run]):
        craft, begin_s = result.robot.actuators, float(run.record.motion.stamp_s[0])
        measured = len(run.record.surfaces) > 0
        if measured:
            names, values = run.record.surfaces.names, run.record.surfaces.positions
            time_s = run.record.surfaces.stamp_s - begin_s
        else:
            names, values = craft.names, result.run.shares[0] * craft.scale
            time_s = result.time_s
        for number, name in enumerate(names):
            turned = not is_throttle(name)
            shown = np.rad2deg(values[:, number]) if turned else values[:, number]
            rows[0 if turned else 1].plot(
                time_s, shown, color=PARTS[number % len(PARTS)], linewidth=0.9, label=name.replace("_", " ")
            )
        for axes in rows:
            axes.set_xlim(0.0, result.duration_s)
        rows[0].set_title(f"{run.label}, {'measured' if measured else 'applied'}", loc="left", color=INK)
    for axes, label in zip(rows, ("deflection [°]", "throttle"), strict=True):
        quiet_grid(axes)
        axes.set_ylabel(label)
        legend_over(axes)
    rows[0].tick_params(labelbottom=False)
    rows[1].set_ylim(0.0, 1.05)
    rows[1].set_xlabel("time [s]")


def flight_table(runs: Sequence[View]) -> list[Row]:
    """Speed and height of flights in figures."""

    def spread(values: np.ndarray, unit: str) -> str:
        if not values.size:
            return "–"
        return f"{values.min():.1f} / {values.mean():.1f} / {values.max():.1f} {unit}"

    def airspeed(run: View) -> str:
        air = run.record.air_data
        return spread(air.values[:, air.names.index("airspeed")], "m/s") if "airspeed" in air.names else "–"

    def height(run: View) -> str:
        return spread(run.record.motion.position[:, 2], "m")

    least = "least / mean / most"
    return [
        ("Airspeed", least, [airspeed(run) for run in runs]),
        ("Height", least, [height(run) for run in runs]),
    ]


def _at_least(axes: Axes) -> None:
    """Let the vertical axis span so much that noise looks like noise."""
    low, high = axes.get_ylim()
    if high - low < LEAST_SPAN:
        middle = 0.5 * (low + high)
        axes.set_ylim(middle - 0.5 * LEAST_SPAN, middle + 0.5 * LEAST_SPAN)
