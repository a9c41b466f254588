"""The findings of a benchmark as a page with pictures, for people who see them for the first time."""

from fulmar_benchmarks.roboran.report.writer import write_report

__all__ = ["write_report"]
