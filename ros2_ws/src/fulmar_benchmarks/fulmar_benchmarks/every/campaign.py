"""Every benchmark as a cell: its command in a process of its own, whose document is kept; one page of all figures."""

from __future__ import annotations

import json
import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from fulmar_benchmarks.catalogue import rows
from fulmar_benchmarks.every.figures import rows_of
from fulmar_benchmarks.every.page import page_of, write_text
from fulmar_benchmarks.every.sizes import SIZES, TAKES, options
from fulmar_benchmarks.outcomes import PACKAGES, hash_of
from fulmar_benchmarks.shape import AGAIN, HERE, Benchmark, Cell, Check, Figures, Found, Progress
from fulmar_core.config.errors import RunFailed, UnknownNameError
from fulmar_core.config.process import end_with
from fulmar_core.config.provenance import git_revision

PACKAGE = Path(__file__).parents[1]
CODE = (*PACKAGES["ros"], "fulmar_benchmarks", "hardware_drivers", "training", "tests.benchmarks")
TEXT = (
    "Each row names the command that repeats it, the day and the revision. "
    "Met: ours is at least as good as what is published or required."
)


@dataclass(frozen=True, kw_only=True)
class CommandCell(Cell):
    """One benchmark at one size."""

    benchmark: str
    words: tuple[str, ...]  # of its command, as they are shown
    more: tuple[str, ...] = ()  # that figures do not depend on

    def parts(self) -> dict[str, Any]:
        """Its command, and the code of all benchmarks."""
        folders = [Path(find_spec(name).submodule_search_locations[0]) for name in CODE]  # type: ignore[union-attr,index]
        files = [path for folder in folders for path in sorted(folder.rglob("*.py"))]
        files = [path for path in files if not path.is_relative_to(PACKAGE / "every")]
        return {"words": self.words, "code": hash_of(*(path.read_text(encoding="utf-8") for path in files))}

    def measure(self, progress: Progress, pool: Any = None) -> Figures:
        """The document that the command prints, whatever its requirements.

        Raises:
            RunFailed: It prints none; with its last words.
        """
        ends = partial(end_with, os.getpid(), signal.SIGTERM)
        call = [sys.executable, "-m", "fulmar_cli.main", *self.words[1:], *self.more, "--json"]
        done = subprocess.run(
            call, capture_output=True, text=True, errors="replace", check=False, preexec_fn=ends
        )
        try:
            document = json.loads(done.stdout)
        except ValueError:
            last = done.stderr.strip().splitlines()[-1:]
            raise RunFailed(last[0] if last else f"ended with code {done.returncode}") from None
        return {
            AGAIN: bool(document.get("open")),
            "document": document,
            "made": f"{time.strftime('%Y-%m-%d')} {git_revision()}".strip(),
        }


class Every(Benchmark):
    """All of them."""

    name, title = "all", "Every benchmark"

    def check(self) -> None:
        """Refuse a size that is not there."""
        if self.choice.size not in SIZES:
            raise UnknownNameError("size", self.choice.size, SIZES)

    def cells(self) -> list[CommandCell]:
        """Those that are asked for and installed."""
        return [self._cell(name) for name in self.choice.only]

    def _cell(self, name: str) -> CommandCell:
        choice, row = self.choice, rows().get(name)
        takes = {*row.shared, *(() if row.dated else ("out",))} if row else TAKES.get(name, ())
        seed = ["--seed", str(choice.seed)] if "seed" in takes else []
        given: dict[str, Any] = {
            "jobs": choice.jobs,
            "ray": choice.ray,
            "out": (choice.out / name).absolute(),
        }
        more = [
            word for key in given if key in takes and given[key] for word in (f"--{key}", str(given[key]))
        ]
        more += ["--fresh"] if choice.fresh and "resume" in takes else []
        words = ("fulmar", "benchmark", name, *options(name, choice.size), *seed)
        return CommandCell(
            name=f"{name}_{choice.size}",
            where=HERE,
            way="mujoco",
            benchmark=name,
            words=words,
            more=tuple(more),
        )

    def document(self, found: Found) -> dict[str, Any]:
        """A document as `page_of` takes it: a section for each benchmark."""
        return {
            "title": f"{self.title}, size {self.choice.size}",
            "text": TEXT,
            "sections": [self._section(cell, found[cell.name]) for cell in self.cells()],
        }

    @staticmethod
    def _section(cell: CommandCell, found: Figures | str) -> dict[str, Any]:
        if isinstance(found, str):
            return {"title": cell.benchmark, "text": f"Failed: {found}", "rows": []}
        made = {"command": shlex.join(cell.words), "made": found["made"]}
        figures = [row | made for row in rows_of({"benchmark": cell.benchmark} | found["document"])]
        met = [row["met"] for row in figures if row["met"] is not None]
        return {"title": cell.benchmark, "text": f"{sum(met)} of {len(met)} met.", "rows": figures}

    def checks(self, document: Mapping[str, Any]) -> list[Check]:
        """Every figure that can be met, and that every benchmark ran."""
        ran = [
            Check.least(f"{one['title']}: ran", float(bool(one["rows"])), 1.0) for one in document["sections"]
        ]
        every = [row for section in document["sections"] for row in section["rows"] if row["met"] is not None]
        return ran + [Check.least(row["figure"], float(row["met"]), 1.0) for row in every]

    def tables(self, document: Mapping[str, Any]) -> list[str]:
        """A line for each benchmark, and the page beside the document."""
        page = self.choice.out / "page.md"
        write_text(page, page_of(document))
        return [*(f"{one['title']:12}{one['text']}" for one in document["sections"]), f"page: {page}"]
