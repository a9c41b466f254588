"""The mark of a report: of which runs it was made, so that no report of other runs is overwritten."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from pathlib import Path

from fulmar_bags.mcap_records import files_of
from fulmar_core.errors import ConfigError

MARK = "fulmar-report-of-"
HEAD_BYTES = 1 << 16  # of each file; times of recording are among them, which no other bag has


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

    Args:
        out: File to be written.
        mark: Of the runs that it is to show.

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
    """Where a report goes by itself: beside the first bag, with a name of its own where it compares several."""
    first = bags[0] if bags[0].is_dir() else bags[0].parent
    return first / ("report.html" if len(bags) == 1 else "comparison.html")
