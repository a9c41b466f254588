"""A run of any benchmark: what is known is read, the rest is measured and kept, then the document is put together."""

from __future__ import annotations

import json
import os
import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from fulmar_benchmarks.outcomes import keep, keys_of, library_version, read
from fulmar_benchmarks.pool import measure_all
from fulmar_benchmarks.shape import AGAIN, Benchmark, Cell, Figures, Found, tally
from fulmar_core.config.atomic_write import whole_file
from fulmar_core.config.provenance import fulmar_version, git_revision

FORMAT = 1  # of documents
LIBRARIES = ("numpy", "scipy", "mujoco", "onnxruntime", "torch", "jsbsim", "matplotlib")
Done = Callable[[Cell, Figures | str, bool], None]
MeasureAll = Callable[..., None]


@dataclass(frozen=True)
class Result:
    """What came of a run."""

    benchmark: Benchmark
    document: dict[str, Any]
    found: Found


def provenance(name: str, command: str) -> dict[str, Any]:
    """How the document of a benchmark begins: what made it, and where."""
    return {
        "benchmark": name,
        "format": FORMAT,
        "fulmar_version": fulmar_version(),
        "git_revision": git_revision(),
        "machine": {
            "platform": platform.platform(),
            "processor": _processor(),
            "cores": len(os.sched_getaffinity(0)),
            "python": platform.python_version(),
        },
        "libraries": {each: found for each in LIBRARIES if (found := library_version(each))},
        "command": command,
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    return next(
        (line.partition(": ")[2] for line in lines if line.startswith("model name")), platform.machine()
    )


def run(
    benchmark: Benchmark,
    *,
    progress: Callable[[float, float], None] = lambda done, total: None,
    on_done: Done = lambda cell, figures, before: None,
    using: MeasureAll = measure_all,
) -> Result:
    """Measure everything that is asked for, but for what was measured before.

    Args:
        benchmark: Which.
        progress: Called with how much is done, and of how much.
        on_done: Called with each cell, its figures, or why there are none, and whether they were there before.
        using: Measures cells, as `pool.measure_all` does in a pool.
    """
    began, choice = time.monotonic(), benchmark.choice
    benchmark.check()
    found = measured(
        benchmark.cells(), folder=choice.out / "outcomes", jobs=choice.jobs, fresh=choice.fresh,
        progress=progress, on_done=on_done, using=using,
    )  # fmt: skip
    own = benchmark.document(found)
    checks = benchmark.checks(own)
    document = {
        **provenance(benchmark.name, choice.command),
        **tally(each.met for each in checks),
        **own,
        "checks": [asdict(each) for each in checks],
        "wall_s": round(time.monotonic() - began, 1),
    }
    return Result(benchmark, document, found)


def measured(
    cells: Sequence[Cell],
    *,
    folder: Path,
    jobs: int,
    fresh: bool = False,
    progress: Callable[[float, float], None] = lambda done, total: None,
    on_done: Done = lambda cell, figures, before: None,
    using: MeasureAll = measure_all,
) -> dict[str, Figures | str]:
    """Figures of cells by their names, in their order; those of an earlier run where its files hold them.

    Arguments as in `run`; `folder` is where files are kept, `fresh` measures again what was measured before.
    """
    keys, found = keys_of(cells), dict[str, Figures | str]()
    for cell in cells:
        if not fresh and (before := read(folder / f"{cell.name}.npz", keys[cell.name])) is not None:
            found[cell.name] = before
            on_done(cell, before, True)
    left = [cell for cell in cells if cell.name not in found]
    total = sum(cell.cost for cell in left)

    def note(cell: Cell, figures: Figures | str) -> None:
        if not isinstance(figures, str) and not figures.pop(AGAIN, False):
            figures = keep(folder / f"{cell.name}.npz", keys[cell.name], figures)
        found[cell.name] = figures
        on_done(cell, figures, False)

    using(left, jobs=jobs, progress=lambda done: progress(done, total), on_done=note)
    return {cell.name: found[cell.name] for cell in cells}


def write(result: Result, *, report: bool) -> Path:
    """Write document and page below the folder of a run; returns the page, or the document without a report."""
    benchmark, out = result.benchmark, result.benchmark.choice.out
    out.mkdir(parents=True, exist_ok=True)
    path: Path = out / f"{benchmark.name}.json"
    with whole_file(path) as file:
        file.write((json.dumps(result.document, indent=2, allow_nan=False) + "\n").encode())
    if not report:
        return path
    from fulmar_benchmarks.page import write_page

    return write_page(benchmark, result.document, lambda: benchmark.plots(result.document, result.found))
