"""Reports of recorded runs and of benchmarks: pages, plots and what writes them."""

from fulmar_evaluation.report.run_report import write_report

__all__ = ["write_report"]
