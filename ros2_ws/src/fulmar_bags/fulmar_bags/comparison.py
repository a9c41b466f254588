"""Two recordings of the same thing, number by number: where they first differ, by how much, how often."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from fulmar_core.errors import ConfigError, UnknownNameError


@dataclass(frozen=True)
class Field:
    """One number over all steps."""

    field: str  # such as `action`
    name: str  # such as `thruster_1`
    compared: int  # steps where both have it
    differing: int  # steps where they differ by more than the tolerance, or one alone has it
    tolerance: float
    first_step: int | None  # where they first differ
    first_stamp_s: float | None  # [s]
    recorded: float | None  # there
    found: float | None  # there
    difference: dict[str, float] | None  # p50, p99 and max of the absolute difference

    @property
    def same(self) -> bool:
        """Whether nothing differs."""
        return self.differing == 0


def compare(
    field: str,
    names: Sequence[str],
    recorded: np.ndarray,
    found: np.ndarray,
    stamp_ns: np.ndarray,
    tolerance: float = 0.0,
) -> list[Field]:
    """Compare one kind of vector.

    Args:
        field: What it is called.
        names: Of its entries.
        recorded: Shape (n, m), NaN where there is none.
        found: Same.
        stamp_ns: Of the steps, shape (n,) [ns].
        tolerance: Largest difference that counts as the same; 0 asks for the same bits.

    Returns:
        One line for each entry.
    """
    return [
        _field(field, name, recorded[:, i], found[:, i], stamp_ns, tolerance) for i, name in enumerate(names)
    ]


def _field(
    field: str, name: str, recorded: np.ndarray, found: np.ndarray, stamp_ns: np.ndarray, tolerance: float
) -> Field:
    here, there = ~np.isnan(recorded), ~np.isnan(found)
    both = here & there
    gap = np.zeros(len(recorded))
    with np.errstate(invalid="ignore"):  # infinite in both
        gap[both] = np.abs(found[both] - recorded[both])
    if tolerance == 0.0:
        same_bits = _bits(recorded) == _bits(found)
        differs = np.where(both, ~same_bits, here != there)
    else:
        differs = np.where(both, ~((gap <= tolerance) | (recorded == found)), here != there)
    first = int(np.argmax(differs)) if differs.any() else None
    spread = None
    if both.any():
        finite = gap[both][np.isfinite(gap[both])]
        if len(finite):
            p50, p99 = np.percentile(finite, (50, 99))
            spread = {"p50": float(p50), "p99": float(p99), "max": float(finite.max())}
    return Field(
        field,
        name,
        int(both.sum()),
        int(differs.sum()),
        tolerance,
        first,
        float(stamp_ns[first]) / 1e9 if first is not None else None,
        _known(recorded[first]) if first is not None else None,
        _known(found[first]) if first is not None else None,
        spread,
    )


def _bits(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values, dtype="<f8").view("<i8")


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def first_difference(fields: Sequence[Field]) -> Field | None:
    """The field that differs first; of several at one step, the first in the list."""
    differing = [each for each in fields if each.first_step is not None]
    return min(differing, key=lambda each: each.first_step or 0) if differing else None


def as_json(fields: Sequence[Field]) -> list[dict[str, Any]]:
    """Lines for JSON."""
    return [asdict(each) for each in fields]


def read_tolerances(texts: Sequence[str], fields: Sequence[str]) -> Mapping[str, float]:
    """Read tolerances.

    Args:
        texts: `1e-6` for every field, `action=1e-6` for one; later ones win.
        fields: Names that are known.

    Returns:
        Tolerance of each field, 0 where nothing was said.

    Raises:
        ConfigError: No number, a negative one, or an unknown field.
    """
    found = dict.fromkeys(fields, 0.0)
    for text in texts:
        name, _, number = text.rpartition("=")
        try:
            value = float(number)
        except ValueError:
            value = -1.0
        if not 0.0 <= value < np.inf:
            raise ConfigError(
                f"--tolerance {text}: must be a number of at least 0, or FIELD=NUMBER. "
                f"Example: --tolerance {fields[0]}=1e-6"
            )
        if name and name not in found:
            raise UnknownNameError("field", name, fields)
        for each in [name] if name else list(fields):
            found[each] = value
    return found
