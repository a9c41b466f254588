"""The array API for the plain numbers of one robot: a tenth of the cost of arrays of one number, and the same bits.

Sums, products and square roots are rounded by IEEE 754 everywhere. Other functions are NumPy's: those of `math` differ
from them in the last bit. What is not here is NumPy's own, and makes arrays or its scalars.
"""

from __future__ import annotations

import math
from typing import Any

import array_api_compat
import numpy as np

_NUMPY = array_api_compat.array_namespace(np.float64(0.0))


def __getattr__(name: str) -> Any:
    return getattr(_NUMPY, name)


def sqrt(x: float) -> float:
    """Square root; NaN of negative numbers."""
    return math.nan if x < 0.0 else math.sqrt(x)


def exp(x: float) -> float:
    """See the module."""
    return float(np.exp(x))


def log(x: float) -> float:
    """See the module."""
    return float(np.log(x))


def sin(x: float) -> float:
    """See the module."""
    return float(np.sin(x))


def cos(x: float) -> float:
    """See the module."""
    return float(np.cos(x))


def asin(x: float) -> float:
    """See the module."""
    return float(np.arcsin(x))


def atan2(y: float, x: float) -> float:
    """See the module."""
    return float(np.arctan2(y, x))


def pow(x: float, exponent: float) -> float:
    """See the module; the operator ** is another function for plain numbers than for arrays."""
    return float(np.power(x, exponent))


def where(condition: bool, x: float, other: float) -> float:
    """One of two numbers."""
    return x if condition else other


def abs(x: float) -> float:
    """Size of a number."""
    return math.fabs(x)


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
