"""The rooms of the core, and which folders of the house import which: `make rooms` prints it.

A room is a folder of `fulmar_core`. pyproject.toml has their order, as a contract of import-linter: a room imports
lower ones alone. Imports for type checkers count.
"""

from __future__ import annotations

import sys
import tomllib
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import grimp
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

CORE = "fulmar_core"
REPOSITORY = Path(__file__).parents[2]
Arrow = tuple[str, str]  # who imports, and what


@dataclass(frozen=True)
class Figures:
    """What is counted of the core's rooms and of all folders."""

    rooms: dict[str, int]  # lines of each, highest first
    arrows: dict[Arrow, int]  # imports from one room to another
    upward: list[Arrow]  # those to a room that is not lower
    loose: list[str]  # modules beside the rooms
    circles: list[list[str]]  # folders of the house that import each other


def settings(repository: Path = REPOSITORY) -> dict[str, object]:
    """Settings of import-linter."""
    text = (repository / "pyproject.toml").read_text(encoding="utf-8")
    found: dict[str, object] = tomllib.loads(text)["tool"]["importlinter"]
    return found


def floors() -> list[str]:
    """Names of the rooms, highest first, as the contract has them."""
    for contract in settings()["contracts"]:  # type: ignore[attr-defined]
        if contract.get("containers") == [CORE]:
            return list(contract["layers"])
    raise LookupError(f"pyproject.toml has no contract of the rooms of {CORE}")


def house() -> grimp.ImportGraph:
    """Every module of every package."""
    return grimp.build_graph(*settings()["root_packages"], cache_dir=None)  # type: ignore[misc]


def circles(arrows: Iterable[Arrow]) -> list[list[str]]:
    """Groups of modules or folders that import each other, directly or through others."""
    pairs = sorted(set(arrows))
    names = sorted({name for pair in pairs for name in pair})
    index = {name: number for number, name in enumerate(names)}
    rows, columns = np.array([(index[a], index[b]) for a, b in pairs]).T
    matrix = coo_array((np.ones(len(pairs)), (rows, columns)), shape=(len(names), len(names)))
    _, groups = connected_components(matrix, connection="strong")
    return [
        [name for name, its in zip(names, groups, strict=True) if its == group]
        for group in np.flatnonzero(np.bincount(groups) > 1)
    ]


def imports(graph: grimp.ImportGraph) -> list[Arrow]:
    """Which module imports which."""
    return [(a, b) for a in graph.modules for b in graph.find_modules_directly_imported_by(a)]


def figures(graph: grimp.ImportGraph) -> Figures:
    """Count."""
    order, every = floors(), imports(graph)
    folders = {name for name in graph.modules if graph.find_children(name)}

    def folder(module: str) -> str:
        return module if module in folders else module.rpartition(".")[0]

    def room(module: str) -> str:
        parts = module.split(".")
        return parts[1] if parts[0] == CORE and len(parts) > 1 else ""

    arrows = Counter((room(a), room(b)) for a, b in every if room(a) and room(b) and room(a) != room(b))
    between = {(folder(a), folder(b)) for a, b in every if folder(a) != folder(b)}
    return Figures(
        rooms={name: _lines(name) for name in order},
        arrows=dict(arrows),
        upward=[
            (a, b) for a, b in arrows if a not in order or b not in order or order.index(b) < order.index(a)
        ],
        loose=sorted({room(name) for name in graph.modules if room(name)} - set(order)),
        circles=circles(between),
    )


def _lines(room: str) -> int:
    folder = REPOSITORY / "ros2_ws" / "src" / CORE / CORE / room
    return sum(len(path.read_text(encoding="utf-8").splitlines()) for path in folder.rglob("*.py"))


def main() -> int:
    """Print the figures; 1 if a room imports a higher one, or folders import each other."""
    found, out = figures(house()), sys.stdout
    for name, lines in found.rooms.items():
        below = sorted(b for a, b in found.arrows if a == name)
        out.write(f"{name:12} {lines:6} lines   {', '.join(below)}\n")
    wrong = [*map(str, found.upward), *map(str, found.circles), *found.loose]
    out.write(
        f"rooms {len(found.rooms)}, arrows {len(found.arrows)}, upward {len(found.upward)}, "
        f"loose {len(found.loose)}, circles of folders {len(found.circles)}\n"
    )
    out.writelines(f"wrong: {each}\n" for each in wrong)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
