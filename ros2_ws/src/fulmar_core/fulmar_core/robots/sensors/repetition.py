"""Values that do not change: a sensor that measures anew never repeats a noisy value to the last bit.

A stuck source goes on sending its last value with new stamps. Sensors without noise repeat themselves while the robot
stands: encoders, simulated sensors of a scenario without noise, channels whose quantum is greater than their noise.
"""

from __future__ import annotations

import math
from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar

import numpy as np

Spec = TypeVar("Spec")

FROZEN_AFTER = 10  # repeats of one value in a row that no noisy sensor gives
FEWEST = (
    3  # repeats that count as frozen after a time, however slow the source: fewer are messages that got lost
)


class RepetitionCheck:
    """Counts equal values in a row of one source.

    Attributes:
        repeats: How often the newest value has been repeated so far.
        frozen: Whether the source is stuck.
    """

    def __init__(self, *, after: int = FROZEN_AFTER, after_s: float = math.inf, held_s: float = 0.0) -> None:
        """Begin without a value.

        Args:
            after: Repeats after which the source is frozen; 0: it never is, as for sources without noise.
            after_s: Time that `FEWEST` or more repeats may last; for sources whose `after` repeats take too long [s].
            held_s: Time for which a sound source holds a value, as one that is published faster than it measures [s].
        """
        self._after, self._after_ns, self._held_ns = after, 1e9 * after_s, 1e9 * held_s
        self.forget()

    def forget(self) -> None:
        """Begin anew, as after a jump of time."""
        self._last: np.ndarray | None = None
        self._since_ns = 0
        self.repeats, self.frozen = 0, False

    def see(self, value: np.ndarray, stamp_ns: int) -> bool:
        """Note the next value.

        Args:
            value: What was measured, of any shape; it must not be changed later.
            stamp_ns: When [ns].

        Returns:
            Whether the source is frozen, as `frozen`. The first value that differs ends it.
        """
        if not self._after:
            return False
        if self._last is not None and np.array_equal(self._last, value):
            self.repeats += 1
        else:
            self._last, self._since_ns, self.repeats = value, stamp_ns, 0
        lasts_ns = stamp_ns - self._since_ns
        many = self.repeats >= self._after or (self.repeats >= FEWEST and lasts_ns > self._after_ns)
        self.frozen = many and lasts_ns > self._held_ns
        return self.frozen


def is_noisy(*specs: Any) -> bool:
    """Whether two measurements of one state differ: one sensor or channel has noise that its quantum does not hide."""
    return any(spec.std > getattr(spec, "quantum", 0.0) for spec in specs)


def without_noise(spec: Spec) -> Spec:
    """Specs of the same sensors without noise, as in some simulations; of one sensor or of all of a robot."""
    changes: dict[str, Any] = {}
    for field in fields(spec):  # type: ignore[arg-type]
        value = getattr(spec, field.name)
        if field.name == "std":
            changes[field.name] = 0.0
        elif is_dataclass(value):
            changes[field.name] = without_noise(value)
    return replace(spec, **changes)  # type: ignore[type-var]
