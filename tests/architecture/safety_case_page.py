"""The page docs/safety_case.md: hazard, guard and test, made of the table of guards.

`python -m tests.architecture.safety_case_page > docs/safety_case.md`
"""

from __future__ import annotations

import sys
from itertools import groupby

from tests.mutants.table import read_guards

INTRODUCTION = """\
# The safety case: hazard, guard, test

<!-- Generated from tests/mutants/guards: python -m tests.architecture.safety_case_page > docs/safety_case.md -->

Each row is one check that keeps something from going wrong. `make mutants` takes each guard away in turn, and the test
beside it must fail then; `make mutants MUTANTS="--only NAME"` does so for one. [safety.md](safety.md) has all.
"""
TITLES = {
    "bags": "Bags and recordings",
    "drivers": "Drivers of hardware",
    "estimators": "Estimators",
    "inputs": "Measurements and goals",
    "loop": "The control loop",
    "policies": "Policies and files from elsewhere",
    "ros": "ROS, processes and time",
    "safety": "E-stop, watchdog and limits",
    "systems": "Systems and operators",
}


def page() -> str:
    """Its text."""
    parts = [INTRODUCTION]
    for area, rows in groupby(read_guards(), key=lambda guard: guard.area):
        parts.append(f"\n## {TITLES.get(area, area)}\n\n| Hazard | Guard | In | Test |\n|---|---|---|---|\n")
        for guard in rows:
            file, name = guard.file.rpartition("/")[2], guard.test.rpartition("::")[2].replace("_", " ")
            parts.append(f"| {guard.breaks} | `{guard.name}` | `{file}` | {name} |\n")
    return "".join(parts)


if __name__ == "__main__":
    sys.stdout.write(page())
