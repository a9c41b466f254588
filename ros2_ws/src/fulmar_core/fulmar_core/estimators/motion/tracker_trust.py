"""Whether star tracker and turn rate go on telling the same story: drifts, jumps and a bias beyond its data sheet.

Readings beyond the gate say that either side is wrong. Their offsets from the estimate say more: offsets that stay the
same are those of an estimate that began wrong, or of a tracker that jumped; offsets that grow evenly are a drift of one
of the two sensors; others are a tracker that sees no stars.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from fulmar_core.states.attitude import conjugate, logarithm, product

TO_BEGIN_ANEW = 10  # attitudes in a row that are no match but agree: then it is the estimate that is wrong
TO_BELIEVE_AGAIN = 10  # attitudes in a row that match, after which a doubt is over
MOST_STRANGERS = 2 * TO_BEGIN_ANEW  # attitudes in a row that are no match, before the tracker is not believed
DRIFT = 3  # attitudes in a row whose offsets grow evenly
AGREE = 16.3  # 1 pair of good readings of 1,000 differs by more: chi-squared, 3 degrees of freedom
JUMPS_APART_NS = 120_000_000_000  # a tracker that jumps twice within it is not believed
BIAS_WALK = 8.0  # standard deviations of its walk that a bias cannot reach
SCALE = (
    2e-4  # standard deviation of what a turn rate is off by, as a share of it: scales, axes, integration [-]
)
SPUN_S = 20.0  # for which errors of a fast turn may add up unseen [s]
SETTLES = 3  # biases for which what a fast turn did to them is in them
BIAS_EVERY_NS, BIAS_KEPT = 20_000_000_000, 60  # of biases that the newest is compared to, a third of an hour

DRIFTS = "star tracker and {rate} drift apart, and which of them is wrong is not known"
DRIFTS_ALONE = "the star tracker drifts against gyroscope and event cameras: it is not believed"
SCATTERS = "the star tracker's attitudes fit neither one another nor the {rate}"
JUMPS = "the star tracker jumps again and again"
WALKS = (
    "the bias of the gyroscope walks farther than its data sheet explains: gyroscope or star tracker drifts, and which "
    "of them is not known"
)
Quat = tuple[float, float, float, float]


@dataclass(frozen=True)
class KnownBias:
    """An estimated bias."""

    stamp_ns: int
    bias: np.ndarray  # [rad/s]
    covariance: np.ndarray
    fastest: float  # turn rate since the one before [rad/s]


@dataclass(frozen=True)
class Stranger:
    """An attitude beyond the gate."""

    stamp_ns: int
    offsets: tuple[Quat, Quat]  # from what was believed to what was seen: about the axes of body and world
    variance: float  # about an axis [rad²]
    rate: float  # size of the turn rate [rad/s]

    def slack(self, other: Stranger) -> float:
        """Square of an angle that noise and errors of the turn rate explain since another attitude [rad²]."""
        passed_s = (self.stamp_ns - other.stamp_ns) / 1e9
        turned = SCALE * max(self.rate, other.rate) * passed_s
        return AGREE * (self.variance + other.variance + turned**2)

    def since(self, other: Stranger) -> list[np.ndarray]:
        """How far each offset has turned since another attitude, shapes (3,) [rad]."""
        pairs = zip(other.offsets, self.offsets, strict=True)
        return [np.array(logarithm(product(conjugate(before), after))) for before, after in pairs]


class TrackerTrust:
    """Decides what becomes of attitudes that do not match.

    Attributes:
        doubt: Why there is no estimate; empty if there is one.
        warning: Why the star tracker is not believed although there is an estimate; empty if it is.
    """

    def __init__(self, drift: float) -> None:
        """Begin without a doubt.

        Args:
            drift: Of the gyroscope's bias [rad/s/√s].
        """
        self._drift = drift
        self.doubt, self.warning = "", ""
        self._latched = False  # the doubt ends with the epoch only
        self._strangers: list[Stranger] = []
        self._matches = 0
        self._jumped_ns: int | None = None
        self._biases: deque[KnownBias] = deque(maxlen=BIAS_KEPT)
        self._fastest = 0.0  # turn rate since the newest of them [rad/s]

    def match(self) -> None:
        """Note an attitude within the gate."""
        self._strangers = []
        self._matches += 1
        if self._matches >= TO_BELIEVE_AGAIN:
            self.warning = ""
            if not self._latched:
                self.doubt = ""

    def stranger(
        self,
        believed: np.ndarray,
        seen: np.ndarray,
        variance: float,
        rate: float,
        stamp_ns: int,
        source: str,
    ) -> bool:
        """Note an attitude beyond the gate; whether the estimate begins anew with it.

        Args:
            believed: Attitude at its time, a quaternion.
            seen: What the star tracker says.
            variance: Of that, about its worst axis [rad²].
            rate: Size of the turn rate [rad/s].
            stamp_ns: When [ns].
            source: What the turn rate comes from, for people; empty where two sources of it agree.
        """
        self._matches = 0
        was, its = _quat(believed), _quat(seen)
        offsets = product(conjugate(was), its), product(its, conjugate(was))
        self._strangers.append(Stranger(stamp_ns, offsets, variance, rate))
        del self._strangers[:-MOST_STRANGERS]
        if self.doubt or self.warning:
            return False
        count, alike = len(self._strangers), self._alike()
        if alike >= TO_BEGIN_ANEW:
            return self._jumps(self._strangers[-1])
        if count >= DRIFT and alike < count and self._drifts():
            if source:
                self.doubt = DRIFTS.format(rate=source)
            else:
                self.warning = DRIFTS_ALONE
        elif count >= MOST_STRANGERS or (count >= TO_BEGIN_ANEW and 2 * alike < count):
            self.doubt = SCATTERS.format(rate=source or "turn rate")
        return False

    def see_bias(self, bias: np.ndarray, covariance: np.ndarray, rate: float, stamp_ns: int) -> None:
        """Compare an estimated bias to earlier ones; what it walked must be that of a gyroscope.

        Args:
            bias: About each axis [rad/s].
            covariance: Of it, shape (3, 3).
            rate: Size of the turn rate [rad/s].
            stamp_ns: When [ns].
        """
        self._fastest = fastest = max(self._fastest, rate)
        known = list(self._biases)
        for number in range(len(known) - 1, -1, -1):
            then = known[number]
            fastest = max([fastest, *(each.fastest for each in known[max(0, number - SETTLES) : number + 1])])
            walked, passed_s = bias - then.bias, (stamp_ns - then.stamp_ns) / 1e9
            free = self._drift**2 * passed_s + (SCALE * fastest) ** 2
            most = then.covariance + covariance + free * np.eye(3)
            if float(walked @ np.linalg.solve(most, walked)) > BIAS_WALK**2:
                self._latched, self.doubt = True, WALKS
                return
        if not known or stamp_ns - known[-1].stamp_ns >= BIAS_EVERY_NS:
            self._biases.append(KnownBias(stamp_ns, bias.copy(), covariance.copy(), self._fastest))
            self._fastest = 0.0

    def _jumps(self, newest: Stranger) -> bool:
        """Whether the estimate may follow a jump: not to one after the other, but for what fast turns leave behind."""
        away = float(np.linalg.norm(logarithm(newest.offsets[0])))
        large = away > SCALE * newest.rate * SPUN_S
        again = self._jumped_ns is not None and newest.stamp_ns - self._jumped_ns < JUMPS_APART_NS
        self._jumped_ns, self._strangers = newest.stamp_ns, []
        if again and large:
            self.doubt = JUMPS
        return not again

    def _alike(self) -> int:
        """How many of the newest attitudes have the offset of the newest one, about the same axes."""
        newest = self._strangers[-1]
        counts = [0, 0]
        for axes in range(2):
            for other in reversed(self._strangers):
                apart = newest.since(other)[axes]
                if float(apart @ apart) > newest.slack(other):
                    break
                counts[axes] += 1
        return max(counts)

    def _drifts(self) -> bool:
        """Whether the offset grows evenly, from the first over the middle one to the newest."""
        first, middle, last = (self._strangers[i] for i in (0, len(self._strangers) // 2, -1))
        ratio = (last.stamp_ns - first.stamp_ns) / (middle.stamp_ns - first.stamp_ns)
        variance = last.variance + ratio**2 * middle.variance + (ratio - 1.0) ** 2 * first.variance
        for half, whole in zip(middle.since(first), last.since(first), strict=True):
            bent = whole - ratio * half
            grown = float(whole @ whole) > last.slack(first)
            if grown and float(bent @ bent) <= AGREE * variance:
                return True
        return False


def _quat(values: np.ndarray) -> Quat:
    x, y, z, w = np.asarray(values, dtype=float)
    return x, y, z, w
