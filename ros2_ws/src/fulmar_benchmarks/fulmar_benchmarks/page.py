"""The page of a benchmark: what is required and met, its plots, its tables, and where they come from."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from fulmar_benchmarks.shape import Benchmark
from fulmar_benchmarks.tables import shown_as_html
from fulmar_evaluation.report.page import Part, headline, origin
from fulmar_evaluation.report.style import house_style
from fulmar_evaluation.report.writer import write_benchmark


def write_page(benchmark: Benchmark, document: Mapping[str, Any], draw: Callable[[], Sequence[Part]]) -> Path:
    """Write the page and its plots, which `draw` draws, below the folder of the run; returns the page."""
    with house_style():
        parts: list[Part] = [
            headline(benchmark.conclusion(document)),
            *draw(),
            "<h2>All figures</h2>",
            *shown_as_html(benchmark.tables(document)),
            *origin(dict(document), f"{benchmark.name}.json"),
        ]
        return write_benchmark(benchmark.choice.out, benchmark.title, parts, style=benchmark.style)
