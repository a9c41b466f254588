"""One controller in one row: what is gathered beside the figures of every benchmark."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_benchmarks.drift.conditions import RUN_UP_S
from fulmar_benchmarks.results import QUANTILES
from fulmar_benchmarks.unit import KEPT, Extra, TrialCell
from fulmar_core.simulation.metrics import Trajectories
from fulmar_core.tasks.path_task import FollowPath

BANDS = ("distance_m", "heading_error_deg", "speed_m_s", "turn_rate_deg_s")  # kept as quantiles over time


@dataclass(frozen=True, kw_only=True)
class DriftCell(TrialCell):
    """A trial of one row."""

    modules = (*TrialCell.modules, f"{__package__}.conditions")
    row: str = ""  # of conditions.ROWS
    controller: str = ""  # as it was asked for

    def extra(self) -> Extra:
        """Bands over time of a pose row, errors over time of a path row."""
        task = self.trial.task
        return PathErrors(task) if isinstance(task, FollowPath) else PoseBands()


class PoseBands(Extra):
    """Quantiles over all episodes of the distance, the heading error and both velocities, step by step."""

    def __init__(self) -> None:
        """Begin empty."""
        self._columns: dict[str, list[np.ndarray]] = {name: [] for name in BANDS}

    def add(self, run: Trajectories) -> None:
        """Take note of some more episodes."""
        columns = (
            run.position_error,
            np.abs(np.rad2deg(run.heading_error)),
            run.speed,
            np.abs(np.rad2deg(run.yaw_rate)),
        )
        for name, column in zip(BANDS, columns, strict=True):
            self._columns[name].append(column)

    def arrays(self) -> dict[str, np.ndarray]:
        """Of each quantity the quantiles `QUANTILES`, shapes (quantiles, steps)."""
        return {
            name: np.quantile(np.concatenate(columns), QUANTILES, axis=0).astype(np.float32)
            for name, columns in self._columns.items()
        }


class PathErrors(Extra):
    """Velocity error and distance from the path, over the whole run and once it is under way."""

    def __init__(self, task: FollowPath) -> None:
        """Begin empty."""
        self._task = task
        self._velocity: list[np.ndarray] = []
        self._off_path: list[np.ndarray] = []
        self._control_dt = 1.0

    def add(self, run: Trajectories) -> None:
        """Take note of some more episodes."""
        self._control_dt = run.control_dt
        self._velocity.append(run.velocity_error)
        self._off_path.append(
            np.stack([self._task.off_path(x, y) for x, y in zip(run.x, run.y, strict=True)])
        )

    def arrays(self) -> dict[str, np.ndarray]:
        """Both errors of the first episodes, shapes (kept, steps)."""
        return {
            "velocity_error_m_s": np.concatenate(self._velocity)[:KEPT].astype(np.float32),
            "path_error_m": np.concatenate(self._off_path)[:KEPT].astype(np.float32),
        }

    def figures(self) -> dict[str, np.ndarray]:
        """Means and standard deviations over time, shapes (episodes,)."""
        velocity, off_path = np.concatenate(self._velocity), np.concatenate(self._off_path)
        moving = slice(round(RUN_UP_S / self._control_dt), None)
        return {
            "velocity_error_std_m_s": velocity.std(axis=1),
            "velocity_error_under_way_m_s": velocity[:, moving].mean(axis=1),
            "velocity_error_under_way_std_m_s": velocity[:, moving].std(axis=1),
            "path_error_m": off_path.mean(axis=1),
            "path_error_std_m": off_path.std(axis=1),
            "path_error_most_m": off_path.max(axis=1),
        }
