"""A step of a batch as machine code: the core's functions, traced by torch, and their pytrees."""

from __future__ import annotations

import os
import shutil
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

import torch
from torch.fx.experimental.proxy_tensor import make_fx

from fulmar_core.config.errors import ConfigError
from fulmar_core.simulation.learning_step import observed_step
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.state import State
from fulmar_core.tasks.goal import Goal
from fulmar_core.worlds.world import Drawn

# Parts beside the mutable state: the command, and the cost of the actuators' effort.
ASKED, EFFORT = "asked", "effort"
RESULTS = 3  # of `observed_step`: reward, over, observation

_NO_COMPILER = (
    "steps cannot be compiled here: that takes g++ (or what CXX names) and Python's headers. Install them (Debian: g++ "
    "and python3-dev), or do without: 'compiled: false' in training settings, `--library numpy` of the benchmark."
)


def compiler_found() -> bool:
    """Whether there is the C++ compiler that torch looks for."""
    return shutil.which(os.environ.get("CXX", "g++")) is not None


def check_compiler() -> None:
    """Reject machines without one.

    Raises:
        ConfigError: There is no compiler.
    """
    if not compiler_found():
        raise ConfigError(_NO_COMPILER)


@dataclass(frozen=True)
class Kernel:
    """A step as a pure function of tensors."""

    # Of the leaves of all parts; returns the results, then new leaves.
    run: Callable[..., Sequence[torch.Tensor]]
    # Parts that a step replaces, by the places of their leaves among those that were given, and then those returned.
    replaced: dict[str, tuple[int, ...]]
    numbers: dict[str, float]  # parts that are the same number after every step


def kernel_of(twin: BatchSimulation, parts: Parts) -> Kernel:
    """Compile a step of worlds; torch caches kernels on disk by what they compute.

    Args:
        twin: The same batch in torch, after one step, so that its caches are filled; its state is used up.
        parts: The input of a step: ASKED, EFFORT and the mutable state, as tensors of the kernel's shapes, types and
            strides.

    Raises:
        ConfigError: The compiler fails.
    """
    given = [leaf for part in parts.values() for leaf in leaves(part)]
    trace = _Trace(twin, parts)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        graph = make_fx(trace, tracing_mode="fake", _allow_non_fake_inputs=True)(*given)
        run = _compiled(graph, given)
    return Kernel(run, trace.replaced, trace.numbers)


def _compiled(
    graph: torch.fx.GraphModule, given: list[torch.Tensor]
) -> Callable[..., Sequence[torch.Tensor]]:
    import torch._inductor as inductor  # takes 1 s, only where it is used
    from torch._inductor.exc import InductorError

    try:
        return inductor.standalone_compile(graph, given, dynamic_shapes="from_example_inputs")
    except InductorError as error:
        raise ConfigError(f"{_NO_COMPILER} torch says: {str(error).splitlines()[0]}") from None


class _Trace:
    """A step of leaves that records the new leaves of each part."""

    def __init__(self, twin: BatchSimulation, parts: Parts) -> None:
        self._twin, self._parts = twin, parts
        self.replaced: dict[str, tuple[int, ...]] = {}
        self.numbers: dict[str, float] = {}

    def __call__(self, *given: torch.Tensor) -> list[torch.Tensor]:
        """The results, and the new leaves."""
        each = iter(given)
        before = {name: rebuilt(part, each) for name, part in self._parts.items()}
        twin = self._twin
        twin.take(moving_of(before))
        results = observed_step(twin, before[ASKED], effort=before[EFFORT])
        places = _Places(given, results)
        for name, part in parts_of(twin.mutable_state()).items():
            if isinstance(part, float):
                self.numbers[name] = part
            elif part is not before[name]:
                self.replaced[name] = places.of(leaves(part), leaves(before[name]))
        return places.returned


class _Places:
    """Positions of tensors among the inputs, and then the outputs."""

    def __init__(self, given: Sequence[torch.Tensor], results: Sequence[torch.Tensor]) -> None:
        self.returned = list(results)
        self._given = len(given)
        self._known = list(zip(given, range(len(given)), strict=True))

    def of(self, new: Sequence[torch.Tensor], old: Sequence[torch.Tensor]) -> tuple[int, ...]:
        """Positions of a part's leaves; new ones become outputs."""
        return tuple(self._place(tensor, like) for tensor, like in zip(new, old, strict=True))

    def _place(self, tensor: torch.Tensor, like: torch.Tensor) -> int:
        for known, place in self._known:
            if known is tensor:
                return place
        place = self._given + len(self.returned)
        self._known.append((tensor, place))
        self.returned.append(_laid_as(tensor, like))
        return place


def _laid_as(tensor: torch.Tensor, like: torch.Tensor) -> torch.Tensor:
    """The same numbers, side by side in memory as in another tensor, so that the next step takes the same kernel.

    Raises:
        TypeError: Shape or type differ; steps must keep both.
    """
    if (tensor.shape, tensor.dtype) != (like.shape, like.dtype):
        raise TypeError(f"a step made {tensor.shape}, {tensor.dtype} of {like.shape}, {like.dtype}")
    if tensor.stride() == like.stride():
        return tensor
    return torch.empty_strided(like.shape, like.stride(), dtype=like.dtype, device=like.device).copy_(tensor)


Moving = dict[str, Any]  # as in `MutableState.mutable_state`, with dictionaries in it
Parts = dict[str, Any]  # the same without; what was in a dictionary has a name of two words


def parts_of(moving: Moving) -> Parts:
    """A mutable state with its dictionaries flattened."""
    parts: Parts = {}
    for name, value in moving.items():
        if isinstance(value, dict):
            parts |= {f"{name} {inner}": part for inner, part in value.items()}
        else:
            parts[name] = value
    return parts


def moving_of(parts: Parts) -> Moving:
    """The inverse of `parts_of`."""
    moving: Moving = {}
    for name, part in parts.items():
        outer, _, inner = name.partition(" ")
        if inner:
            moving.setdefault(outer, {})[inner] = part
        else:
            moving[name] = part
    return moving


def leaves(part: Any) -> tuple[Any, ...]:
    """Arrays and numbers of a part; nothing has none."""
    if isinstance(part, State):
        return part.columns()
    if isinstance(part, Drawn):
        return part.parts()
    if isinstance(part, Goal):
        return part.arrays()
    if isinstance(part, (tuple, list)):
        return tuple(chain.from_iterable(leaves(inner) for inner in part))
    return () if part is None else (part,)


def rebuilt(part: Any, new: Iterator[Any]) -> Any:
    """A part of the same kind with other leaves, as many as `leaves` finds, in its order."""
    if isinstance(part, Goal):
        return part.mapped(lambda _: next(new))
    if isinstance(part, State | Drawn):
        return part.mapped(lambda _: next(new))
    if isinstance(part, (tuple, list)):
        return type(part)(rebuilt(inner, new) for inner in part)
    return None if part is None else next(new)
