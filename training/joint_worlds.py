"""Worlds of several tasks of one robot as one vector environment, for one network with a label for each task."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from stable_baselines3.common.vec_env import VecNormalize

from training.vec_env import UnwrappedVecEnv
from training.worlds import observation_space


@dataclass(frozen=True)
class JointInputs:
    """Inputs of a network for several tasks: each observation term once, and one label for each task.

    The label of a task is 1 in its worlds and 0 in others; terms that a task does not observe are 0. A further task
    appends its new terms and its label, so that the columns of earlier tasks keep their numbers.

    Attributes:
        names: Of all inputs; the label of a task has the name of the task.
        terms: Observation terms of each task, in the order of its observations.
    """

    names: tuple[str, ...] = ()
    terms: Mapping[str, tuple[str, ...]] | None = None

    def with_task(self, task: str, terms: Sequence[str]) -> JointInputs:
        """The inputs with those of one more task."""
        new = [name for name in terms if name not in self.names]
        return JointInputs((*self.names, *new, task), {**(self.terms or {}), task: tuple(terms)})

    def columns(self, task: str) -> np.ndarray:
        """Columns of a task's observation terms."""
        assert self.terms is not None
        return np.array([self.names.index(name) for name in self.terms[task]])

    def label(self, task: str) -> int:
        """Column of a task's label."""
        return self.names.index(task)


class JointWorlds(UnwrappedVecEnv):
    """Worlds of several tasks side by side.

    Each task has a normaliser of its own: one for all tasks would move with every new one, and the network would
    forget by its inputs alone.
    """

    def __init__(self, parts: Mapping[str, VecNormalize], inputs: JointInputs) -> None:
        """Join environments; `parts` are those of each task, over a `BatchVecEnv`."""
        self._parts, self._inputs = list(parts.values()), inputs
        self._columns = [inputs.columns(task) for task in parts]
        self._labels = [inputs.label(task) for task in parts]
        ends = np.cumsum([part.num_envs for part in self._parts]).tolist()
        self._rows = [slice(end - part.num_envs, end) for part, end in zip(self._parts, ends, strict=True)]
        space = observation_space(len(inputs.names))
        super().__init__(ends[-1], space, self._parts[0].action_space)

    def reset(self) -> np.ndarray:
        """Begin anew in every world; returns the normalised observations, shape (worlds, inputs)."""
        self.reset_infos = [{} for _ in range(self.num_envs)]
        seen = [np.asarray(part.reset()) for part in self._parts]
        return np.concatenate([self._joined(number, rows) for number, rows in enumerate(seen)])

    def step_async(self, actions: np.ndarray) -> None:
        """Take the actions of all worlds."""
        for part, rows in zip(self._parts, self._rows, strict=True):
            part.step_async(actions[rows])

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Move every world; returns observations, rewards, dones and infos."""
        results = [part.step_wait() for part in self._parts]
        observations = [self._joined(number, np.asarray(each[0])) for number, each in enumerate(results)]
        infos = [self._joined_info(number, info) for number, each in enumerate(results) for info in each[3]]
        rewards, dones = (np.concatenate([each[k] for each in results]) for k in (1, 2))
        return np.concatenate(observations), rewards, dones, infos

    def _joined_info(self, number: int, info: dict[str, Any]) -> dict[str, Any]:
        last = info.get("terminal_observation")
        if last is None:
            return info
        return info | {"terminal_observation": self._joined(number, last[None])[0]}

    def _joined(self, number: int, rows: np.ndarray) -> np.ndarray:
        """Observations of one task as inputs of the network."""
        joined = np.zeros((len(rows), len(self._inputs.names)), dtype=np.float32)
        joined[:, self._columns[number]] = rows
        joined[:, self._labels[number]] = 1.0
        return joined
