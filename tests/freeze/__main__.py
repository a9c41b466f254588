"""Compare what the product computes with what was frozen: `make freeze-check`, `make freeze`."""

from __future__ import annotations

import argparse
import json
import os
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from fulmar_core.config.paths import config_names
from tests.freeze.benchmarks import SMALL, documents
from tests.freeze.tables import TABLES, Rows

ROBOTS = config_names("robots")
EVERY = {name: (table, ROBOTS) for name, table in TABLES.items()} | {"benchmarks": (documents, list(SMALL))}
FROZEN = Path(__file__).parent / "frozen"
SHOWN = 20  # differences of a table that are printed, at most


def main() -> None:
    """Compute every table, and compare it with its file, or write it."""
    parser = argparse.ArgumentParser(prog="python -m tests.freeze", description=__doc__)
    parser.add_argument("--update", action="store_true", help="write what is computed now")
    parser.add_argument("--only", nargs="+", choices=list(EVERY), default=list(EVERY), help="some tables")
    parser.add_argument("--of", nargs="+", help="some robots or benchmarks; all by default")
    asked = parser.parse_args()
    differences = 0
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for table in asked.only:
            compute, names = EVERY[table]
            names = [name for name in names if asked.of is None or name in asked.of]
            found = dict(zip(names, pool.map(compute, names), strict=True))
            differences += _compared(table, found, update=asked.update)
    sys.exit(1 if differences else 0)


def _compared(table: str, found: dict[str, Rows], *, update: bool) -> int:
    """How many rows of a table differ from those that are frozen, after it said which."""
    path = FROZEN / f"{table}.json"
    frozen = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    differing = [
        f"{name} {row}"
        for name, rows in found.items()
        for row in sorted(rows.keys() | frozen.get(name, {}).keys())
        if rows.get(row) != frozen.get(name, {}).get(row)
    ]
    count = sum(map(len, found.values()))
    if update:
        FROZEN.mkdir(exist_ok=True)
        path.write_text(json.dumps(frozen | found, indent=0, sort_keys=True) + "\n", encoding="utf-8")
        _say(f"{table}: {count} rows written, {len(differing)} of them changed")
        return 0
    _say(f"{table}: {count - len(differing)} of {count} rows equal")
    for each in differing[:SHOWN]:
        _say(f"  differs: {each}")
    if len(differing) > SHOWN:
        _say(f"  and {len(differing) - SHOWN} more")
    return len(differing)


def _say(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
