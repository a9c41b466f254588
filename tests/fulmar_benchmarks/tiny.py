"""A benchmark of tiny cells, in this process or one of its own: `python -m tests.fulmar_benchmarks.tiny OUT BLOCK`."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_benchmarks.campaign import run
from fulmar_benchmarks.shape import ALONE, Benchmark, Cell, Check, Choice, known

BLOCKED_S = 60.0


@dataclass(frozen=True, kw_only=True)
class TinyCell(Cell):
    """A number and its square; it may raise, or note that it was measured."""

    number: int
    notes: str

    def parts(self) -> dict[str, Any]:
        return {"number": self.number}

    def measure(self, progress, pool=None):
        with Path(self.notes).open("a") as file:
            file.write(f"{self.number}\n")
        if (Path(self.notes).parent / f"block_{self.number}").exists():
            time.sleep(BLOCKED_S)
        if (Path(self.notes).parent / f"fail_{self.number}").exists():
            raise RuntimeError("it broke")
        return {
            "square": self.number**2, "share": np.float64(1.0 / 3.0), "pair": (1, 2.5), "none": None,
            "inner": {"path": np.arange(self.number, dtype=np.float32)},
        }  # fmt: skip


class Tiny(Benchmark):
    """Three cells."""

    name = "tiny"

    def cells(self) -> Sequence[Cell]:
        return [
            TinyCell(
                name=f"cell_{number}",
                cost=10.0 - number,
                where=ALONE,
                number=number,
                notes=str(self.choice.out / "notes"),
            )
            for number in (1, 2, 3)
        ]

    def document(self, found):
        figures = {cell.name: known(found, cell.name) for cell in self.cells()}
        return {
            "cells": {
                name: {**each, "inner": each["inner"]["path"].tolist()} for name, each in figures.items()
            }
        }

    def checks(self, document):
        return [Check.most(name, each["square"], 4) for name, each in document["cells"].items()]

    def tables(self, document):
        return self.check_lines(document)


def asked(out: Path, **more: Any) -> Tiny:
    """It, with its results in a folder."""
    out.mkdir(parents=True, exist_ok=True)
    given = {"out": out, "jobs": 1, "fresh": False, "command": "", "report": False}
    return Tiny(Choice(**given | more))


if __name__ == "__main__":
    run(asked(Path(sys.argv[1])))
