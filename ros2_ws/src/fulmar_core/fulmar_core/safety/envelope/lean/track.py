"""Where the samples of a rollout come to, and how near to the bounds that is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.safety.envelope.room import FENCE
from fulmar_core.safety.geofence import NO_AREA


@dataclass(frozen=True)
class Track:
    """Places of n robots with k samples each, in the plane as complex numbers x + iy [m].

    Attributes:
        places: After each step, shape (steps, n, k).
        rate: Largest turn rate of the samples after the controller's step, shape (n,) [rad/s].
        speed: Likewise [m/s].
    """

    places: np.ndarray
    rate: np.ndarray
    speed: np.ndarray

    @property
    def ends(self) -> np.ndarray:
        """Where the samples stop on average, shape (n, 3) [m]."""
        end = self.places[-1].mean(axis=-1)
        return np.stack((end.real, end.imag, np.zeros(len(end))), axis=-1)


class PlaneBounds:
    """An area and a geofence in the plane.

    Attributes:
        low: Least coordinates of the area, shape (2,) or, without an area, (0,) [m].
        high: Greatest ones, same shape.
        names: Of the bounds.
    """

    def __init__(self, area: tuple[float, ...], fence: float) -> None:
        """Take the sides in the form of `check_area`, and the farthest from the goal; infinite for none [m]."""
        bounded = tuple(area) != NO_AREA
        self.low = np.array(area[0::2]) if bounded else np.zeros(0)
        self.high = np.array(area[1::2]) if bounded else np.zeros(0)
        axes = "xy" if bounded else ""
        self.names = (*(f"{axis}_min" for axis in axes), *(f"{axis}_max" for axis in axes), FENCE)
        self._fence = fence

    def distances(self, places: np.ndarray, goal: np.ndarray | None) -> np.ndarray:
        """Least distance to each bound over all steps and samples, negative beyond it, shape (n, bounds) [m].

        Args:
            places: As in `Track`.
            goal: Where the geofence is centred, shape (n, 3); None: nowhere [m].
        """
        far: list[np.ndarray] = []
        if len(self.low):
            x, y = places.real, places.imag
            far += [part.min(axis=(0, 2)) - low for part, low in zip((x, y), self.low, strict=True)]
            far += [high - part.max(axis=(0, 2)) for part, high in zip((x, y), self.high, strict=True)]
        if goal is not None and np.isfinite(self._fence):
            middle = (goal[:, 0] + 1j * goal[:, 1])[None, :, None]
            far.append(self._fence - np.abs(places - middle).max(axis=(0, 2)))
        else:
            far.append(np.full(places.shape[1], np.inf))
        return np.stack(far, axis=-1)
