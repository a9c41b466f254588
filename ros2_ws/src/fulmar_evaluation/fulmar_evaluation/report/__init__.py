"""One or several recorded runs as a page or a picture for people who see them for the first time."""

from fulmar_evaluation.report.writer import write_report

__all__ = ["write_report"]
