"""Lines that ask what kind of vehicle a robot is, outside of `robots/kinds`.

`python -m tests.architecture.kind_branches` prints them. Each is a place that a new kind has to find; tables by kind
(`by_kind.py`) and fields of `Kind` are none.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
FOLDERS = ("ros2_ws/src", "sim_nodes", "policy_server", "hardware_drivers", "training")
KINDS = "ros2_ws/src/fulmar_core/fulmar_core/robots/kinds/"
FAMILIES = (
    "Thrusters|Propellers|DifferentialDrive|Ackermann|ReactionWheels|ControlSurfaces|Fans|Rolling|Pushing"
)
ASKS = re.compile(
    r"\.flies\b|\bturns_only\b|\bstate_type is\b|"
    rf"isinstance\([^)]*\b({FAMILIES}|PlanarState|SpatialState|\w*Actuation|\w*Dynamics)\b"
)
MOST = 37  # no more than there are


def branches() -> Iterator[tuple[Path, int, str]]:
    """File, number and text of each line."""
    for folder in FOLDERS:
        for path in sorted((REPOSITORY / folder).rglob("*.py")):
            name = path.relative_to(REPOSITORY)
            if str(name).startswith(KINDS) or path.parent.resolve() != path.parent:  # colcon's links
                continue
            for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
                if ASKS.search(line):
                    yield name, number, line.strip()


def main() -> int:
    """Print them and their number; 1 if there are more than allowed."""
    found = list(branches())
    for path, number, line in found:
        sys.stdout.write(f"{path}:{number}: {line}\n")
    files = len({path for path, _, _ in found})
    sys.stdout.write(
        f"{len(found)} lines in {files} files ask for the kind of a vehicle; at most {MOST} may\n"
    )
    return 1 if len(found) > MOST else 0


if __name__ == "__main__":
    sys.exit(main())
