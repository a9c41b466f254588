"""The page of a benchmark: what is required and met, its plots, its tables, and where they come from."""

from __future__ import annotations

from pathlib import Path

from fulmar_benchmarks.campaign import Result
from fulmar_benchmarks.tables import shown_as_html
from fulmar_evaluation.report.page import Part, headline, origin
from fulmar_evaluation.report.style import house_style
from fulmar_evaluation.report.writer import write_benchmark


def write_page(result: Result) -> Path:
    """Write the page and its plots below the folder of the run; returns the page."""
    benchmark, document = result.benchmark, result.document
    with house_style():
        parts: list[Part] = [
            headline(benchmark.conclusion(document)),
            *benchmark.plots(document, result.found),
            "<h2>All figures</h2>",
            *shown_as_html(benchmark.tables(document)),
            *origin(document, f"{benchmark.name}.json"),
        ]
        return write_benchmark(benchmark.choice.out, benchmark.title, parts, style=benchmark.style)
