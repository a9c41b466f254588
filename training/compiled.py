"""A batch in NumPy that steps by a compiled kernel.

The core defines the step once. NumPy computes it array by array; here torch writes one loop over the worlds, and a C++
compiler makes machine code of it. Both draw the same random numbers, and differ by rounding.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import torch

from fulmar_core.simulation.learning_step import observed_step
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.rotation import Array
from training.kernel import (
    ASKED,
    EFFORT,
    RESULTS,
    Kernel,
    check_compiler,
    kernel_of,
    leaves,
    moving_of,
    parts_of,
    rebuilt,
)

ObservedStep = Callable[..., tuple[Array, Array, Array]]  # `observed_step` of one batch
Form = tuple[Any, ...]  # type, shape and strides of each leaf of a part


def step_of(batch: BatchSimulation, *, compiled: bool) -> ObservedStep:
    """The step of a batch: array by array, or as a compiled kernel."""
    return CompiledStep(batch) if compiled else partial(observed_step, batch)


@dataclass(slots=True)
class _Viewed:
    """A part of the input of a step, with the memory of its leaves as NumPy arrays and torch tensors."""

    part: Any
    arrays: tuple[Any, ...]
    tensors: tuple[torch.Tensor, ...]
    form: Form


class CompiledStep:
    """`observed_step` of one batch that lives in NumPy.

    Kernels work on the batch's own memory. Episodes begin in NumPy, where a few worlds at a time cost least.
    """

    def __init__(self, batch: BatchSimulation) -> None:
        """Prepare; the first step compiles the kernel, in 5 to 20 s, unless torch has it on disk.

        Raises:
            ConfigError: There is no compiler.
        """
        check_compiler()
        self._batch = batch
        self._seen: dict[str, _Viewed] = {}  # every part, as of the last step
        self._kernels: dict[tuple[Form, ...], Kernel] = {}
        self._last: Kernel | None = None  # while the forms of all parts stay

    def __call__(self, command: np.ndarray, *, effort: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Move the batch one control step; arguments and results as in `observed_step`.

        Raises:
            ConfigError: The compiler fails.
        """
        moving = parts_of(self._batch.mutable_state())
        viewed = self._view({ASKED: command, EFFORT: effort} | moving)
        kernel = self._kernel()
        tensors = [tensor for one in viewed.values() for tensor in one.tensors]
        arrays = [array for one in viewed.values() for array in one.arrays]
        returned = kernel.run(*tensors)
        given = len(tensors)
        tensors += returned
        arrays += [_array(tensor) for tensor in returned]
        for name, places in kernel.replaced.items():
            one = viewed[name]
            one.tensors = tuple([tensors[place] for place in places])
            one.arrays = tuple([arrays[place] for place in places])
            one.part = moving[name] = rebuilt(one.part, iter(one.arrays))
        self._batch.take(moving_of(moving | kernel.numbers))
        reward, over, observed = arrays[given : given + RESULTS]
        return reward, over, observed

    def _view(self, parts: dict[str, Any]) -> dict[str, _Viewed]:
        """All parts; what is the same object as before was viewed before."""
        viewed = self._seen
        for name, part in parts.items():
            if name not in viewed or part is not viewed[name].part:
                arrays = leaves(part)
                tensors = tuple([_tensor(array) for array in arrays])
                form = tuple([(tensor.dtype, tensor.shape, tensor.stride()) for tensor in tensors])
                if name not in viewed or form != viewed[name].form:
                    self._last = None
                viewed[name] = _Viewed(part, arrays, tensors, form)
        return viewed

    def _kernel(self) -> Kernel:
        """The kernel for parts of these forms."""
        if self._last is None:
            forms = tuple(one.form for one in self._seen.values())
            if forms not in self._kernels:
                self._kernels[forms] = self._compiled()
            self._last = self._kernels[forms]
        return self._last

    def _compiled(self) -> Kernel:
        batch = self._batch
        twin = BatchSimulation(
            batch.robot,
            batch.task,
            batch.scenario,
            worlds=batch.worlds,
            seed=batch.seed,
            control_hz=1.0 / batch.control_dt,
            xp=torch,
        )
        twin.step(_tensor(np.array(batch.command)))  # fills the caches of later steps
        return kernel_of(
            twin, {name: rebuilt(one.part, iter(one.tensors)) for name, one in self._seen.items()}
        )


def _tensor(leaf: np.ndarray | float) -> torch.Tensor:
    """The same memory, or a number; torch computes with words of 32 bits only where they have a sign."""
    if isinstance(leaf, (int, float)):
        return torch.tensor(leaf)
    return torch.from_numpy(leaf.view(np.int32) if leaf.dtype == np.uint32 else leaf)


def _array(tensor: torch.Tensor) -> np.ndarray:
    """The same memory."""
    array: np.ndarray = tensor.numpy()
    return array.view(np.uint32) if array.dtype == np.int32 else array
