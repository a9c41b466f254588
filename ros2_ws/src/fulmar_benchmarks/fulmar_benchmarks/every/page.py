"""The Markdown page of a document; `python -m fulmar_benchmarks.every.page docs/benchmarks.json` writes it."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fulmar_core.config.atomic_write import whole_file

HEAD = "| Figure | Ours | Published or required | Met | Command | Recorded |\n|---|---|---|---|---|---|"
MET = {True: "yes", False: "**no**", None: ""}


def page_of(document: Mapping[str, Any]) -> str:
    """The page.

    Args:
        document: `title`, `text` and `sections`, each with `title`, `text`, `rows` and perhaps `after`. A row has
            `figure`, `ours`, `published`, `source`, `met`, `command`, and `made`: day and revision.
    """
    parts = [f"# {document['title']}", document["text"]]
    for section in document["sections"]:
        rows = [HEAD, *map(_line, section["rows"])] if section["rows"] else []
        parts += [f"## {section['title']}", section["text"], "\n".join(rows), section.get("after", "")]
    return "\n\n".join(part for part in parts if part) + "\n"


def _line(row: Mapping[str, Any]) -> str:
    beside = f"{row['published']} ({row['source']})" if row["source"] else row["published"]
    command = f"`{row['command']}`" if row["command"] else ""
    cells = (row["figure"], row["ours"], beside, MET[row["met"]], command, row["made"])
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def write_text(path: Path, text: str) -> None:
    """Write a text, whole or not at all."""
    with whole_file(path) as file:
        file.write(text.encode())


if __name__ == "__main__":
    given = Path(sys.argv[1])
    write_text(given.with_suffix(".md"), page_of(json.loads(given.read_text(encoding="utf-8"))))
