"""Time that a robot loses where it starts, stops, or changes from ahead to astern: it must speed up and slow down."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_FAR = 500.0  # largest exponent


@dataclass(frozen=True)
class Surge:
    """A hull on a straight, with drag that grows with the square of its speed: m u' = F - q |u| u.

    With next to no drag it is a robot on wheels, whose speed changes evenly.
    """

    mass: float  # with the water that moves along [kg]
    drag: float  # q, > 0 [N per (m/s)²]
    ahead: float  # largest force ahead [N]
    astern: float  # largest force astern [N]

    def force(self, sign: np.ndarray | float) -> np.ndarray:
        """Largest force in the direction of travel (1: ahead, -1: astern) [N]."""
        return np.where(np.asarray(sign) > 0.0, self.ahead, self.astern)

    def starting(self, length: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Least time for the first so many metres from rest [s]."""
        share = -np.expm1(-np.minimum(self._rate * length, _FAR))
        # With x the root of `share`, artanh x = ln(1 + x) - ln(1 - x²) / 2, and 1 - x² is the exponential.
        root = np.sqrt(share)
        artanh = np.log1p(root) + 0.5 * np.minimum(self._rate * length, _FAR)
        return np.asarray(self.mass / np.sqrt(self.drag * force) * artanh)

    def stopping(self, length: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Least time for the last so many metres to rest, against a braking force [s]."""
        root = np.sqrt(np.expm1(np.minimum(self._rate * length, _FAR)))
        return np.asarray(self.mass / np.sqrt(self.drag * force) * np.arctan(root))

    def starting_length(self, speed: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Way until a speed is reached, infinite if it never is [m]."""
        share = np.minimum(self.drag * speed * speed / force, 1.0)
        with np.errstate(divide="ignore"):
            return np.asarray(-np.log1p(-share) / self._rate)

    def stopping_length(self, speed: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Way in which a speed is lost [m]."""
        return np.asarray(np.log1p(self.drag * speed * speed / force) / self._rate)

    def turning_point(self, length: np.ndarray, driving: np.ndarray, braking: np.ndarray) -> np.ndarray:
        """Where a hull that goes from rest to rest as fast as it can begins to brake [m]."""
        grown = np.exp(np.minimum(self._rate * length, _FAR))
        return np.asarray(np.log((driving + braking * grown) / (driving + braking)) / self._rate)

    @property
    def _rate(self) -> float:
        return 2.0 * self.drag / self.mass


def time_lost(
    surge: Surge, lengths: np.ndarray, speeds: np.ndarray, stops: np.ndarray, signs: np.ndarray
) -> np.ndarray:
    """Least time that stops cost, beyond that of a leg's pieces at their speeds.

    Between two stops a hull needs at least as long as on a straight, whatever it turns: from the first stop to any
    place the time of starting, from any place to the second that of stopping.

    Args:
        surge: The hull.
        lengths: Of the pieces in their order, shape (3, n) [m].
        speeds: At which they are gone through, > 0, broadcasts with (3, n) [m/s].
        stops: Whether the hull stops before each piece and after the last, broadcasts with (4, n).
        signs: Direction of each piece: 1 ahead, -1 astern, broadcasts with (3, n).

    Returns:
        Shape (n,) [s].
    """
    n = lengths.shape[1]
    speeds, signs = np.broadcast_to(speeds, (3, n)), np.broadcast_to(signs, (3, n))
    stops = np.broadcast_to(stops, (4, n))
    driving, braking = surge.force(signs), surge.force(-signs)
    rests_before, rests_after = [stops[0]], [stops[3]]
    before, after = [np.zeros(n)], [np.zeros(n)]  # rest of the stretch
    for i in (1, 2):
        rests_before.append(stops[i] | rests_before[-1])
        before.append(np.where(stops[i], 0.0, before[-1] + lengths[i - 1]))
    for i in (1, 0):
        rests_after.insert(0, stops[i + 1] | rests_after[0])
        after.insert(0, np.where(stops[i + 1], 0.0, after[0] + lengths[i + 1]))
    total = np.zeros(n)
    for ahead in (True, False):
        order = (0, 1, 2) if ahead else (2, 1, 0)
        rests, done = (rests_before, before) if ahead else (rests_after, after)
        lost, steady = np.zeros(n), np.zeros(n)
        for number, i in enumerate(order):
            if number:
                stop = stops[i] if ahead else stops[i + 1]
                total += np.where(stop, lost, 0.0)
                lost, steady = np.where(stop, 0.0, lost), np.where(stop, 0.0, steady)
            if np.any(rests[i]):
                whole = before[i] + lengths[i] + after[i]
                half = surge.turning_point(whole, driving[i], braking[i])
                limit = np.where(rests_before[i] & rests_after[i], half if ahead else whole - half, np.inf)
                force = driving[i] if ahead else braking[i]
                gained = (surge.starting_length if ahead else surge.stopping_length)(speeds[i], force)
                reach = np.maximum(np.minimum(np.minimum(done[i] + lengths[i], gained), limit), 0.0)
                time = (surge.starting if ahead else surge.stopping)(reach, force)
                new = time - steady - (reach - done[i]) / speeds[i]
                lost = np.where(rests[i] & (reach >= done[i]), np.maximum(lost, new), lost)
            steady = steady + lengths[i] / speeds[i]
        total += lost
    return total
