"""The result of the benchmark as a page with plots."""

from fulmar_benchmarks.roboran.report.sections import write_report

__all__ = ["write_report"]
