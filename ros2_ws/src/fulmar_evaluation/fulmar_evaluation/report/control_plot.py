"""Applied actuator commands, watchdog stops, effort over time, and latencies of a run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from fulmar_bags.run_record import RunRecord
from fulmar_evaluation.report.run_view import View, evaluated
from fulmar_evaluation.report.style import ALARM, DASHED, FAINT, INK, quiet_grid
from fulmar_evaluation.run_evaluation import RunResult
from fulmar_evaluation.run_summary import percentiles

BINS = 48  # of latencies
SHORTEST_MS = 0.01
ROW = 0.165  # least height of an actuator's row [inch]

Span = tuple[float, float]  # begin and end, in simulated time since the first state [s]


def open_spans(record: RunRecord, actuator: int) -> list[Span]:
    """When one actuator was in use."""
    return _spans(record, record.actuation.effort[:, actuator] != 0.0)


def watchdog_spans(record: RunRecord) -> list[Span]:
    """When everything was shut although the newest command said otherwise and had grown old."""
    applied, commanded = record.applied, record.commanded
    if not len(applied) or not len(commanded) or record.info.get("lockstep"):
        return []
    newest = np.searchsorted(commanded.log_s, applied.log_s, side="right") - 1
    hz = float(record.info.get("control_hz") or 1.0) * float(record.info.get("rate") or 1.0)
    age_s = applied.log_s - commanded.log_s[newest.clip(0)]
    wanted = np.any(commanded.effort[newest.clip(0)] != 0.0, axis=1)
    shut = ~np.any(applied.effort != 0.0, axis=1)
    return _spans(record, shut & wanted & (newest >= 0) & (age_s > 1.5 / hz))


def _spans(record: RunRecord, flags: np.ndarray) -> list[Span]:
    """Times between which a flag of each sample of `record.applied` is set."""
    stamp_s = record.actuation.stamp_s
    if not len(stamp_s):
        return []
    begin_s = record.motion.stamp_s[0] if len(record.motion) else stamp_s[0]
    ends = np.append(stamp_s[1:], stamp_s[-1]) - begin_s  # a sample counts until the next one
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(int)))
    return [
        (float(stamp_s[first] - begin_s), float(ends[last - 1]))
        for first, last in zip(edges[::2], edges[1::2], strict=True)
    ]


def actuators_height(runs: Sequence[View], least: float) -> float:
    """Height of one raster in which the rows of every run can be read [inch]."""
    return max(least, *(ROW * len(run.record.actuation.names) for run in runs))


def draw_actuators(axes: Axes, run: View) -> None:
    """One row for each actuator: a bar wherever a valve was open, else the share of full command."""
    names = run.record.actuation.names
    if run.binary:
        _bars(axes, run, len(names))
    elif run.result is not None:
        _shares(axes, run, run.result)
    for begin, end in watchdog_spans(run.record):
        axes.axvspan(begin, end, facecolor=ALARM, alpha=0.14, linewidth=0)
        axes.text(
            0.5 * (begin + end), 1.02, "closed by the watchdog" if run.binary else "stopped by the watchdog",
            ha="center", va="bottom", fontsize=8.5, color=ALARM,
            transform=axes.get_xaxis_transform(),
        )  # fmt: skip
    axes.set_ylim(len(names) + 0.7, 0.3)
    axes.set_yticks(range(1, len(names) + 1))
    if not run.binary:
        axes.set_yticklabels([name.replace("_", " ") for name in names])
    axes.tick_params(axis="y", length=0)
    axes.set_ylabel("valve" if run.binary else "")
    axes.set_title(run.label, loc="left", color=INK)
    axes.spines["left"].set_visible(False)
    for row in range(1, len(names)):
        axes.axhline(row + 0.5, color=FAINT, alpha=0.25, linewidth=0.6)
    for _, result in evaluated([run]):
        axes.set_xlim(0.0, result.duration_s)


def _bars(axes: Axes, run: View, count: int) -> None:
    for row in range(count):
        bars = [(begin, end - begin) for begin, end in open_spans(run.record, row)]
        axes.broken_barh(bars, (row + 0.6, 0.8), facecolors=run.colour, linewidth=0)


def _shares(axes: Axes, run: View, result: RunResult) -> None:
    for row, share in enumerate(result.run.shares[0].T, start=1):
        height = row - 0.42 * np.clip(share, -1.0, 1.0)  # rows count downwards
        axes.axhline(row, color=FAINT, linewidth=0.6)
        axes.fill_between(result.time_s, row, height, step="pre", color=run.colour, alpha=0.25, linewidth=0)
        axes.step(result.time_s, height, where="pre", color=run.colour, linewidth=0.9)


def draw_use(axes: Axes, runs: Sequence[View]) -> None:
    """Open-valve time, or time at full command, added up over the run."""
    for run, result in evaluated(runs):
        count = len(run.record.actuation.names)
        spent = np.cumsum(result.run.effort[0]) * count * result.run.control_dt
        axes.plot(result.time_s, spent, color=run.colour, label=run.label)
    axes.set_ylim(bottom=0.0)
    axes.set_xlim(0.0, max((result.duration_s for _, result in evaluated(runs)), default=1.0))
    axes.set_xlabel("time [s]")
    axes.set_ylabel("open-valve time [s]" if all(run.binary for run in runs) else "time at full command [s]")


def draw_latency(axes: Axes, runs: Sequence[View]) -> None:
    """Share of commands by the time from measurement to answer, with p50 and p99.

    The scale is logarithmic, because a few answers take ten times as long as most.
    """
    known = [(run, np.maximum(run.latencies_ms, SHORTEST_MS)) for run in runs if run.latencies_ms.size]
    if not known:
        axes.text(0.5, 0.5, "no command answers a recorded odometry", ha="center", transform=axes.transAxes)
        return
    shortest = min(float(latency.min()) for _, latency in known)
    longest = max(float(latency.max()) for _, latency in known)
    bins = np.geomspace(0.8 * shortest, 1.25 * longest, BINS)
    for run, latency in known:
        share = np.full(latency.size, 100.0 / latency.size)
        spread = percentiles(run.latencies_ms)
        label = f"{run.label}: p50 {spread['p50']:.2g} ms, p99 {spread['p99']:.2g} ms"
        axes.hist(latency, bins, weights=share, color=run.colour, alpha=0.22, histtype="stepfilled")
        axes.hist(latency, bins, weights=share, color=run.colour, histtype="step", label=label)
        axes.axvline(spread["p50"], color=run.colour, linewidth=1.2)
        axes.axvline(spread["p99"], color=run.colour, linewidth=1.2, linestyle=DASHED)
    quiet_grid(axes)
    axes.set_xscale("log")
    axes.set_xlim(bins[0], bins[-1])
    axes.xaxis.set_major_locator(LogLocator(10.0, subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel("from measurement sent to command sent [ms]")
    axes.set_ylabel("commands [%]")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), fontsize=8.5, handlelength=1.2)
