"""Report of one or several recorded runs: its sections, tables and plots."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from html import escape
from pathlib import Path

from matplotlib.figure import Figure

from fulmar_bags.run_record import RunRecord
from fulmar_core.config.errors import ConfigError
from fulmar_core.states.spatial import SpatialState
from fulmar_evaluation.report.by_kind import plots_of
from fulmar_evaluation.report.control_plot import draw_latency
from fulmar_evaluation.report.error_plot import draw_progress
from fulmar_evaluation.report.frame_plot import WIDTH, Strip, draw_strip, frame_plot, strip_of
from fulmar_evaluation.report.page import Part, cells, faint, html_page, table
from fulmar_evaluation.report.run_figures import latency, strip_count, supply
from fulmar_evaluation.report.run_view import View, evaluated, result_of, rule, table_rows, views
from fulmar_evaluation.report.trajectory_plot import has_place
from fulmar_evaluation.report.writer import write_document

SHEET = 11.0  # width of everything on one sheet [inch]


def write_report(
    records: Sequence[RunRecord], out: Path, title: str | None = None, *, force: bool = True
) -> Path:
    """Write a report.

    Args:
        records: At least one run; several are compared.
        out: A `.html` page that works offline, or a `.png` image. Its folder is made.
        title: Heading; made from the runs by default.
        force: Replace whatever file is there; False: only a report of the same runs.

    Raises:
        ConfigError: There is no run, the runs are of several tasks, or as `write_document` says.
        BagError: A run names no task or no goal.
    """
    if not records:
        raise ConfigError("there is no run to report on. Give at least one bag.")
    _check_alike(records)
    runs = views(records)
    task = str(runs[0].summary["task"] or "run").replace(SpatialState.SUFFIX, " in space")
    task = task.replace("_", " ").capitalize()
    title = title or f"{task}: {' and '.join(run.label for run in runs)}"
    return write_document(
        Path(out),
        [record.path for record in records],
        page=lambda mark: html_page(title, _parts(runs), mark=mark),
        sheet=lambda: _overview(runs, title),
        force=force,
    )


def _check_alike(records: Sequence[RunRecord]) -> None:
    """Refuse runs of several tasks, whose figures mean different things."""
    first = records[0]
    for record in records:
        if record.info.get("task") != first.info.get("task"):
            raise ConfigError(
                f"{record.path} is of task '{record.info.get('task')}', {first.path} of '{first.info.get('task')}'. "
                "A report compares runs of one task; make one for each."
            )


def _parts(runs: Sequence[View]) -> list[Part]:
    shown = plots_of(runs)
    gauge = (supply,) if any(len(run.record.supply) for run in runs) else ()
    plots = (*shown.path, *shown.use, *gauge, latency) if evaluated(runs) else ()
    drawn = [plot(runs) for plot in plots]
    seen = _strips(runs)
    return [
        *faint(_subtitle(runs)),
        f'<div class="results">{"".join(map(_result, runs))}</div>',
        *faint(rule(runs)),
        *(_unread(run) for run in runs if run.record.warnings),
        *(_warnings(run) for run in runs if run.summary["warnings"]),
        *(_beliefs(run) for run in runs if run.summary["beliefs"]),
        *(_guarded(run) for run in runs if run.summary["guard"]),
        "<h2>In figures</h2>",
        _table(runs),
        *([frame_plot(seen)] if seen else []),
        *(plot for plot in drawn if plot is not None),
        "<h2>Where this comes from</h2>",
        f"<dl>{''.join(map(_origin, runs))}</dl>",
    ]


def _subtitle(runs: Sequence[View]) -> str:
    first = runs[0]
    parts = [str(first.summary["robot"] or "unknown robot").replace("_", " ")]
    if first.result is not None:
        parts.append(first.result.task.title)
    parts.append(f"{first.summary['backend']} backend")
    if len(first.record.motion):
        parts.append(datetime.fromtimestamp(float(first.record.motion.log_s[0])).strftime("%-d %B %Y, %H:%M"))
    return " · ".join(parts)


def _run_colour(run: View) -> str:
    return f'style="--run: {run.colour}"'


def _name(run: View) -> str:
    return f'<span class="dot"></span>{escape(run.label)}'


def _result(run: View) -> str:
    word, sentence = result_of(run)
    text = f"{_name(run)}<br><b>{word}</b><p>{escape(sentence)}</p>"
    return f'<div class="result" {_run_colour(run)}>{text}</div>'


def _warnings(run: View) -> str:
    lines = "".join(f"<li>{escape(warning)}</li>" for warning in run.summary["warnings"])
    return f"<p>{_name(run)}: warnings</p><ul>{lines}</ul>"


def _unread(run: View) -> str:
    lines = "; ".join(run.record.warnings[:5])
    return faint(f"{run.label}: part of the bag could not be read. {lines}")[0]


def _beliefs(run: View) -> str:
    return f"<p>{_name(run)}: at the end of the run, {escape(run.summary['beliefs'])}.</p>"


def _guarded(run: View) -> str:
    """Trips of the envelope guard: when, why, how long, and how much room was left."""
    guard = run.summary["guard"]
    if not guard["trips"]:
        return f"<p>{_name(run)}: the envelope guard left its controller alone.</p>"
    lines = "".join(
        f"<li>after {trip['t_s']:.1f} s, for {trip['held_s']:.1f} s: {escape(trip['cause'])}</li>"
        for trip in guard["trips"]
    )
    count, share = len(guard["trips"]), guard["backup_share"]
    often = f"{count} time{'s' if count > 1 else ''}, {share:.1%} of the time"
    return f"<p>{_name(run)}: the envelope guard took over {often}</p><ul>{lines}</ul>"


def _table(runs: Sequence[View]) -> str:
    heads = ["<th></th>", *(f"<th {_run_colour(run)}>{_name(run)}</th>" for run in runs)]
    rows = (
        f"<tr><td>{escape(what)}{f'<small>{escape(why)}</small>' if why else ''}</td>{cells(values)}</tr>"
        for what, why, values in table_rows(runs, plots_of(runs).rows(runs))
    )
    return table(heads, rows)


def _origin(run: View) -> str:
    info = run.record.info
    lines = [f"<code>{escape(str(info['command']))}</code>"] if info.get("command") else []
    if info.get("name") not in (None, "", info.get("robot")):
        lines.append(escape(f"{info['name']}, a {info.get('robot')}"))
    lines.append(
        f"bag <code>{escape(str(run.record.path))}</code>, seed {escape(str(info.get('seed', '–')))}"
    )
    versions = [f"Fulmar {info['fulmar_version']}"] if info.get("fulmar_version") else []
    versions += [f"revision {info['git_revision']}"] if info.get("git_revision") else []
    sha256 = run.record.controller.get("sha256")
    versions += [f"controller SHA-256 {str(sha256)[:16]}"] if sha256 else []
    lines.append(escape(", ".join(versions)))
    return f"<dt {_run_colour(run)}>{_name(run)}</dt>" + "".join(
        f'<dd class="faint">{line}</dd>' for line in lines if line
    )


def _strips(runs: Sequence[View]) -> list[tuple[str, Strip]]:
    """What the cameras of the runs saw, each with the name of its run where there are several."""
    found = []
    for run in runs:
        motion = run.record.motion
        strip = strip_of(run.record.images, motion.stamp_s, motion.position)
        found += [(run.label if len(runs) > 1 else "", strip)] if strip else []
    return found


def _overview(runs: Sequence[View], title: str) -> Figure:
    """All of it on one sheet."""
    plots = plots_of(runs)
    count, motion = strip_count(runs), plots.motion_rows
    high = 1.28 * max(count + motion + 1, plots.path_rows) if motion or plots.path_rows else 4.9
    low, seen = plots.use_height(runs), _strips(runs)
    rows = [high, low, *(SHEET / WIDTH * strip.height for _, strip in seen)]
    figure = Figure(figsize=(SHEET, sum(rows) + 0.5), layout="constrained")
    top, bottom, *strips = figure.subfigures(len(rows), 1, height_ratios=rows)
    for part, (_, strip) in zip(strips, seen, strict=True):
        draw_strip(part, strip)
    near = motion and any(has_place(result) for _, result in evaluated(runs))
    left, right = top.subfigures(1, 2, width_ratios=(1.2 if near else 1.0, 1.0))
    plots.draw_path(left, runs)
    axes = right.subplots(
        count + motion + 1, 1, gridspec_kw={"height_ratios": (*[1.0] * (count + motion), 0.9)}
    )
    draw_progress(axes[:count], runs)
    if motion:
        axes[count - 1].set_xlabel("")
        plots.draw_motion(axes[count:-1], runs)
    draw_latency(axes[-1], runs)
    plots.draw_use(bottom, runs)
    figure.suptitle(title, fontsize=13, fontweight="bold")
    return figure
