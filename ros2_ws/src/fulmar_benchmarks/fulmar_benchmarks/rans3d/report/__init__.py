"""The result of the benchmark as a page with plots."""

from fulmar_benchmarks.rans3d.report.sections import write_report

__all__ = ["write_report"]
