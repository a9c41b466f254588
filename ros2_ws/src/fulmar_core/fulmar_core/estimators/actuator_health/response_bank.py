"""Which part of a robot died or stuck, by how well each hypothesis explains the newest seconds.

What is measured is linear in what parts should do: y = Σ share_i · expected_i + offset_i · shape_i + push, plus noise.
A sound part has a share near 1 and no offset, a dead one a share of 0, a stuck one a share of 0 and some offset. Each
hypothesis is a Gaussian prior of these coefficients, and the measurements of a short window give its evidence (Bayesian
model comparison; Bishop 2006, "Pattern Recognition and Machine Learning", §3.4). What was learned before that window,
of a constant push and of shares that are not quite 1, is the prior of them all.
"""

from __future__ import annotations

import functools
import math
from collections import deque
from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

SHARE = 0.2  # spread of a sound part's share [-]
DEAD = 0.05  # spread of a dead part's share [-]
MEMORY_S = 20.0  # what is older counts less and less [s]
LEARNT_S = 2.0  # length of what pushes are learned from at once [s]
LIKELIER = 7.0  # logarithm by which a hypothesis must be likelier than that of sound parts [-]
DOUBTFUL = 1.0  # same from which nothing is learned of sound parts [-]
APART = 4.0  # and than any of another part [-]
LASTS_S = 1.0  # for so long [s]
ROUGH = 2.0  # times as much where noise has so much more variance, or kicks add up [-]
KICKED = 0.3  # variance of kicks from which evidence has to be as much clearer, in the measurements' own [-]
RARER = 3.0  # by which a part sticks more rarely than it dies, as a logarithm [-]
# Variance of a difference of changes of what is measured with a variance of 1, and a sixth more for chance [-].
TAKEN_BACK = 7.0
MEDIANS = (0.455, 0.693)  # of the mean square of one or two numbers whose variance is 1 [-]
JUMPS, CALM = 30, 15  # differences that noise is learned from; of them, as expected, to begin with


@dataclass(frozen=True, slots=True)
class Fault:
    """A hypothesis: parts that are dead or stuck."""

    parts: tuple[int, ...]
    stuck: bool = False
    fades: bool = False  # dead parts come to rest as slowly as they follow commands, not at once


@dataclass(frozen=True, slots=True)
class _Measured:
    """What was measured of one interval."""

    seconds: float
    rows: np.ndarray  # what each coefficient adds to each value, shape (m, c)
    values: np.ndarray  # shape (m,)
    std: np.ndarray  # shape (m,)
    scaled: np.ndarray  # rows in standard deviations, shape (m, c)


@dataclass(frozen=True, slots=True)
class _Prior:
    """What is believed of the coefficients before they are measured, a Gaussian, in the form that evidence takes."""

    precision: np.ndarray  # shape (c, c)
    weighed: np.ndarray  # the mean times that, shape (c,)
    volume: float  # logarithm of the precision's determinant
    square: float  # of the mean, in units of the covariance


@dataclass(frozen=True, slots=True)
class _Channel:
    """One value over time, in its standard deviations."""

    number: int
    std: np.ndarray  # shape (t,)
    rows: np.ndarray  # shape (t, c)
    whiten: (
        np.ndarray | None
    )  # what makes the sums of its values independent, shape (t, t); None: they are not summed


@dataclass(frozen=True, slots=True)
class _Sums:
    """What measurements say of the coefficients."""

    matrix: np.ndarray  # information, shape (c, c)
    vector: np.ndarray  # evidence, shape (c,)
    squares: float  # of the values


class ResponseBank:
    """Compares hypotheses for one robot.

    Coefficients are the shares of the parts, their offsets, and pushes from outside.

    Attributes:
        fault: Which parts are believed dead or stuck; empty: none.
    """

    def __init__(
        self,
        parts: int,
        *,
        offsets: np.ndarray,
        aside: np.ndarray | None = None,
        pushes: np.ndarray | None = None,
        changes: np.ndarray | None = None,
        together: bool = False,
        sticks: bool = True,
        adds_up: bool = False,
        onsets_s: tuple[float, ...] = (1.0, 2.0, 3.0),
        fades_s: float = 0.0,
    ) -> None:
        """Begin with sound parts.

        Args:
            parts: n, how many there are.
            offsets: Largest offset of each part once it is stuck, shape (n,).
            aside: Spread of the offsets of sound parts, shape (n,); none by default.
            pushes: Spread of each push from outside, shape (k,); none by default.
            changes: By how much it may change within seconds, shape (k,).
            together: Whether all parts may be dead at once, as those of a robot that is held.
            sticks: Whether a part may also stand at some value, whatever it is commanded.
            adds_up: Whether values are changes of something that is measured with white noise, as velocities are: the
                noise of one change is taken back by the next.
            onsets_s: Times since when a part may be dead, shortest first [s].
            fades_s: Time in which a dead part may come to rest [s].
        """
        self._onsets_s, self._fades_s = onsets_s, fades_s
        pushes = np.zeros(0) if pushes is None else pushes
        changes = np.zeros(0) if changes is None else changes
        self._parts, self._offsets, self._adds_up = parts, offsets, adds_up
        self._none = 1e-3 * offsets
        spread = np.concatenate((np.full(parts, SHARE), self._none if aside is None else aside, pushes))
        self._mean = np.concatenate((np.ones(parts), np.zeros(parts + len(pushes))))
        self._covariance = np.diag(np.square(spread))
        self._changes = np.diag(np.square(np.concatenate((np.zeros(2 * parts), changes))))
        kinds = (False, True) if sticks else (False,)
        self._faults = [Fault((i,), stuck) for i in range(parts) for stuck in kinds]
        if fades_s:
            self._faults += [Fault((i,), fades=True) for i in range(parts)]
        if together and parts > 1:
            self._faults.append(Fault(tuple(range(parts))))
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        size = len(self._mean)
        self._recent: deque[_Measured] = deque()
        self._gone: list[_Measured] = []  # of the recent past, until they are as long as the window
        self._past = np.zeros((size, size)), np.zeros(size)  # information and evidence
        usual = TAKEN_BACK if self._adds_up else 2.0
        self._jumps = deque([usual] * CALM, maxlen=JUMPS)
        self._variance, self._kicks = 1.0, 0.0  # of a value; of what adds up, in the measurements' own [-]
        self._deviations = np.zeros(0)
        self._believe(self._mean, self._covariance)
        self._likeliest: tuple[int, ...] = ()
        self._lasts_s, self._doubtful = 0.0, False
        self.fault: tuple[int, ...] = ()

    def add(self, seconds: float, rows: np.ndarray, values: np.ndarray, std: np.ndarray) -> None:
        """Take what was measured.

        Args:
            seconds: For how long it holds [s].
            rows: What each coefficient adds to each value, shape (m, 2 n + k).
            values: What was measured, shape (m,).
            std: Standard deviation of each, or of what it is the change of, > 0, shape (m,).
        """
        self._take_noise((values - rows @ self._prior[0]) / std)
        self._recent.append(_Measured(seconds, rows, values, std, rows / std[:, None]))
        length_s = sum(each.seconds for each in self._recent)
        while length_s > self._onsets_s[-1] + 1e-6 and len(self._recent) > 1:
            length_s -= self._recent[0].seconds
            self._learn(self._recent.popleft())
        self._decide(seconds)

    def _learn(self, gone: _Measured) -> None:
        """Learn pushes from what has left the window; what a fault does says nothing of sound parts."""
        if self._doubtful:
            self._gone.clear()
            return
        self._gone.append(gone)
        gone_s = sum(each.seconds for each in self._gone)
        if gone_s >= LEARNT_S:
            keep, gone_by = np.exp(-gone_s / MEMORY_S), self._sums(self._channels(self._gone), self._gone)
            self._past = keep * self._past[0] + gone_by.matrix, keep * self._past[1] + gone_by.vector
            self._believe(*self._learned())
            self._gone.clear()

    def _take_noise(self, deviations: np.ndarray) -> None:
        """Learn how much stronger noise is than expected: by what deviations differ from one to the next.

        What a fault does lasts, and its onset is one of many, so neither counts as noise.
        """
        if len(deviations) == len(self._deviations):
            jumps = deviations - self._deviations
            self._jumps.append(float(jumps @ jumps) / len(jumps) / MEDIANS[min(len(jumps), 2) - 1])
            self._take_variance(_median(self._jumps))
        self._deviations = deviations

    def _take_variance(self, jumps: float) -> None:
        """Take the variance of differences, in the expected variance of values.

        Changes of a velocity that differ more than its measurements err are kicks and noisy actuators: nothing takes
        these back, so they add up over the window.
        """
        if self._adds_up:
            self._kicks = max(0.0, 0.5 * (jumps - TAKEN_BACK))
        else:
            self._variance = max(1.0, 0.5 * jumps)

    def _decide(self, seconds: float) -> None:
        gains = self._gains()
        best = max(gains, key=lambda parts: gains[parts])
        rival = max((gain for parts, gain in gains.items() if parts != best), default=-np.inf)
        self._doubtful = gains[best] > DOUBTFUL
        rough = self._variance >= ROUGH or self._kicks > KICKED
        needed = ROUGH * LIKELIER if rough else LIKELIER
        clear = gains[best] > max(needed, rival + APART)
        likeliest = best if clear else ()
        self._lasts_s = self._lasts_s + seconds if likeliest and likeliest == self._likeliest else 0.0
        self._likeliest = likeliest
        if likeliest and self._lasts_s >= LASTS_S:
            self.fault = likeliest
        elif gains[best] < -LIKELIER:
            self.fault = ()

    def _gains(self) -> dict[tuple[int, ...], float]:
        """By how much, as a logarithm, faults of parts explain the newest seconds better than sound parts do."""
        gains: dict[tuple[int, ...], float] = {}
        asked: list[tuple[_Prior, _Sums]] = []
        for onset_s in self._onsets_s:
            since = self._since(onset_s)
            channels = self._channels(since)
            usual = self._sums(channels, since)
            asked.append((self._sound, usual))
            asked += [
                (prior, self._sums(channels, self._without(since, fault.parts[0])) if fault.fades else usual)
                for fault, prior in zip(self._faults, self._faulty, strict=True)
            ]
        evidences = iter(_evidences(asked))
        for _ in self._onsets_s:
            sound = next(evidences)
            for fault in self._faults:
                gain = next(evidences) - sound
                gains[fault.parts] = max(gains.get(fault.parts, -np.inf), gain - RARER * fault.stuck)
        return gains

    def _since(self, onset_s: float) -> list[_Measured]:
        """What was measured in the newest seconds, oldest first."""
        found: list[_Measured] = []
        length_s = 0.0
        for each in reversed(self._recent):
            length_s += each.seconds
            if found and length_s > onset_s + 1e-6:
                break
            found.append(each)
        return found[::-1]

    def _without(self, measured: list[_Measured], part: int) -> list[_Measured]:
        """Measurements less what a part does that fades since the first of them."""
        first, left, past_s = measured[0], [], 0.0
        for each in measured:
            faded = max(0.0, 1.0 - (past_s + 0.5 * each.seconds) / self._fades_s)
            does = faded * each.seconds / first.seconds * first.rows[: len(each.values), part]
            left.append(replace(each, values=each.values - does))
            past_s += each.seconds
        return left

    def _channels(self, measured: list[_Measured]) -> list[_Channel]:
        """Each channel of measurements over time."""
        found = []
        for number in range(max(len(each.values) for each in measured)):
            there = [each for each in measured if number < len(each.values)]
            rows, whiten = np.array([each.scaled[number] for each in there]), None
            if self._adds_up:
                whiten = _whitening(len(there), round(self._kicks, 1))
                rows = whiten @ rows.cumsum(axis=0)
            found.append(_Channel(number, np.array([each.std[number] for each in there]), rows, whiten))
        return found

    def _sums(self, channels: list[_Channel], measured: list[_Measured]) -> _Sums:
        """What measurements say of the coefficients; their channels have their rows."""
        matrix, vector, squares = np.zeros_like(self._covariance), np.zeros_like(self._mean), 0.0
        for each in channels:
            there = [one.values[each.number] for one in measured if each.number < len(one.values)]
            rows, values = each.rows, np.array(there) / each.std
            if each.whiten is not None:
                values = each.whiten @ values.cumsum()
            matrix, vector = matrix + rows.T @ rows, vector + rows.T @ values
            squares += float(values @ values)
        return _Sums(matrix / self._variance, vector / self._variance, squares / self._variance)

    def _believe(self, mean: np.ndarray, covariance: np.ndarray) -> None:
        """Take a prior of sound parts, and those of each fault that follow from it."""
        self._prior = mean, covariance
        self._sound = _prior(mean, covariance)
        self._faulty = [_prior(*self._under(fault)) for fault in self._faults]

    def _learned(self) -> tuple[np.ndarray, np.ndarray]:
        """Mean and covariance of the coefficients of sound parts, with the pushes of the time before."""
        own = 2 * self._parts
        if len(self._mean) == own:
            return self._mean, self._covariance
        precision = np.linalg.inv(self._covariance)
        spread = np.linalg.inv(precision + self._past[0])
        mean, covariance = self._mean.copy(), self._covariance.copy()
        mean[own:] = (spread @ (precision @ self._mean + self._past[1]))[own:]
        covariance[own:, own:] = (spread + self._changes)[own:, own:]
        return mean, covariance

    def _under(self, fault: Fault) -> tuple[np.ndarray, np.ndarray]:
        """The same where parts are dead or stuck."""
        mean, covariance = self._prior[0].copy(), self._prior[1].copy()
        for part in fault.parts:
            offset = self._offsets[part] if fault.stuck else self._none[part]
            for index, spread in ((part, DEAD), (self._parts + part, offset)):
                mean[index] = 0.0
                covariance[index, index] = spread**2
        return mean, covariance


@functools.lru_cache(maxsize=256)
def _whitening(count: int, kicks: float) -> np.ndarray:
    """What makes sums of so many changes independent, each of variance 1, shape (count, count).

    Each has noise of its own, that of the first measurement in common, and the kicks so far, whose variance is given.
    """
    number = np.arange(1, count + 1)
    covariance = np.eye(count) + 1.0 + kicks * np.minimum(number[:, None], number)
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))


def _median(numbers: Collection[float]) -> float:
    """As of NumPy, which takes five times as long for so few; NaN if one of them is."""
    if any(number != number for number in numbers):
        return math.nan
    ordered, middle = sorted(numbers), len(numbers) // 2
    return (ordered[middle - 1] + ordered[middle]) / 2.0 if len(ordered) % 2 == 0 else ordered[middle]


def _prior(mean: np.ndarray, covariance: np.ndarray) -> _Prior:
    precision = np.linalg.inv(covariance)
    volume = np.linalg.slogdet(precision)[1]
    return _Prior(precision, precision @ mean, float(volume), float(mean @ precision @ mean))


def _evidences(asked: list[tuple[_Prior, _Sums]]) -> list[float]:
    """Logarithms of the evidence of measurements under Gaussian priors, up to what is the same for all priors."""
    posteriors = np.array([prior.precision + sums.matrix for prior, sums in asked])
    evidences = np.array([prior.weighed + sums.vector for prior, sums in asked])
    volumes = np.linalg.slogdet(posteriors)[1].tolist()
    solved = np.linalg.solve(posteriors, evidences[:, :, None])[
        :, :, 0
    ]  # all at once: calls cost more than numbers
    return [
        0.5 * (prior.volume - volume - sums.squares - prior.square + float(evidence @ solution))
        for (prior, sums), volume, evidence, solution in zip(asked, volumes, evidences, solved, strict=True)
    ]
