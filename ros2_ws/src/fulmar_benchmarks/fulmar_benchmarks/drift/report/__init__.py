"""The findings of DRIFT's benchmark as a page with pictures."""

from fulmar_benchmarks.drift.report.writer import write_report

__all__ = ["write_report"]
