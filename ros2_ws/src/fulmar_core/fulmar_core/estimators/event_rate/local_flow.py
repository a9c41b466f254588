"""Least squares of the turn rate from the local flow of each star (thesis §6.4.1): ω = (Hᵀ H)⁻¹ Hᵀ y."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.estimators.event_rate.star_tracks import Tracks
from fulmar_core.robots.sensors.star_camera import StarCamera

TUKEY = 4.685  # of Tukey's biweight, in robust standard deviations
PASSES = 12


@dataclass(frozen=True)
class Flow:
    """Motion of stars on the array of one camera."""

    middle: np.ndarray  # where each is in the middle of the window, shape (n, 2) [px]
    velocity: np.ndarray  # shape (n, 2) [px/s]
    std: np.ndarray  # of each component, as if events were independent, shape (n,) [px/s]


def local_flow(tracks: Tracks) -> Flow:
    """Straight lines through the events of each star, brighter and darker ones beside one another."""
    n = tracks.count
    groups, star = 2 * n, tracks.star
    size = np.bincount(tracks.group, minlength=groups).astype(float)
    safe = np.maximum(size, 1.0)
    t_mean = np.bincount(tracks.group, tracks.times_s, groups) / safe
    t = tracks.times_s - t_mean[tracks.group]
    spread = np.maximum(np.bincount(star, t * t, n), 1e-12)
    events = np.maximum(np.bincount(star, minlength=n).astype(float), 1.0)
    velocity, middle, squares = np.zeros((n, 2)), np.zeros((n, 2)), np.zeros(n)
    for i in range(2):
        place = tracks.places[:, i]
        mean = np.bincount(tracks.group, place, groups) / safe
        off = place - mean[tracks.group]
        velocity[:, i] = np.bincount(star, t * off, n) / spread
        squares += np.bincount(star, (off - velocity[star, i] * t) ** 2, n)
        middle[:, i] = np.bincount(star, place - velocity[star, i] * tracks.times_s, n) / events
    std = np.sqrt(squares / (2.0 * events) / spread)
    return Flow(middle, velocity, std)


def rate_of_flow(flow: Flow, camera: StarCamera) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Robust weighted least squares.

    Args:
        flow: Of one camera.
        camera: That camera.

    Returns:
        Turn rate about the camera's axes, shape (3,) [rad/s]; information, shape (3, 3); weights of stars, shape (n,).
    """
    H = camera.motion_field(flow.middle)
    precision = 1.0 / np.maximum(flow.std, 1e-6) ** 2
    weights = precision.copy()
    rate = np.zeros(3)
    information = np.zeros((3, 3))
    for number in range(PASSES):
        information = np.einsum("nij,nik,n->jk", H, H, weights)
        rate = np.linalg.lstsq(information, np.einsum("nij,ni,n->j", H, flow.velocity, weights), rcond=1e-12)[
            0
        ]
        off = np.linalg.norm(flow.velocity - H @ rate, axis=-1) / np.maximum(flow.std, 1e-6)
        scale = max(1.0, float(np.median(off)) / 1.18)  # of the length of two normal numbers
        if number == 0 and len(off) > 3:  # the first fit may be drawn far away: begin with its better half
            weights = precision * (off <= np.median(off))
            continue
        weights = precision * np.maximum(0.0, 1.0 - (off / (TUKEY * scale)) ** 2) ** 2
    return rate, information, weights / precision
