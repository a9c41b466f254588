"""The command of one benchmark, made from its row of the catalogue."""

from __future__ import annotations

import contextlib
import inspect
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import typer
import typer.core

from fulmar_benchmarks.catalogue import SHARED, choice, no_such_selector, owners
from fulmar_benchmarks.selectors import Row, Selector
from fulmar_bringup.console import log_line, output, print_result
from fulmar_bringup.progress import work_bar
from fulmar_cli.commands.arguments import JsonOption, invoked_command
from fulmar_cli.installation.extras import require
from fulmar_core.config.errors import FAILED, ConfigError

if TYPE_CHECKING:
    from fulmar_benchmarks.shape import Benchmark, Cell, Figures


class OneBenchmark(typer.core.TyperCommand):
    """A command that says whose selector an option is."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Take the words of the command line.

        Raises:
            ConfigError: An option is not one of this benchmark.
        """
        try:
            return super().parse_args(ctx, args)
        except Exception as error:
            whose = owners(str(getattr(error, "option_name", "")))
            if type(error).__name__ != "NoSuchOption" or not whose:
                raise
            raise ConfigError(
                no_such_selector(str(self.name), str(getattr(error, "option_name", "")))
            ) from None


def command_of(row: Row) -> Callable[..., None]:
    """The function of a benchmark's command, with a parameter for each of its options."""

    def measure(*, as_json: bool = False, **given: Any) -> None:
        run_row(row, given, as_json=as_json)

    own = [*row.selectors, *(SHARED[name] for name in (*row.shared, "out"))]
    parameters = [_parameter(each, row) for each in {each.name: each for each in own}.values()]
    last = inspect.Parameter("as_json", inspect.Parameter.KEYWORD_ONLY, default=False, annotation=JsonOption)
    measure.__name__, measure.__doc__, measure.__annotations__ = row.name, row.help, {}
    vars(measure)["__signature__"] = inspect.Signature([*parameters, last])
    return measure


def _parameter(selector: Selector, row: Row) -> inspect.Parameter:
    limits: dict[str, Any] = {"min": selector.least, "max": selector.most}
    given = {name: value for name, value in limits.items() if value is not None}
    default = not row.timed if selector.name == "resume" else selector.default
    words: dict[str, Any] = {
        "metavar": selector.metavar or None,
        "help": selector.help,
        "show_default": selector.name != "jobs",
    }
    if selector.name == "out":
        place = "<time>..." if row.dated else row.name
        words["help"] = f"{selector.help} runs/benchmark/{place} by default."
    declared: Any = typer.Argument if selector.positional else partial(typer.Option, *selector.names)
    option = declared(**words) if selector.positional else declared(**words, **given)
    kind = selector.kind if default is not None else selector.kind | None
    return inspect.Parameter(
        selector.name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=Annotated[kind, option]
    )


def run_row(row: Row, given: dict[str, Any], *, as_json: bool) -> None:
    """Run a benchmark, write its document and page, and print it.

    Raises:
        typer.Exit: A requirement was not met, where that counts.
    """
    asked = choice(row.name, **given, command=invoked_command())
    require(*row.needs(asked))
    if asked.report:
        require("matplotlib")
    if asked.ray:
        require("ray")
    from fulmar_benchmarks.campaign import run, write
    from fulmar_benchmarks.pool import on_cluster
    from fulmar_benchmarks.tables import print_shown

    benchmark = row.load()(asked)
    bar = work_bar(row.measures) if row.measures else contextlib.nullcontext(lambda done, total: None)
    with on_cluster(asked.ray), bar as progress:
        result = run(benchmark, progress=progress, on_done=_saying(benchmark))
    path, document = write(result, report=asked.report), result.document

    def show(document: dict[str, Any]) -> None:
        print_shown(benchmark.tables(document), output, benchmark.width)

    print_result(document, show, as_json=as_json)
    log_line(f"written: {path}")
    if (asked.check or row.always_checked) and document["met"] < document["asked"]:
        raise typer.Exit(FAILED)


def _saying(benchmark: Benchmark) -> Callable[[Cell, Figures | str, bool], None]:
    """What is said of each cell: an interrupted benchmark has said what it knows."""

    def say(cell: Cell, figures: Figures | str, before: bool) -> None:
        text = f"failed: {figures}" if isinstance(figures, str) else benchmark.said(cell, figures)
        log_line(f"{cell.title or cell.name}: {text}{' (evaluated before)' if before else ''}")

    return say
