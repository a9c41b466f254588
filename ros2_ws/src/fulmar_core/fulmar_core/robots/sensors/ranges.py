"""Words for readings that no device gives: numbers that are not finite, beyond a range, or without their name."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

UNIT_QUATERNION = 0.01  # how far the length of a quaternion may be from 1 [-]


def named_problem(what: str, names: Sequence[str], values: np.ndarray, ranges: Mapping[str, float]) -> str:
    """Why named values are no reading of a device; values of other names do not count.

    Args:
        what: Of the values, in the singular, such as `wheel`.
        names: One for each value.
        values: Shape (n,).
        ranges: Largest size of each value that is needed, by its name.
    """
    if len(names) != len(values):
        return f"{len(names)} names have {len(values)} values"
    repeated = sorted({name for name in names if name in ranges and list(names).count(name) > 1})
    if repeated:
        return f"{what} {', '.join(repeated)} comes more than once"
    missing = [name for name in ranges if name not in names]
    if missing:
        return f"{what} {', '.join(missing)} {'is' if len(missing) == 1 else 'are'} missing"
    by_name = dict(zip(names, values.tolist(), strict=True))
    return size_problem((f"{what} {name}", by_name[name], most) for name, most in ranges.items())


def in_order(names: Sequence[str], values: np.ndarray, wanted: Sequence[str]) -> np.ndarray:
    """Those of some named values that are wanted, in that order."""
    by_name = dict(zip(names, values.tolist(), strict=True))
    return np.array([by_name[name] for name in wanted], dtype=float)


def size_problem(values: Iterable[tuple[str, float, float]]) -> str:
    """Why numbers, each with its name and its largest size, lie outside of what a device can say."""
    for name, value, most in values:
        if not math.isfinite(value):
            return f"{name} reports a value that is not finite"
        if abs(value) > most:
            return f"{name} reports {value:.6g}, and can report {most:.6g} at most"
    return ""


def attitude_problem(quat: Any) -> str:
    """Why four numbers are no attitude: all zero stands for one that is not given."""
    quat = np.asarray(quat, dtype=float)
    if quat.shape != (4,) or not np.isfinite(quat).all():
        return "its quaternion holds a value that is not finite"
    with np.errstate(over="ignore"):
        norm = float(np.linalg.norm(quat))
    if norm == 0.0:
        return "it gives no attitude: its quaternion is zero"
    return "" if abs(norm - 1.0) <= UNIT_QUATERNION else f"its quaternion has norm {norm:.3g}, must be 1"


def covariance_problem(covariance: np.ndarray | None) -> str:
    """Why a matrix is the covariance of no reading; none at all is fine."""
    if covariance is None:
        return ""
    if not np.isfinite(covariance).all() or not np.allclose(covariance, covariance.T, rtol=1e-6, atol=1e-30):
        return "its covariance is not finite, or not symmetric"
    if covariance.any() and float(np.linalg.eigvalsh(covariance)[0]) <= 0.0:
        return "its covariance is not positive"
    return ""
