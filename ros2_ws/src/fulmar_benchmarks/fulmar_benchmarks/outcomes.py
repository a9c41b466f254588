"""What is kept of many episodes of one pair: figures of each, a few paths, and errors over time."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_core.atomic_write import whole_file

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)  # of what is kept over time
FIGURE, MORE = "figure:", "more:"  # prefixes of figures and of further arrays in a file


@dataclass(frozen=True)
class Judged:
    """One robot, task and controller in one way of running."""

    about: dict[str, Any]  # JSON-ready: what was run, and what is told in words
    succeeded: np.ndarray  # (episodes,) truth values
    figures: dict[str, np.ndarray]  # (episodes,) by the names of `fulmar_core.figures`
    map_xy: np.ndarray  # (episodes, 2) where an episode lies in the map of successes
    over_time: np.ndarray  # (quantiles, steps) of the error, or of the goals reached
    paths: np.ndarray  # (kept, steps, 3) x [m], y [m], yaw [rad] of the first episodes
    starts: np.ndarray  # (kept, 3) same, before the first step
    targets: np.ndarray  # (kept, k, 3) as in `Goal`
    goals: np.ndarray  # (kept, steps) targets reached, or over
    obstacles: np.ndarray  # (kept, m, 3) x, y, radius [m]
    more: dict[str, np.ndarray] = field(default_factory=dict)  # whatever else a benchmark keeps

    def save(self, path: Path) -> None:
        """Write one file, whole or not at all."""
        arrays = {name: getattr(self, name) for name in _ARRAYS}
        arrays |= {FIGURE + name: values for name, values in self.figures.items()}
        arrays |= {MORE + name: values for name, values in self.more.items()}
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(path) as file:
            np.savez_compressed(file, about=np.array(json.dumps(self.about)), **arrays)

    @classmethod
    def load(cls, path: Path) -> Judged:
        """Read what `save` wrote.

        Raises:
            OSError, ValueError, KeyError: It is no such file.
        """
        with np.load(path, allow_pickle=False) as file:
            named = {
                prefix: {
                    name.removeprefix(prefix): file[name] for name in file.files if name.startswith(prefix)
                }
                for prefix in (FIGURE, MORE)
            }
            return cls(
                json.loads(str(file["about"])),
                figures=named[FIGURE],
                more=named[MORE],
                **{name: file[name] for name in _ARRAYS},
            )


_ARRAYS = tuple(each.name for each in fields(Judged) if each.name not in ("about", "figures", "more"))
