"""The one shape of every estimator, and what it answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from fulmar_core.wires.reading import Reading

LACKS_NOTHING = (
    "nothing"  # under the key `lacks` of a status: every sensor reports what the estimator takes of it
)


@dataclass(frozen=True, slots=True)
class Estimate:
    """What is believed at one time."""

    value: Any  # of the estimator's own type, without a batch axis; see the estimator's file
    covariance: np.ndarray  # of the value, about the axes that the estimator's file names
    stamp_ns: int  # time that it is about [ns]


class Estimator(Protocol):
    """Readings in any order of arrival to one estimate. Not thread-safe; the caller holds a lock.

    Attributes:
        outliers: Readings that were not believed.
        epoch: How often it had to begin anew.
        problem: Why there is no estimate; empty if there is one.
    """

    outliers: int
    epoch: int
    problem: str

    def reset(self) -> None:
        """Begin anew, without an estimate."""
        ...

    def take(self, name: str, reading: Reading) -> str | None:
        """Take a reading in.

        Args:
            name: Of the sensor, as the row of the estimator lists it.
            reading: With its stamp.

        Returns:
            Why it is refused; None if it is not.
        """
        ...

    def status(self) -> dict[str, str]:
        """What else there is to say of the estimate, by name, for people."""
        ...

    def warnings(self) -> tuple[str, ...]:
        """What endangers the robot now, a sentence each, for its status, diagnostics and report.

        A sentence stays the same while its cause does: it holds no figure that changes.
        """
        ...

    def estimate(self, stamp_ns: int | None = None) -> Estimate | None:
        """What is believed; None, with `problem`, without a usable estimate.

        Args:
            stamp_ns: Predict to this time, at or after the newest reading; None: the time of the newest reading [ns].
        """
        ...
