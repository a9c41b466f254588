"""A step of many worlds as one compiled kernel: the core's own functions, traced and compiled by torch.

What a step computes is defined once, in the core. NumPy carries it out array by array; here torch writes one loop over
the worlds, which a C++ compiler makes machine code of. Both draw the same random numbers, and differ by rounding.
"""

from __future__ import annotations

import os
import shutil
import warnings
from collections.abc import Callable
from dataclasses import fields, replace
from functools import partial
from typing import Any

import numpy as np
import torch

from fulmar_core.disturbances.world import World
from fulmar_core.errors import ConfigError
from fulmar_core.goal import Goal
from fulmar_core.learning_step import observed_step
from fulmar_core.planar import PlanarState
from fulmar_core.robot import Robot
from fulmar_core.rotation import Array
from fulmar_core.simulation import BatchSimulation
from fulmar_core.tasks import Task

Moving = dict[str, Any]  # as of `Moves.moving`
ObservedStep = Callable[..., tuple[Array, Array, Array]]  # `observed_step` of one batch

_NO_COMPILER = (
    "steps cannot be compiled here: that takes g++ (or what CXX names) and Python's headers. Install them (Debian: g++ "
    "and python3-dev), or do without: 'compiled: false' in training settings, `--library numpy` of the benchmark."
)


def compiler_found() -> bool:
    """Whether there is the C++ compiler that torch looks for."""
    return shutil.which(os.environ.get("CXX", "g++")) is not None


def step_of(batch: BatchSimulation, *, compiled: bool) -> ObservedStep:
    """How a batch moves: array by array, or as a compiled kernel."""
    return CompiledStep(batch) if compiled else partial(observed_step, batch)


class CompiledStep:
    """`observed_step` of one batch that lives in NumPy.

    What torch sees is a twin of the batch, whose tensors are the batch's own memory. Episodes begin in NumPy, where a
    few worlds at a time cost least.
    """

    def __init__(self, batch: BatchSimulation) -> None:
        """Prepare; what is not compiled yet is compiled at the first step, which takes 10 to 30 s.

        Raises:
            ConfigError: There is no compiler.
        """
        if not compiler_found():
            raise ConfigError(_NO_COMPILER)
        self._batch = batch
        self._twin = BatchSimulation(
            batch.robot, batch.task, batch.scenario, worlds=batch.worlds, seed=batch.seed, xp=torch
        )
        self._twin.step(torch.from_numpy(np.array(batch.command)))  # fills caches, which cannot be traced
        self._compiled = torch.compile(observed_step, fullgraph=True, dynamic=False)
        self._asked: Robot | None = None  # as it was passed last,
        self._judge = batch.robot  # and as torch sees that one
        self._arrays: Moving = {}  # of the batch, and of the twin, when both were last the same
        self._tensors: Moving = {}

    def __call__(
        self, command: np.ndarray, *, robot: Robot, task: Task
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Move the batch one control step; arguments and results as of `observed_step`.

        Raises:
            ConfigError: The compiler fails.
        """
        batch, twin = self._batch, self._twin
        arrays = batch.moving()
        given = _renewed(arrays, self._arrays, self._tensors, _tensor)
        twin.take(given)
        with torch.no_grad(), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                told = self._compiled(twin, _tensor(command), robot=self._judging(robot), task=task)
            except RuntimeError as error:
                from torch._dynamo.exc import BackendCompilerFailed  # 1.5 s, which nobody else shall wait for

                if not isinstance(error, BackendCompilerFailed):
                    raise
                raise ConfigError(f"{_NO_COMPILER} torch says: {str(error).splitlines()[0]}") from None
        self._tensors = twin.moving()
        self._arrays = _renewed(self._tensors, given, arrays, _array)
        batch.take(self._arrays)
        reward, over, seen = (_array(part) for part in told)
        return reward, over, seen

    def _judging(self, robot: Robot) -> Robot:
        """The robot with a cost that may change without being compiled anew, as a number in the kernel would be."""
        if robot is not self._asked:
            self._asked, costs = robot, replace(robot.costs, effort=torch.tensor(robot.costs.effort))
            self._judge = replace(robot, costs=costs)
        return self._judge


def _renewed(now: Moving, before: Moving, converted: Moving, convert: Callable[[Any], Any]) -> Moving:
    """What moves now, converted; what is the same object as before was converted before."""
    renewed: Moving = {}
    for name, value in now.items():
        if isinstance(value, dict):
            renewed[name] = _renewed(value, before.get(name, {}), converted.get(name, {}), convert)
        elif name in before and value is before[name]:
            renewed[name] = converted[name]
        else:
            renewed[name] = _converted(value, convert)
    return renewed


def _converted(value: Any, convert: Callable[[Any], Any]) -> Any:
    """The same with every array converted."""
    if isinstance(value, (np.ndarray, torch.Tensor)):
        return convert(value)
    if isinstance(value, (tuple, list)):
        return type(value)(_converted(part, convert) for part in value)
    if isinstance(value, (PlanarState, Goal, World)):
        return type(value)(*(convert(getattr(value, field.name)) for field in fields(value) if field.init))
    return value


def _tensor(array: np.ndarray) -> torch.Tensor:
    """The same memory; torch computes with words of 32 bits only where they have a sign."""
    return torch.from_numpy(array.view(np.int32) if array.dtype == np.uint32 else array)


def _array(tensor: torch.Tensor) -> np.ndarray:
    """The same memory."""
    array: np.ndarray = tensor.numpy()
    return array.view(np.uint32) if array.dtype == np.int32 else array
