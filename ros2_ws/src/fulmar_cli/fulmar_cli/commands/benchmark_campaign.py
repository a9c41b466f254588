"""What benchmarks share: options, progress, and what is written."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

from fulmar_bringup.console import log_line, output, print_json, print_result, write_line
from fulmar_bringup.progress import work_bar
from fulmar_cli.commands.arguments import flag, invoked_command
from fulmar_core.config.errors import FAILED

if TYPE_CHECKING:
    from fulmar_benchmarks.results import PairResult

OUT_HELP = "Folder of the results and of the report with its figures."
FreshOption = Annotated[bool, flag("--fresh", "Evaluate again what was evaluated before and did not change.")]
ReportOption = Annotated[bool, flag("--report/--no-report", "Draw the report.")]
CheckOption = Annotated[
    bool, flag("--check", "End with code 1 unless every requirement was measured and met.")
]


def run_campaign(
    run: Callable[..., Any],
    request: Any,
    *,
    name_of: Callable[[Any], str],
    figure_of: Callable[[PairResult], str],
    print_tables: Callable[[dict[str, Any], Console], None],
    write_report: Callable[[Any, Path], Path] | None,
    check: bool,
    as_json: bool,
) -> None:
    """Run a benchmark, write its document and report below `request.folder`, and print its tables.

    Args:
        run: `run_drift` or `run_benchmark`.
        request: Its request.
        name_of: Name of a unit of work.
        figure_of: Main figure of its result.
        print_tables: Prints the document.
        write_report: Writes the report and returns its path; None for no report.
        check: Whether an unmet requirement fails the command.
        as_json: Whether to print the document as JSON.

    Raises:
        typer.Exit: With `check`, where a requirement was not met.
    """

    def on_done(unit: Any, result: PairResult | str, before: bool) -> None:
        if isinstance(result, str):
            log_line(f"{name_of(unit)}: failed: {result}")
            return
        about = result.about
        speed = f"{about['wall_s']:.1f} s, {about['control_steps'] / about['wall_s']:,.0f} steps/s"
        log_line(f"{name_of(unit)}: {figure_of(result)} ({'evaluated before' if before else speed})")

    with work_bar("evaluating") as progress:
        result = run(request, progress=progress, on_done=on_done)
    document, folder = result.document, request.folder
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{document['benchmark']}.json"
    path.write_text(json.dumps(document, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    if write_report is not None:
        path = write_report(result, folder)
    print_result(document, lambda document: print_tables(document, output), as_json=as_json)
    log_line(f"written: {path}")
    if check and document["met"] < document["asked"]:
        raise typer.Exit(FAILED)


def finish(
    name: str,
    document: dict[str, Any],
    folder: Path,
    *,
    lines_of: Callable[[dict[str, Any]], list[str]],
    write_report: Callable[[], Path] | None,
    as_json: bool,
) -> None:
    """Write the document of a benchmark, with its command, and its report below a folder, and print it."""
    document["command"] = invoked_command()
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.json").write_text(json.dumps(document, indent=1), encoding="utf-8")
    if write_report is not None:
        log_line(f"report: {write_report()}")
    if as_json:
        print_json(document)
        return
    for line in lines_of(document):
        write_line(line)
