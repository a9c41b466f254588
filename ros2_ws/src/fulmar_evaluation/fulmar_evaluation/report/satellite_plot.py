"""What a satellite did: attitude error and turn rates by axis, wheels with their limits, torques, estimated inertia."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from typing import Any, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from fulmar_bags.other_readings import MOMENTS
from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels
from fulmar_core.states.attitude import rotation_error
from fulmar_core.states.spatial import quat_of
from fulmar_evaluation.rate_sources import GYROSCOPE, gyroscope_ended_s, rate_sources
from fulmar_evaluation.report.run_view import View, evaluated
from fulmar_evaluation.report.style import (
    ALARM,
    BODY_AXES,
    CONTROLLER_COLOURS,
    DASHED,
    FAINT,
    INK,
    PARTS,
    READABLE,
    STROKES,
    legend_over,
    quiet_grid,
)
from fulmar_evaluation.run_evaluation import RunResult

ATTITUDE_ROWS = 2
SIGMAS = 1.96  # of a band: 95 %
SMALL_DEG = 0.01  # below it, the scale of errors is linear
SOURCES = {"events": CONTROLLER_COLOURS["lqr"], "wheels": FAINT}  # tints of what replaces the gyroscope
ROOM = 0.3  # of a limit: what stays below it is drawn without the limit, which would flatten it


def draw_attitude(rows: Sequence[Axes] | np.ndarray, runs: Sequence[View]) -> None:
    """Error of the attitude in the first row, turn rates in the second, both about the body's axes."""
    errors, rates = rows
    for stroke, (run, result) in zip(cycle(STROKES), evaluated(runs), strict=False):
        turning = np.rad2deg(run.record.motion.angular_velocity_in_body[result.samples])
        for axes, values in ((errors, attitude_errors_deg(run, result)), (rates, turning)):
            _by_axis(axes, result.time_s, values, stroke, run.label if len(runs) > 1 else "")
    for run, _ in evaluated(runs)[:1]:
        _mark_sources(rates, run)
        _mark_death(errors, run, named=True)
        _mark_death(rates, run, named=False)
    _small_and_large(errors)
    for axes, label in ((errors, "attitude error [°]"), (rates, "turn rate [°/s]")):
        axes.axhline(0.0, color=FAINT, linewidth=0.6, zorder=0)
        axes.set_ylabel(label)
        _over_the_run(axes, runs)
    errors.tick_params(labelbottom=False)


def attitude_errors_deg(run: View, result: RunResult) -> np.ndarray:
    """Rotation from the attitude to the wanted one about the body's axes, shape (n, 3) [deg]."""
    x, y, z, w = run.record.motion.quat_xyzw[result.samples].T
    return np.rad2deg(np.stack(rotation_error((x, y, z, w), quat_of(result.aims)), axis=-1))


def _by_axis(axes: Axes, time_s: np.ndarray, values: np.ndarray, stroke: object, run: str) -> None:
    for axis, colour, column in zip("xyz", BODY_AXES, values.T, strict=True):
        label = f"{run}, about {axis}" if run else f"about {axis}"
        axes.plot(time_s, column, color=colour, linestyle=stroke, linewidth=1.1, label=label)


def _mark_sources(axes: Axes, run: View) -> None:
    """Tint the time in which the turn rate came from something else than the gyroscope, and name it."""
    sources = rate_sources(run.record)
    for source in sources:
        colour = SOURCES.get(source.name)
        if colour is not None and source.name != GYROSCOPE:
            axes.axvspan(source.begin_s, source.end_s, facecolor=colour, alpha=0.12, linewidth=0)
    if len({source.name for source in sources} - {GYROSCOPE}):
        for source in sources:
            axes.text(
                0.5 * (source.begin_s + source.end_s), 0.02, f"from the {source.name}", ha="center", va="bottom",
                transform=axes.get_xaxis_transform(), fontsize=8.5, color=INK,
            )  # fmt: skip


def _mark_death(axes: Axes, run: View, *, named: bool) -> None:
    died_s = gyroscope_ended_s(run.record)
    if died_s is None:
        return
    axes.axvline(died_s, color=ALARM, linewidth=1.1)
    if named:
        axes.text(
            died_s, 1.02, f"gyroscope silent from {died_s:.1f} s", ha="center", va="bottom",
            transform=axes.get_xaxis_transform(), fontsize=8.5, color=ALARM,
        )  # fmt: skip


def _small_and_large(axes: Axes) -> None:
    """A scale that shows errors of degrees and of thousandths of them, with their signs."""
    most = max(SMALL_DEG, float(np.max(np.abs(axes.dataLim.intervaly), initial=0.0)))
    axes.set_yscale("symlog", linthresh=SMALL_DEG)
    step = 2 if most > 30.0 else 1  # decades between two marks, so that each can be read
    decades = [10.0**power for power in range(-2, 3, step) if 10.0**power <= 1.3 * most]
    marks = [*(-value for value in reversed(decades)), 0.0, *decades]
    axes.yaxis.set_major_locator(FixedLocator(marks))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}".replace("-", "−")))
    axes.set_ylim(-1.3 * most, 1.3 * most)


def wheels_of(result: RunResult) -> ReactionWheels:
    """What turns the satellite of a run; only those are drawn here."""
    return cast(ReactionWheels, result.robot.actuators)


def draw_wheels(axes: Axes, runs: Sequence[View]) -> None:
    """Speeds of the wheels on the left, their momentum on the right, and the limit of both."""
    fastest = 0.0
    for stroke, (run, _) in zip(cycle(STROKES), evaluated(runs), strict=False):
        wheels, begin_s = run.record.wheels, float(run.record.motion.stamp_s[0])
        for number, name in enumerate(wheels.names):
            label = name.replace("_", " ") if len(runs) == 1 else f"{run.label}, {name.replace('_', ' ')}"
            look = {"color": PARTS[number % len(PARTS)], "linestyle": stroke, "linewidth": 1.1}
            axes.plot(wheels.stamp_s - begin_s, wheels.values[:, number], label=label, **look)
        fastest = max(fastest, float(np.abs(wheels.values).max(initial=0.0)))
    for _, result in evaluated(runs)[:1]:
        _momentum(axes, wheels_of(result), fastest)
    axes.set_ylabel("wheel speed [rad/s]")
    _over_the_run(axes, runs)


def _momentum(axes: Axes, actuators: ReactionWheels, fastest: float) -> None:
    """The scale of the momentum to the right of that of the speed, and the limit of both."""
    size, unit = (1.0, "N·m·s") if actuators.top_momentum >= 0.1 else (1e3, "mN·m·s")
    words = f"limit ±{actuators.top_speed:.4g} rad/s, ±{size * actuators.top_momentum:.3g} {unit}"
    _limit(axes, fastest, actuators.top_speed, words)
    scale = size * actuators.spin_inertia

    def to_momentum(speed: Any) -> Any:
        return scale * speed

    def to_speed(momentum: Any) -> Any:
        return momentum / scale

    momentum = axes.secondary_yaxis("right", functions=(to_momentum, to_speed))
    momentum.set_ylabel(f"momentum [{unit}]")


def draw_torques(rows: Sequence[Axes] | np.ndarray, run: View) -> None:
    """Torques of the motors in the first row, of the unloading in the second, as applied after all limits."""
    for _, result in evaluated([run]):
        actuators = wheels_of(result)
        torques = 1e3 * result.run.shares[0] * actuators.scale
        groups = [range(actuators.count), range(actuators.count, len(actuators.names))]
        for axes, group, what in zip(rows, groups, ("motor", "unloading"), strict=False):
            if not len(group):
                continue
            for order, number in enumerate(group):
                name = actuators.names[number].replace("_", " ")
                axes.plot(result.time_s, torques[:, number], color=PARTS[order], linewidth=1.0, label=name)
            most = 1e3 * float(actuators.scale[group[0]])
            seen = float(np.nanmax(np.abs(torques[:, list(group)]), initial=0.0))
            _limit(axes, seen, most, f"limit ±{most:g} mN·m")
            axes.set_ylabel(f"{what} [mN·m]")
            legend_over(axes)
            _over_the_run(axes, [run])
        rows[0].set_title(run.label, loc="left", color=INK)
        for axes in rows[:-1]:
            axes.set_xlabel("")
            axes.tick_params(labelbottom=False)


def torque_rows(runs: Sequence[View]) -> int:
    """Rows of `draw_torques` for one run: the second one where a run unloaded its wheels."""
    outside = [result.run.shares[0][:, wheels_of(result).count :] for _, result in evaluated(runs)]
    return 2 if any(np.nan_to_num(each).any() for each in outside) else 1


def draw_inertia(axes: Axes, runs: Sequence[View]) -> None:
    """Estimated moments with the bands in which they lie with 95 %, beside those of the robot's file."""
    for stroke, (run, result) in zip(cycle(STROKES), evaluated(runs), strict=False):
        found, begin_s = run.record.inertia, float(run.record.motion.stamp_s[0])
        for column, name, colour in zip(range(3), MOMENTS, BODY_AXES, strict=False):
            time_s, value, spread = found.stamp_s - begin_s, found.tensor[:, column], found.std[:, column]
            label = f"{run.label}, {name}" if len(runs) > 1 else name
            axes.fill_between(
                time_s, value - SIGMAS * spread, value + SIGMAS * spread, color=colour, alpha=0.2, linewidth=0
            )
            axes.plot(time_s, value, color=colour, linestyle=stroke, linewidth=1.2, label=label)
            axes.axhline(result.robot.body.tensor[column], color=colour, linestyle=DASHED, linewidth=0.9)
    axes.set_ylabel("inertia [kg·m²]")
    _over_the_run(axes, runs)


def _limit(axes: Axes, seen: float, limit: float, words: str) -> None:
    """Write a limit and how much of it was used into a corner, and draw it where values come near it."""
    if seen > ROOM * limit:
        for end in (-limit, limit):
            axes.axhline(end, color=INK, linestyle=DASHED, linewidth=1.0)
        axes.set_ylim(-1.15 * limit, 1.15 * limit)
    share = f"{100.0 * seen / limit:.2g} %" if seen < limit else "all"
    axes.text(
        0.995, 0.97, f"{words}: {share} of it used at most", ha="right", va="top", transform=axes.transAxes,
        fontsize=8.5, color=INK, bbox=READABLE,
    )  # fmt: skip


def _over_the_run(axes: Axes, runs: Sequence[View]) -> None:
    quiet_grid(axes)
    axes.set_xlim(0.0, max((result.duration_s for _, result in evaluated(runs)), default=1.0))
    axes.set_xlabel("time [s]")
