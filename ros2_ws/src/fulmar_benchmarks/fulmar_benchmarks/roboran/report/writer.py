"""From findings to a page, and to single pictures for other places."""

from __future__ import annotations

from pathlib import Path

from fulmar_benchmarks.roboran.campaign import CampaignResult
from fulmar_benchmarks.roboran.report.page import page
from fulmar_benchmarks.roboran.report.sections import headline, pictures_of
from fulmar_evaluation.report.style import as_png, house_style


def write_report(findings: CampaignResult, out: Path) -> Path:
    """Write `index.html`, which works offline, and every picture once more below `pictures/`.

    Args:
        findings: Of a benchmark.
        out: Folder.

    Returns:
        The page.
    """
    folder = out / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    tasks = dict.fromkeys(entry["task"] for entry in findings.document["pairs"])
    with house_style():
        first = headline(findings)
        sections = [(task, pictures_of(findings, task)) for task in tasks]
        for name, picture in [("at_a_glance", first), *(named for _, drawn in sections for named in drawn)]:
            (folder / f"{name}.png").write_bytes(as_png(picture.figure, dpi=110))
            picture.figure.set_layout_engine(
                "none"
            )  # it is laid out now; again would take as long as drawing
        html = page(
            findings.document, first, [(task, [picture for _, picture in drawn]) for task, drawn in sections]
        )
    path = out / "index.html"
    path.write_text(html, encoding="utf-8")
    return path
