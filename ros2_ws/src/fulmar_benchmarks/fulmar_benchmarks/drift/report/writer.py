"""From findings to a page, and to single pictures for other places."""

from __future__ import annotations

from pathlib import Path

from fulmar_benchmarks.drift.campaign import CampaignResult
from fulmar_benchmarks.drift.report.page import page
from fulmar_benchmarks.drift.report.sections import pictures
from fulmar_evaluation.report.plots import Picture
from fulmar_evaluation.report.style import as_png, house_style

LARGEST = 480_000  # of a single picture [bytes]


def _small(picture: Picture) -> bytes:
    """As fine as fits."""
    drawn = (as_png(picture.figure, dpi=dpi) for dpi in (110, 85))
    return next((png for png in drawn if len(png) < LARGEST), as_png(picture.figure, dpi=60))


def write_report(findings: CampaignResult, out: Path) -> Path:
    """Write `index.html`, which works offline, and every picture once more below `pictures/`.

    Args:
        findings: Of the benchmark.
        out: Folder.

    Returns:
        The page.
    """
    folder = out / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    with house_style():
        drawn = pictures(findings)
        for name, picture in drawn.items():
            (folder / f"{name}.png").write_bytes(_small(picture))
            # It is laid out now; again would take as long as drawing.
            picture.figure.set_layout_engine("none")
        html = page(findings.document, list(drawn.values()))
    path = out / "index.html"
    path.write_text(html, encoding="utf-8")
    return path
