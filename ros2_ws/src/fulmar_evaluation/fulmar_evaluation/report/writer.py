"""Writes reports, and marks each with the runs it was made of, so that none replaces a report of other runs."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from matplotlib.figure import Figure

from fulmar_bags.mcap_records import files_of
from fulmar_core.config.errors import ConfigError
from fulmar_evaluation.report.page import BENCHMARK_STYLE, Part, Plot, html_page
from fulmar_evaluation.report.style import as_png, house_style

IMAGES = (".png", ".svg", ".pdf")  # endings of single figures
MARK = "fulmar-report-of-"
HEAD_BYTES = 1 << 16  # of each file; times of recording are among them, which no other bag has
LARGEST = 480_000  # of a single plot [bytes]


def write_document(
    out: Path, bags: Sequence[Path], *, page: Callable[[str], str], sheet: Callable[[], Figure], force: bool
) -> Path:
    """Write a report of bags.

    Args:
        out: A `.html` page that works offline, or a `.png` image. Its folder is made.
        bags: What the report shows.
        page: Builds the page, from the mark of the bags.
        sheet: Draws everything in one figure.
        force: Replace whatever file is there; False: only a report of the same bags.

    Raises:
        ConfigError: Another kind of file was asked for, a file of something else is there, or it cannot be written.
        BagError: There is no such bag.
    """
    if out.suffix not in (".html", ".png"):
        raise ConfigError(f"{out}: '{out.suffix}' cannot be drawn. Give a name that ends in .html or .png.")
    mark = source_mark(bags)
    if not force:
        check_overwrite(out, mark)
    with house_style(text_parse_math=False):  # names of bags may have dollar signs
        data = as_png(sheet(), mark) if out.suffix == ".png" else page(mark).encode()
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        out.write_bytes(data)
    except OSError as error:
        raise ConfigError(f"{out}: cannot write the report: {error.strerror}.") from error
    return out


def check_image(path: Path) -> None:
    """Refuse a file that no figure is drawn into, before anything is computed.

    Raises:
        ConfigError: With the endings that are allowed.
    """
    if path.suffix.lower() not in IMAGES:
        raise ConfigError(
            f"{path}: '{path.suffix}' cannot be drawn. Give a name that ends in {', '.join(IMAGES)}."
        )


def write_benchmark(out: Path, title: str, parts: Sequence[Part], *, style: str = "") -> Path:
    """Write `index.html`, which works offline, and every plot once more below `pictures/`.

    Args:
        out: Folder.
        title: Of the page.
        parts: Of the page, drawn inside `house_style`; each plot has a name.
        style: Rules beside those of every benchmark.
    """
    folder = out / "pictures"  # word: folder of reports
    folder.mkdir(parents=True, exist_ok=True)
    with house_style():
        for plot in parts:
            if isinstance(plot, Plot):
                (folder / f"{plot.name}.png").write_bytes(_small_png(plot.figure))
                # It is laid out now; again would take as long as drawing.
                plot.figure.set_layout_engine("none")
        html = html_page(title, parts, style=BENCHMARK_STYLE + style, heading="h3")
    path = out / "index.html"
    path.write_text(html, encoding="utf-8")
    return path


def _small_png(figure: Figure) -> bytes:
    """As fine as fits."""
    drawn = (as_png(figure, dpi=dpi) for dpi in (110, 85))
    return next((png for png in drawn if len(png) < LARGEST), None) or as_png(figure, dpi=60)


def source_mark(bags: Iterable[Path]) -> str:
    """Mark of the bags that a report shows.

    Args:
        bags: Bag folders, or files in them. The folders above them do not count: bags may be moved.

    Returns:
        Letters, digits and dashes, to be written into the file.

    Raises:
        BagError: There is no such bag.
    """
    found = hashlib.sha256()
    for bag in bags:
        found.update(bag.resolve().name.encode())
        for file in files_of(bag):
            with file.open("rb") as stream:
                found.update(stream.read(HEAD_BYTES))
    return MARK + found.hexdigest()[:32]


def check_overwrite(out: Path, mark: str) -> None:
    """Refuse to replace a file that was not made from the same runs.

    Raises:
        ConfigError: There is such a file, of something else.
    """
    if not out.exists():
        return
    found = out.read_bytes() if out.is_file() else b""
    if mark.encode() in found:
        return
    what = (
        "is a report of other bags" if MARK.encode() in found else "is not known to be a report of these bags"
    )
    raise ConfigError(f"{out} exists already and {what}. Give --out another name, or --force to replace it.")


def default_report(bags: Sequence[Path]) -> Path:
    """Default path of a report: beside the first bag, with a name of its own where it compares several."""
    first = bags[0] if bags[0].is_dir() else bags[0].parent
    return first / ("report.html" if len(bags) == 1 else "comparison.html")
