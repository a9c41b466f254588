"""Every benchmark: where it is, and what it can be asked for. Nothing heavy is imported before one is chosen."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fulmar_benchmarks.catalogue_rows import ROWS
from fulmar_benchmarks.selectors import Row, Selector
from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.config.seeds import EVALUATION_SEED

if TYPE_CHECKING:
    from fulmar_benchmarks.shape import Choice

# Options that benchmarks share; `--check` and `--json` are for the command alone.
SHARED = {
    "seed": Selector("seed", "N", "Seed of everything random.", EVALUATION_SEED, int, 0, 2**63 - 1),
    "jobs": Selector(
        "jobs", "N", "Parallel processes; one for each core by default.", len(os.sched_getaffinity(0)), int, 1
    ),
    "ray": Selector(
        "ray", "ADDRESS", "Compute on a Ray cluster: HOST:PORT as `ray start --head` prints it, or auto."
    ),
    "resume": Selector(
        "resume", "", "Take what was measured before and did not change, or measure it again.", True, bool,
        names=("--resume/--fresh",),
    ),
    "report": Selector("report", "", "Draw the report.", True, bool, names=("--report/--no-report",)),
    "check": Selector(
        "check", "", "End with code 1 unless every requirement was measured and met.", False, bool,
        names=("--check",),
    ),
    "out": Selector("out", "DIR", "Folder of the results and of the report with its figures.", None, Path,
        names=("--out", "--output")),
}  # fmt: skip


def rows() -> dict[str, Row]:
    """Every benchmark by its name."""
    return {row.name: row for row in ROWS}


def choice(name: str, **given: Any) -> Choice:
    """What one run of a benchmark is asked for; what is not given is as the command has it by default.

    Raises:
        ConfigError: There is no such benchmark or option, or a value is wrong.
    """
    from fulmar_benchmarks.shape import Choice

    every = rows()
    if name not in every:
        raise UnknownNameError("benchmark", name, every)
    row = every[name]
    own = {each.name: each for each in row.selectors}
    for option in given:
        if option not in (*own, *SHARED, "command"):
            raise ConfigError(no_such_selector(name, option))
    values = {**{each.name: each.default for each in SHARED.values()}, "command": ""}
    values |= {"resume": not row.timed, "report": "report" in row.shared}
    values |= {each.name: each.default for each in row.selectors} | given
    values |= {option: each.read(values[option]) for option, each in own.items()}
    new = f"{time.strftime('%Y%m%d_%H%M%S')}_" if row.dated else ""
    values["out"] = Path(values["out"] or f"runs/benchmark/{new}{name}")
    return Choice(**values, fresh=not values["resume"])


def owners(option: str) -> list[str]:
    """Benchmarks that have a selector."""
    written = "--" + option.removeprefix("--").replace("_", "-")
    return [row.name for row in rows().values() if written in spellings(row)]


def no_such_selector(name: str, option: str) -> str:
    """What is wrong with an option that a benchmark does not have."""
    written = "--" + option.removeprefix("--").replace("_", "-")
    whose = (
        f"{written} selects in {', '.join(owners(option))}, not in {name}"
        if owners(option)
        else f"{written}?"
    )
    return f"{whose}: {name} has {', '.join(spellings(rows()[name]))}. Try `fulmar benchmark {name} --help`."


def spellings(row: Row) -> list[str]:
    """Selectors of a benchmark as options."""
    return [
        name
        for each in row.selectors
        if not each.positional
        for name in each.names or (f"--{each.name.replace('_', '-')}",)
    ]
