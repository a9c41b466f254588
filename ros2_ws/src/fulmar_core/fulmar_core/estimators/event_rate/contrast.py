"""Contrast maximisation over one turn rate for all events of a window and all cameras.

Events are carried along the motion field to the middle of the window (Gallego, Rebecq and Scaramuzza, "A Unifying
Contrast Maximization Framework for Event Cameras", CVPR 2018, arXiv 1804.01306). The rate that gathers them best into
points is that of the body. The contrast here is the density of the carried events at the places of the stars, under a
Gaussian: maximising it is a least-squares problem with weights that follow from the last solution. From coarse to fine
the Gaussian shrinks to the size of a star. A body's rate and the places of all stars are found at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fulmar_core.estimators.event_rate.local_flow import local_flow, rate_of_flow
from fulmar_core.estimators.event_rate.star_tracks import Tracks
from fulmar_core.robots.sensors.star_camera import StarCamera

SCALES_PX = (12.0, 6.0, 4.0, 3.0, 2.5, 2.5, 2.5)  # of the Gaussian, from coarse to fine
WARM_PX = (3.0, 2.5, 2.5)  # where the rate of the last window is a start
# Errors of stars have causes in common that their scores do not show, such as rows of pixels: without it the normalised
# error squared is 1.5 times what it should be (`fulmar benchmark events`).
INFLATION = 1.6
CHANGE_SHOWS = 16.3  # chi-squared, 3 degrees of freedom: 1 steady rate of 1,000 lies beyond it
CHANGE_STEPS = 2


@dataclass(frozen=True)
class RateFit:
    """Turn rate of one window."""

    rate: np.ndarray  # about the body's axes, shape (3,) [rad/s]
    covariance: np.ndarray  # shape (3, 3) [rad²/s²]
    stars: int  # that it comes from
    contrast: float  # mean weight of the events of stars, 0 to 1 [-]
    speed_px: float  # of the median star [px/s]


def fit_rate(
    tracks: Sequence[Tracks], cameras: Sequence[StarCamera], *, start: np.ndarray | None = None
) -> RateFit | None:
    """Find the rate that gathers the events of stars best.

    Args:
        tracks: Of each camera.
        cameras: As many.
        start: Turn rate of the window before about the body's axes [rad/s]; None: from the flow of each star.

    Returns:
        None where no camera sees a star.
    """
    if not sum(each.count for each in tracks):
        return None
    rate = _rate_of_flows(tracks, cameras) if start is None else np.array(start, dtype=float)
    problem = [_Camera(each, camera) for each, camera in zip(tracks, cameras, strict=True) if each.count]
    for scale in SCALES_PX if start is None else WARM_PX:
        rate, weights = _step(problem, rate, scale)
    stars = sum(each.count for each in problem)
    covariance = _covariance(problem, rate, weights, scale, stars)
    # Where a rate changes within the window, the fast part of it makes more events than its middle: the change is
    # estimated too, if it shows.
    changing = _solved(problem, weights, 2)
    its_covariance = _covariance(problem, changing, weights, scale, stars)
    change = changing[3:]
    if change @ np.linalg.pinv(its_covariance[3:, 3:], hermitian=True) @ change > CHANGE_SHOWS:
        for _ in range(CHANGE_STEPS):
            changing, weights = _step(problem, changing, scale)
        rate, covariance = changing[:3], _covariance(problem, changing, weights, scale, stars)[:3, :3]
    contrast = float(np.mean(np.concatenate(weights)))
    speeds = np.concatenate([np.linalg.norm(each.field @ rate, axis=-1) for each in problem])
    return RateFit(rate, covariance, stars, contrast, float(np.median(speeds)))


def _covariance(
    problem: Sequence[_Camera], motion: np.ndarray, weights: list[np.ndarray], scale: float, stars: int
) -> np.ndarray:
    """Covariance of a solution, shape (3, 3), or (6, 6) with a change."""
    size = len(motion)
    information, scores = np.zeros((size, size)), np.zeros((size, size))
    for each, weight in zip(problem, weights, strict=True):
        one, many = each.scores(motion, weight, scale)
        information += one
        scores += many
    # Events of one star err together: their scores are added up before they are squared (Liang and Zeger, 1986).
    inverse = np.linalg.pinv(information, rcond=1e-10, hermitian=True)
    few = stars / max(stars - 2.0, 0.5)
    return np.asarray(INFLATION * few * inverse @ scores @ inverse)


def _rate_of_flows(tracks: Sequence[Tracks], cameras: Sequence[StarCamera]) -> np.ndarray:
    """Rate about the body's axes by the local flow of all cameras, shape (3,) [rad/s]."""
    information, aim = np.zeros((3, 3)), np.zeros(3)
    for each, camera in zip(tracks, cameras, strict=True):
        if each.count:
            rate, its, _ = rate_of_flow(local_flow(each), camera)
            turned = camera.to_body @ its @ camera.to_body.T
            information += turned
            aim += turned @ camera.to_body @ rate
    return np.asarray(np.linalg.lstsq(information, aim, rcond=1e-10)[0])


class _Camera:
    """What the fit needs of one camera: events, and the motion field at their stars in the body's axes."""

    def __init__(self, tracks: Tracks, camera: StarCamera) -> None:
        self.tracks, self.count = tracks, tracks.count
        self.groups = 2 * tracks.count
        self.camera = camera
        t = tracks.times_s
        self.times = np.stack((t, 0.5 * t * t))  # by which a rate and its change move a star
        self.field = self._field_at(local_flow(tracks).middle)

    def _field_at(self, middle: np.ndarray) -> np.ndarray:
        inside = np.clip(middle, 0.0, [self.camera.width - 1, self.camera.height - 1])
        return np.asarray(self.camera.motion_field(inside) @ self.camera.to_body.T)  # (stars, 2, 3)

    def carried(self, motion: np.ndarray) -> np.ndarray:
        """Places of events in the middle of the window, shape (n, 2) [px]."""
        places, star = self.tracks.places, self.tracks.star
        for part, time in zip(motion.reshape(-1, 3), self.times, strict=False):
            places = places - (self.field @ part)[star] * time[:, None]
        return np.asarray(places)

    def weights(self, motion: np.ndarray, scale: float) -> np.ndarray:
        """Gaussian of each event's distance from the middle of its star and polarity, shape (n,)."""
        carried, group = self.carried(motion), self.tracks.group
        weights = np.ones(len(group))
        for _ in range(2):
            middle = self._means(carried, weights)
            off = carried - middle[group]
            weights = np.exp(-0.5 * np.sum(off * off, axis=-1) / scale**2)
        return weights

    def _means(self, values: np.ndarray, weights: np.ndarray) -> np.ndarray:
        total = np.maximum(np.bincount(self.tracks.group, weights, self.groups), 1e-12)
        parts = [
            np.bincount(self.tracks.group, weights * values[:, i], self.groups)
            for i in range(values.shape[1])
        ]
        return np.asarray(np.stack(parts, axis=-1) / total[:, None])

    def normal(self, weights: np.ndarray, parts: int) -> tuple[np.ndarray, np.ndarray]:
        """Normal equations of the motion, places of stars left aside, shapes (3 · parts,) * 2 and (3 · parts,)."""
        times = self._off(self.times[:parts].T, weights).T
        off = self._off(self.tracks.places, weights)
        return self._information(weights, times), self._slopes(weights, times, off).sum(axis=0)

    def scores(self, motion: np.ndarray, weights: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray]:
        """Curvature of the contrast, and the sum of squared slopes of each star's, shapes as in `normal`."""
        times = self._off(self.times[: len(motion) // 3].T, weights).T
        off = self._off(self.carried(motion), weights)
        bent = weights * (
            1.0 - 0.5 * np.sum(off * off, axis=-1) / scale**2
        )  # second derivative of the Gaussian
        each = self._slopes(weights, times, off)
        return self._information(bent, times), each.T @ each

    def _off(self, values: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Values without the mean of their star and polarity."""
        return np.asarray(values - self._means(values, weights)[self.tracks.group])

    def _information(self, weights: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Information of the motion: `times` has the time factor of each part of it, shape (parts, n)."""
        moments = np.array(
            [[np.bincount(self.tracks.star, weights * a * b, self.count) for b in times] for a in times]
        )
        moments = moments * (moments[0, 0] > 0.0)  # a star whose events scatter too widely has none
        blocks = np.einsum("nij,nik,abn->ajbk", self.field, self.field, moments)
        return np.asarray(blocks.reshape(3 * len(times), 3 * len(times)))

    def _slopes(self, weights: np.ndarray, times: np.ndarray, off: np.ndarray) -> np.ndarray:
        """What each star pulls the motion by, shape (stars, 3 · parts)."""
        pulled = []
        for time in times:
            moved = [np.bincount(self.tracks.star, weights * time * off[:, i], self.count) for i in range(2)]
            pulled.append(np.einsum("nij,ni->nj", self.field, np.stack(moved, axis=-1)))
        return np.concatenate(pulled, axis=-1)


def _step(
    problem: Sequence[_Camera], motion: np.ndarray, scale: float
) -> tuple[np.ndarray, list[np.ndarray]]:
    """The motion that the weights of events under another one give, and those weights."""
    weights = [each.weights(motion, scale) for each in problem]
    return _solved(problem, weights, len(motion) // 3), weights


def _solved(problem: Sequence[_Camera], weights: list[np.ndarray], parts: int) -> np.ndarray:
    """The motion that weighted events give: a rate, shape (3,) [rad/s], or with its change, shape (6,) [rad/s²]."""
    information, aim = np.zeros((3 * parts, 3 * parts)), np.zeros(3 * parts)
    for each, weight in zip(problem, weights, strict=True):
        one, other = each.normal(weight, parts)
        information += one
        aim += other
    return np.asarray(np.linalg.lstsq(information, aim, rcond=1e-10)[0])
