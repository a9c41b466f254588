"""Take each guard of the product away in turn, and run the test that must fail then: `make mutants`.

It works on copies of the tree in a temporary folder: the checkout is never changed.
"""

from __future__ import annotations

import argparse
import json
import sys
import time

from rich.table import Table

from fulmar_bringup.console import console, output
from fulmar_core.config.errors import did_you_mean
from tests.mutants.runner import DEAD, run
from tests.mutants.table import REPOSITORY, Guard, read_guards


def main() -> None:
    """Check the table, then every row that is asked for."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__)
    parser.add_argument("--only", nargs="+", metavar="NAME", help="some guards or areas; all by default")
    parser.add_argument(
        "--jobs", type=int, default=2, help="tests at the same time, each in a tree of its own"
    )
    parser.add_argument("--list", action="store_true", help="print the guards and run nothing")
    parser.add_argument("--json", action="store_true", help="print the result as JSON")
    asked = parser.parse_args()
    every = read_guards()
    guards = [guard for guard in every if not asked.only or {guard.name, guard.area} & {*asked.only}]
    known = {name for guard in every for name in (guard.name, guard.area)}
    problems = [
        f"no guard and no area is called '{name}'.{did_you_mean(name, known)}"
        for name in sorted({*(asked.only or ())} - known)
    ]
    problems += filter(None, (guard.problem(REPOSITORY) for guard in guards))
    if problems:
        for line in problems:
            console.print(f"error: {line}", style="red", markup=False, soft_wrap=True)
        sys.exit(2)
    if asked.list:
        _print(guards, {}, as_json=asked.json)
        return
    begin_s = time.monotonic()
    results = run(guards, REPOSITORY, jobs=max(1, asked.jobs))
    _print(guards, results, as_json=asked.json)
    left = sum(result != DEAD for result in results.values())
    console.print(f"{len(guards) - left} of {len(guards)} guards die, in {time.monotonic() - begin_s:.0f} s.")
    sys.exit(1 if left else 0)


def _print(guards: list[Guard], results: dict[str, str], *, as_json: bool) -> None:
    if as_json:
        rows = [{**vars(guard), "result": results.get(guard.name, "")} for guard in guards]
        sys.stdout.write(json.dumps(rows, indent=2) + "\n")
        return
    table = Table("area", "guard", "breaks without it", "result", "test")
    for guard in guards:
        result = results.get(guard.name, "")
        style = "" if result in ("", DEAD) else "red"
        test = guard.test.removeprefix("tests/")
        table.add_row(guard.area, guard.name, guard.breaks, result, test, style=style)
    output.print(table)


if __name__ == "__main__":
    main()
