"""The array API for the plain numbers of one robot: a tenth of the cost of arrays of one number, and the same bits.

Sums, products and square roots are rounded by IEEE 754 everywhere. Other functions are NumPy's: those of `math` differ
from them in the last bit. What is not here is NumPy's own, and makes arrays or its scalars. Where the first part of a
vector is a number and others are arrays, these come through as NumPy has them.
"""

from __future__ import annotations

import math
from typing import Any

import array_api_compat
import numpy as np

_NUMPY = array_api_compat.array_namespace(np.float64(0.0))


def __getattr__(name: str) -> Any:
    return getattr(_NUMPY, name)


def _number(found: Any) -> Any:
    """A plain number of NumPy's scalar; an array as it is."""
    return found if isinstance(found, np.ndarray) else float(found)


def sqrt(x: Any) -> Any:
    """Square root; NaN of negative numbers."""
    if type(x) is not float:
        return np.sqrt(x)
    return math.nan if x < 0.0 else math.sqrt(x)


def exp(x: float) -> Any:
    """See the module."""
    return _number(np.exp(x))


def log(x: float) -> Any:
    """See the module."""
    return _number(np.log(x))


def sin(x: float) -> Any:
    """See the module."""
    return _number(np.sin(x))


def cos(x: float) -> Any:
    """See the module."""
    return _number(np.cos(x))


def asin(x: float) -> Any:
    """See the module."""
    return _number(np.arcsin(x))


def atan2(y: float, x: float) -> Any:
    """See the module."""
    return _number(np.arctan2(y, x))


def pow(x: float, exponent: float) -> Any:
    """See the module; the operator ** is another function for plain numbers than for arrays."""
    return _number(np.power(x, exponent))


def where(condition: Any, x: Any, other: Any) -> Any:
    """One of two numbers."""
    if isinstance(condition, np.ndarray):
        return np.where(condition, x, other)
    return x if condition else other


def abs(x: Any) -> Any:
    """Size of a number."""
    return math.fabs(x) if type(x) is float else np.abs(x)


def zeros_like(_x: float) -> float:
    """The number 0."""
    return 0.0


def ones_like(_x: float) -> float:
    """The number 1."""
    return 1.0


def clip(x: float, low: float | None, high: float | None) -> float:
    """A number cut to [low, high], None for an open end; of zeros of either sign NumPy's choice."""
    if high is None:
        return low if low is not None and x <= low else x
    if low is None:
        return high if x >= high else x
    return low if x < low else high if x > high else x
