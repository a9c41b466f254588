"""Curves on Weights & Biases, beside TensorBoard; the package is imported only when somebody asks for it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from stable_baselines3.common.logger import KVWriter


class WandbCurves(KVWriter):
    """Sends every number that is logged; WANDB_MODE=offline keeps them in the run folder."""

    def __init__(self, folder: Path, *, project: str, name: str, settings: dict[str, Any]) -> None:
        """Begin a run there.

        Args:
            folder: Run folder, where wandb keeps its files.
            project: Name of the project.
            name: Name of the run.
            settings: What it is made with.
        """
        import wandb

        folder.mkdir(parents=True, exist_ok=True)
        self._run = wandb.init(project=project, name=name, dir=str(folder), config=settings)

    def write(
        self, key_values: dict[str, Any], key_excluded: dict[str, tuple[str, ...]], step: int = 0
    ) -> None:
        """Send what was logged since the last time."""
        numbers = {key: value for key, value in key_values.items() if isinstance(value, int | float)}
        self._run.log(numbers, step=step)

    def close(self) -> None:
        """Send the rest, and end the run there."""
        self._run.finish()
