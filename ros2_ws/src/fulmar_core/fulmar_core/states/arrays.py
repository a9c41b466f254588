"""What the array API lacks, or what its wrappers make slow for single states of a robot and for small batches."""

from __future__ import annotations

from typing import Any

import array_api_compat
import numpy as np

from fulmar_core.states import plain_numbers

# Of each kind of array that was met.
_NAMESPACES: dict[type, Any] = {float: plain_numbers}
FEW = 8  # robots side by side up to which copying an array twice costs less than `stack`


def array_namespace(array: Any) -> Any:
    """The library of an array. `array_api_compat` is asked once for each kind: asking costs as much as an addition."""
    kind = type(array)
    if kind not in _NAMESPACES:
        _NAMESPACES[kind] = array_api_compat.array_namespace(array)
    return _NAMESPACES[kind]


def is_numpy(array: Any) -> bool:
    """Whether an array or number is NumPy's."""
    return isinstance(array, (np.ndarray, np.generic))


def is_number(value: Any) -> bool:
    """Whether it is a plain number, as of one robot, and no array or number of NumPy's."""
    return type(value) is float


def is_single(array: Any) -> bool:
    """Whether it is of one robot, shape (1,), in the type of plain numbers, with which the robot may be computed."""
    return isinstance(array, np.ndarray) and array.shape == (1,) and array.dtype == np.float64


def side_by_side(*parts: Any) -> Any:
    """Arrays of one shape along a new last axis, in C order; of one robot at an eighth of the cost of `stack`."""
    first = parts[0]
    if is_number(first):
        return np.array(parts)
    if is_numpy(first) and first.ndim < 2 and first.size <= FEW:
        both = np.array(parts)
        return both.T.copy() if first.ndim else both
    return array_namespace(first).stack(parts, axis=-1)


def clip(x: Any, low: Any, high: Any) -> Any:
    """Values cut to [low, high]; None leaves an end open. A tenth of the wrapped function's cost on short arrays."""
    return plain_numbers.clip(x, low, high) if is_number(x) else x.clip(low, high)


def power(x: Any, exponent: float) -> Any:
    """Numbers to some power, with the bits of an array for plain ones, whose operator is another function."""
    return plain_numbers.pow(x, exponent) if is_number(x) else x**exponent


def sum_of(parts: list[Any]) -> Any:
    """Sum of arrays, halves first, as NumPy adds up a row of eight; many short rows it sums a row at a time."""
    middle = len(parts) // 2
    return sum_of(parts[:middle]) + sum_of(parts[middle:]) if middle else parts[0]
