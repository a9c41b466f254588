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

from fulmar_core.rate_estimation.local_flow import local_flow, rate_of_flow
from fulmar_core.rate_estimation.star_tracks import Tracks
from fulmar_core.sky.star_camera import StarCamera

SCALES_PX = (12.0, 6.0, 4.0, 3.0, 2.5, 2.5, 2.5)  # of the Gaussian, from coarse to fine
WARM_PX = (3.0, 2.5, 2.5)  # where the rate of the last window is a start
# Errors of stars have causes in common that their scores do not show, such as rows of pixels: without it the normalised
# error squared is 1.5 times what it should be (`fulmar benchmark events`).
INFLATION = 1.6


@dataclass(frozen=True)
class RateFit:
    """Turn rate of one window."""

    rate: np.ndarray  # about the body's axes, shape (3,) [rad/s]
    covariance: np.ndarray  # shape (3, 3) [rad²/s²]
    stars: int  # that it comes from
    contrast: float  # mean weight of the events of stars, 0 to 1 [-]


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
    information, scores, stars = np.zeros((3, 3)), np.zeros((3, 3)), 0
    for each, weight in zip(problem, weights, strict=True):
        one, many = each.scores(rate, weight, scale)
        information += one
        scores += many
        stars += each.count
    # Events of one star err together: their scores are added up before they are squared (Liang and Zeger, 1986).
    inverse = np.linalg.pinv(information, rcond=1e-10, hermitian=True)
    few = stars / max(stars - 2.0, 0.5)
    covariance = INFLATION * few * inverse @ scores @ inverse
    contrast = float(np.mean(np.concatenate(weights)))
    return RateFit(rate, covariance, stars, contrast)


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
        self.field = self._field_at(local_flow(tracks).middle)

    def _field_at(self, middle: np.ndarray) -> np.ndarray:
        inside = np.clip(middle, 0.0, [self.camera.width - 1, self.camera.height - 1])
        return np.asarray(self.camera.motion_field(inside) @ self.camera.to_body.T)  # (stars, 2, 3)

    def carried(self, rate: np.ndarray) -> np.ndarray:
        """Places of events in the middle of the window, shape (n, 2) [px]."""
        velocity = self.field @ rate
        return np.asarray(self.tracks.places - velocity[self.tracks.star] * self.tracks.times_s[:, None])

    def weights(self, rate: np.ndarray, scale: float) -> np.ndarray:
        """Gaussian of each event's distance from the middle of its star and polarity, shape (n,)."""
        carried, group = self.carried(rate), self.tracks.group
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

    def normal(self, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Normal equations of the rate, places of stars left aside, shapes (3, 3) and (3,)."""
        group, star = self.tracks.group, self.tracks.star
        t = self.tracks.times_s - self._means(self.tracks.times_s[:, None], weights)[group, 0]
        off = self.tracks.places - self._means(self.tracks.places, weights)[group]
        lasting = np.bincount(star, weights * t * t, self.count)
        moved = np.stack([np.bincount(star, weights * t * off[:, i], self.count) for i in range(2)], axis=-1)
        information = np.einsum("nij,nik,n->jk", self.field, self.field, lasting)
        return information, np.einsum("nij,ni->j", self.field, moved)

    def scores(self, rate: np.ndarray, weights: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray]:
        """Curvature of the contrast, and the sum of squared slopes of each star's, shapes (3, 3)."""
        group, star = self.tracks.group, self.tracks.star
        t = self.tracks.times_s - self._means(self.tracks.times_s[:, None], weights)[group, 0]
        carried = self.carried(rate)
        off = carried - self._means(carried, weights)[group]
        bent = weights * (
            1.0 - 0.5 * np.sum(off * off, axis=-1) / scale**2
        )  # second derivative of the Gaussian
        lasting = np.maximum(np.bincount(star, bent * t * t, self.count), 0.0)
        moved = np.stack([np.bincount(star, weights * t * off[:, i], self.count) for i in range(2)], axis=-1)
        each = np.einsum("nij,ni->nj", self.field, moved)
        return np.einsum("nij,nik,n->jk", self.field, self.field, lasting), each.T @ each


def _step(problem: Sequence[_Camera], rate: np.ndarray, scale: float) -> tuple[np.ndarray, list[np.ndarray]]:
    """Weights of the events at a rate, and the rate that they give."""
    weights = [each.weights(rate, scale) for each in problem]
    information, aim = np.zeros((3, 3)), np.zeros(3)
    for each, weight in zip(problem, weights, strict=True):
        one, other = each.normal(weight)
        information += one
        aim += other
    return np.asarray(np.linalg.lstsq(information, aim, rcond=1e-10)[0]), weights
