"""From recorded runs to a file: a page, or one overview picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fulmar_bags.run_record import RunRecord
from fulmar_core.errors import ConfigError
from fulmar_evaluation.report.page import page
from fulmar_evaluation.report.plots import overview, pictures
from fulmar_evaluation.report.sources import check_overwrite, source_mark
from fulmar_evaluation.report.style import as_png, house_style
from fulmar_evaluation.report.view import View, views


def write_report(
    records: Sequence[RunRecord], out: Path, title: str | None = None, *, force: bool = True
) -> Path:
    """Write a report.

    Args:
        records: At least one run; several are compared.
        out: A `.html` page that works offline, or a `.png` picture. Its folder is made.
        title: Heading; made from the runs by default.
        force: Replace whatever file is there; False: only a report of the same runs.

    Returns:
        The file.

    Raises:
        ConfigError: Another kind of file was asked for, there is no run, the runs are of several tasks, or a file of
            something else is there.
        BagError: A run names no task or no goal.
    """
    out = Path(out)
    if out.suffix not in (".html", ".png"):
        raise ConfigError(f"{out}: '{out.suffix}' cannot be drawn. Give a name that ends in .html or .png.")
    if not records:
        raise ConfigError("there is no run to report on. Give at least one bag.")
    _check_alike(records)
    mark = source_mark(record.path for record in records)
    if not force:
        check_overwrite(out, mark)
    runs = views(records)
    title = title or _title(runs)
    with house_style():
        data = (
            as_png(overview(runs, title), mark)
            if out.suffix == ".png"
            else page(runs, pictures(runs), title, mark).encode()
        )
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        out.write_bytes(data)
    except OSError as error:
        raise ConfigError(f"{out}: cannot write the report: {error.strerror}.") from error
    return out


def _title(runs: Sequence[View]) -> str:
    task = str(runs[0].summary["task"] or "run").replace("_", " ").capitalize()
    return f"{task}: {' and '.join(run.label for run in runs)}"


def _check_alike(records: Sequence[RunRecord]) -> None:
    """Refuse runs of several tasks, whose figures mean different things."""
    first = records[0]
    for record in records:
        if record.info.get("task") != first.info.get("task"):
            raise ConfigError(
                f"{record.path} is of task '{record.info.get('task')}', {first.path} of '{first.info.get('task')}'. "
                "A report compares runs of one task; make one for each."
            )
