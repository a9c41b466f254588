"""Output-error fit: unknowns under which the core's own dynamics pass closest to the measured poses.

Poses are compared, never accelerations: differentiating a noisy signal twice biases whatever is regressed on it, and
a measured velocity is somebody's filter. The noise sits in the outputs alone, since commands are known exactly; then
least squares is consistent, also for runs under feedback (Ljung, "System Identification", 1999, §7.3 and §13.4).

Each window has numbers of its own (its first state, what pushes during it). They are eliminated window by window, which
leaves a small problem in the shared unknowns: Gauss-Newton with Levenberg's damping on the projected Jacobians (Golub
and Pereyra, "Separable nonlinear least squares", 2003).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from fulmar_core.config.errors import ConfigError
from fulmar_evaluation.identification.drives import Drive, Windows, cut
from fulmar_evaluation.identification.model import Known, Model, Unknown

ROUNDS = 60  # Gauss-Newton steps of one fit
CLOSE = 1e-7  # relative decrease of the cost at which a fit has arrived
HUBER = 3.0  # standard deviations from which on a residual counts less
CONFIDENCE = 0.95
NUDGE = 1e-5  # of unknowns and of windows' own numbers, for slopes


@dataclass(frozen=True)
class Estimate:
    """One number with its interval of 95 % confidence."""

    name: str
    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class Fit:
    """What was found.

    Attributes:
        estimates: By name, in the order of the model's unknowns.
        noise: Standard deviations of what is left, one for each of the model's channels [m or rad].
        windows: How many there were.
        measurements: Poses in all of them.
    """

    estimates: dict[str, Estimate]
    noise: tuple[float, ...]
    windows: int
    measurements: int

    def noise_interval(self, channel: int) -> tuple[float, float]:
        """95 % interval of the noise of a channel, of white noise [m or rad].

        The median of absolute deviations, from which `noise` follows, has 0.37 of the efficiency of the standard
        deviation: Var = sigma² / (2 · 0.37 n) (Rousseeuw and Croux, 1993).
        """
        half = 1.96 / math.sqrt(2.0 * 0.37 * self.measurements)
        return self.noise[channel] * max(0.0, 1.0 - half), self.noise[channel] * (1.0 + half)


def fit(
    model: Model, drives: Sequence[Drive], known: Sequence[Known], *, dt: float, noise: tuple[float, float]
) -> Fit:
    """Estimate a model's unknowns.

    Args:
        model: The family of the robot.
        drives: Its runs.
        known: What was measured otherwise.
        dt: Integration step [s].
        noise: What the measurements are believed to err by at first: position [m], heading [rad].

    Returns:
        Estimates with intervals.

    Raises:
        ConfigError: The runs are too short, or do not determine every unknown.
    """
    place = np.array([u.to_search(u.start) for u in model.unknowns])
    for i, value, _ in (_prior(model, each) for each in known):
        place[i] = value
    sigma = np.array([noise[kind] for kind in model.kinds])
    longest = max(drive.duration_s for drive in drives)
    spans = [span for span in model.spans_s if span <= longest] or [model.spans_s[0]]
    for span in spans:
        search = _Search(model, cut(drives, length_s=span, dt=dt), known, sigma)
        place = search.run(place)
        sigma = search.spread()
    search.sigma = sigma
    place = search.run(place)
    deviations, freedom = search.deviations(place)
    reach = float(stdtrit(freedom, 0.5 + 0.5 * CONFIDENCE)) * deviations
    values, lows, highs = (
        [float(u.from_search(number)) for u, number in zip(model.unknowns, numbers, strict=True)]
        for numbers in (place, place - reach, place + reach)
    )
    estimates = {
        u.name: Estimate(u.name, values[i], lows[i], highs[i], u.unit) for i, u in enumerate(model.unknowns)
    }
    return Fit(estimates, tuple(map(float, sigma)), len(search.windows), int(search.windows.valid.sum()))


class _Search:
    """One set of windows, and the numbers that each of them has for itself."""

    def __init__(self, model: Model, windows: Windows, known: Sequence[Known], sigma: np.ndarray) -> None:
        self.model, self.windows, self.sigma = model, windows, sigma
        self._own = model.own_of(windows.first_states())
        self._weight = windows.valid[:, :, None] * np.ones(len(model.kinds))
        self._prior = [_prior(model, each) for each in known]

    @np.errstate(over="ignore", invalid="ignore")  # a step whose prediction leaves all bounds is taken back
    def run(self, place: np.ndarray) -> np.ndarray:
        """Search from `place`; returns where the cost is least."""
        own, damping = self._own, 1e-3
        residual, slopes, own_slopes = self._slopes(place, own)
        cost = self._cost(residual, place)
        for _ in range(ROUNDS):
            whole, pull = self._normal(residual, slopes, own_slopes, place)
            scale = np.maximum(np.diag(whole), 1e-12)
            try:
                step = np.linalg.solve(whole + damping * np.diag(scale), pull)
            except np.linalg.LinAlgError as error:
                raise ConfigError(_UNDETERMINED) from error
            step = np.clip(step, -0.7, 0.7)
            own_step = self._own_step(residual, slopes, own_slopes, step)
            new_own = own + own_step
            new = self._residual(place + step, new_own)
            new_cost = self._cost(new, place + step)
            if not np.isfinite(new_cost) or new_cost > cost:
                damping *= 10.0
                if damping > 1e8:
                    break
                continue
            arrived = cost - new_cost < CLOSE * max(cost, 1.0)
            place, own, cost, damping = place + step, new_own, new_cost, max(damping / 10.0, 1e-12)
            residual, slopes, own_slopes = self._slopes(place, own)
            if arrived:
                break
        self._own, self._last = own, (residual, slopes, own_slopes)
        return place

    def spread(self) -> np.ndarray:
        """Standard deviations of what is left, robust against outliers, one for each channel."""
        residual, _, own_slopes = self._last
        raw = residual * self.sigma
        valid = self.windows.valid
        used = own_slopes.shape[0] / raw.shape[-1] / np.maximum(valid.sum(axis=1).mean(), 1.0)
        lost = np.sqrt(1.0 / max(1.0 - used, 0.1))
        return np.array(
            [
                max(1.4826 * float(np.median(np.abs(raw[..., c][valid]))) * lost, 1e-9)
                for c in range(raw.shape[-1])
            ]
        )

    def deviations(self, place: np.ndarray) -> tuple[np.ndarray, int]:
        """Standard deviations of the estimates, and degrees of freedom.

        Two answers are computed: from the noise as if it were white (inverse Fisher information), and from how much the
        windows disagree (Huber's sandwich, windows as clusters), which also counts what the model does not know. The
        larger one is taken. What a model is known to err by, whatever the runs say, comes on top.
        """
        residual, slopes, own_slopes = self._last
        whole, _ = self._normal(residual, slopes, own_slopes, place)
        scale = 1.0 / np.sqrt(np.maximum(np.diag(whole), 1e-300))
        values = np.linalg.eigvalsh(whole * scale[:, None] * scale[None, :])
        if values[0] < 1e-10:
            raise ConfigError(_UNDETERMINED)
        white = np.linalg.inv(whole)
        count, unknowns = len(self.windows), len(place)
        pulls = np.stack([self._pull(residual, slopes, own_slopes, w) for w in range(count)])
        freedom = max(count - unknowns, 1)
        meat = pulls.T @ pulls * (count / freedom)
        for i, _, std in self._prior:
            meat[i, i] += 1.0 / std**2
        sandwich = white @ meat @ white
        blur = np.array(
            [
                _in_search(u, float(u.from_search(at)), u.blur)
                for u, at in zip(self.model.unknowns, place, strict=True)
            ]
        )
        return np.sqrt(np.maximum(np.diag(white), np.diag(sandwich)) + blur**2), freedom

    def _cost(self, residual: np.ndarray, place: np.ndarray) -> float:
        size = np.abs(residual)
        huber = np.where(size <= HUBER, size**2, HUBER * (2.0 * size - HUBER))
        prior = sum(((place[i] - value) / std) ** 2 for i, value, std in self._prior)
        return float(np.sum(huber * self._weight) + prior)

    def _normal(
        self, residual: np.ndarray, slopes: np.ndarray, own_slopes: np.ndarray, place: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Normal matrix and right side in the shared unknowns, the windows' own numbers eliminated."""
        count = slopes.shape[0]
        whole, pull = np.zeros((count, count)), np.zeros(count)
        for w in range(len(self.windows)):
            a, r = self._projected(residual, slopes, own_slopes, w)
            whole += a @ a.T
            pull += a @ r
        for i, value, std in self._prior:
            whole[i, i] += 1.0 / std**2
            pull[i] += (value - place[i]) / std**2
        return whole, pull

    def _pull(self, residual: np.ndarray, slopes: np.ndarray, own_slopes: np.ndarray, w: int) -> np.ndarray:
        a, r = self._projected(residual, slopes, own_slopes, w)
        return np.asarray(a @ r)

    def _projected(
        self, residual: np.ndarray, slopes: np.ndarray, own_slopes: np.ndarray, w: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Slopes (p, n) and residual (n,) of one window, free of what its own numbers can explain."""
        a, b, r = self._weighted(residual, slopes, own_slopes, w)
        q, upper = np.linalg.qr(b.T)
        full = np.abs(np.diag(upper)) > 1e-9 * np.abs(np.diag(upper)).max()
        q = q[:, full]
        return a - (a @ q) @ q.T, r - q @ (q.T @ r)

    def _weighted(
        self, residual: np.ndarray, slopes: np.ndarray, own_slopes: np.ndarray, w: int
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Slopes (p, n), own slopes (q, n) and residual (n,) of one window; padding and outliers weigh little."""
        root = np.sqrt(self._weight[w] * _robust(residual[w])).ravel()
        a = slopes[:, w].reshape(len(slopes), -1) * root
        b = own_slopes[:, w].reshape(len(own_slopes), -1) * root
        return a, b, residual[w].ravel() * root

    def _own_step(
        self, residual: np.ndarray, slopes: np.ndarray, own_slopes: np.ndarray, step: np.ndarray
    ) -> np.ndarray:
        change = np.zeros_like(self._own)
        for w in range(len(self.windows)):
            a, b, r = self._weighted(residual, slopes, own_slopes, w)
            change[:, w] = np.linalg.lstsq(b.T, r - step @ a, rcond=1e-9)[0]
        return change

    def _residual(self, place: np.ndarray, own: np.ndarray) -> np.ndarray:
        """Measured minus predicted, in standard deviations, shape (w, n, channels)."""
        return np.asarray(self._residuals(place[:, None], own[:, None, :])[0])

    def _residuals(self, places: np.ndarray, own: np.ndarray) -> np.ndarray:
        """Same for copies: places (p, copies), own (q, copies, w)."""
        values = {u.name: u.from_search(places[i])[:, None] for i, u in enumerate(self.model.unknowns)}
        grid = self.model.predict(values, own, self.windows)
        return np.asarray((self.windows.pose - self.windows.at_measurements(grid)) / self.sigma)

    def _slopes(self, place: np.ndarray, own: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Residual (w, n, c), and slopes of the prediction: (p, w, n, c) and (q, w, n, c)."""
        p, q = len(place), len(own)
        places = np.repeat(place[:, None], 1 + p + q, axis=1)
        owns = np.repeat(own[:, None, :], 1 + p + q, axis=1)
        places[np.arange(p), 1 + np.arange(p)] += NUDGE
        owns[np.arange(q), 1 + p + np.arange(q)] += NUDGE
        residuals = self._residuals(places, owns)
        slopes = (residuals[0] - residuals[1:]) / NUDGE
        return residuals[0], slopes[:p], slopes[p:]


_UNDETERMINED = (
    "these runs do not distinguish every quantity. Drive with --controller excite, for longer, and give a known mass: "
    "--known mass=5.32+-0.02, or a second run with a weighed ballast: --ballast BAG=2.0"
)


def _robust(residual: np.ndarray) -> np.ndarray:
    return np.asarray(np.minimum(1.0, HUBER / np.maximum(np.abs(residual), 1e-12)))


def _index(model: Model, name: str) -> int:
    return next(i for i, u in enumerate(model.unknowns) if u.name == name)


def _prior(model: Model, known: Known) -> tuple[int, float, float]:
    """Which unknown a known quantity is, and its value and standard deviation as the fit works with them."""
    i = _index(model, known.name)
    unknown = model.unknowns[i]
    return i, unknown.to_search(known.value), _in_search(unknown, known.value, known.std)


def _in_search(unknown: Unknown, value: float, std: float) -> float:
    """A standard deviation around a value, as the fit works with it."""
    return std / (value if unknown.positive else unknown.scale)
