"""A pinhole camera that looks at the stars: projection, motion field, and images.

Axes of a camera: X to the right, Y down, Z along its boresight; the middle of the image is its principal point. A
camera that turns with (p, q, r) about these axes sees a star at x = X/Z, y = Y/Z move by

    ẋ = x y p − (1 + x²) q + y r        ẏ = (1 + y²) p − x y q − x r

(Longuet-Higgins and Prazdny, "The interpretation of a moving retinal image", Proc. R. Soc. B 208, 1980, without
translation; thesis §6.4.1, whose F is this).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.robots.sensors.catalogue import Stars
from fulmar_core.states.rotation import rotate

Quaternion = tuple[float, float, float, float]


@dataclass(frozen=True)
class StarCamera:
    """Optics, array and mounting of one camera."""

    width: int = 1024  # [px]
    height: int = 1024  # [px]
    fov_deg: float = 8.5  # field of view across the width [deg]
    faintest: float = 7.0  # visual magnitude of the faintest stars that it sees
    psf_px: float = 1.0  # standard deviation of the image of a star [px]
    mounting: Quaternion = (0.0, 0.0, 0.0, 1.0)  # attitude of its axes in the body, x, y, z, w

    def __post_init__(self) -> None:
        if min(self.width, self.height) < 8 or not 0.0 < self.fov_deg < 120.0 or self.psf_px <= 0.0:
            raise ValueError(
                "a camera needs at least 8 × 8 pixels, a field of view of up to 120° and psf_px > 0."
            )
        if abs(float(np.linalg.norm(self.mounting)) - 1.0) > 1e-3:
            raise ValueError("'mounting' must be a unit quaternion x, y, z, w.")

    @property
    def focal_px(self) -> float:
        """Focal length [px]."""
        return float(0.5 * self.width / np.tan(np.radians(0.5 * self.fov_deg)))

    @property
    def to_body(self) -> np.ndarray:
        """Rotation matrix from the camera's axes to the body's, shape (3, 3)."""
        return np.asarray(rotate(np.array(self.mounting), np.eye(3)).T)

    def axes_in_world(self, quat_xyzw: np.ndarray) -> np.ndarray:
        """Rotation matrix from the camera's axes to the world's, of a body's attitude, shape (3, 3)."""
        return np.asarray(rotate(np.asarray(quat_xyzw, dtype=float), np.eye(3)).T @ self.to_body)

    def near(self, stars: Stars, axes: np.ndarray, *, spare_deg: float = 0.0) -> Stars:
        """Stars in or around the field of view, of at most the faintest magnitude.

        Args:
            stars: Of the catalogue.
            axes: As in `axes_in_world`.
            spare_deg: How far beyond the corners [deg].
        """
        seen = stars.brighter_than(self.faintest)
        corner = np.arctan(np.hypot(self.width, self.height) / (2.0 * self.focal_px)) + np.radians(spare_deg)
        inside = seen.directions @ axes[:, 2] > np.cos(corner)
        return Stars(seen.directions[inside], seen.magnitudes[inside])

    def project(self, directions: np.ndarray, axes: np.ndarray) -> np.ndarray:
        """Places of directions in front of the camera, shape (n, 2): columns and rows from the corner [px]."""
        x, y, z = (directions @ axes).T
        middle = np.array([0.5 * (self.width - 1), 0.5 * (self.height - 1)])
        return np.asarray(np.stack((x / z, y / z), axis=-1) * self.focal_px + middle)

    def is_inside(self, places: np.ndarray, margin: float = 0.0) -> np.ndarray:
        """Which places [px] lie on the array, or so far beyond its edge, shape (n,)."""
        x, y = places[..., 0], places[..., 1]
        return np.asarray(
            (x >= -margin) & (x <= self.width - 1 + margin) & (y >= -margin) & (y <= self.height - 1 + margin)
        )

    def normalised(self, places: np.ndarray) -> np.ndarray:
        """X = X/Z and y = Y/Z of places on the array [px], shape (..., 2)."""
        middle = np.array([0.5 * (self.width - 1), 0.5 * (self.height - 1)])
        return np.asarray((places - middle) / self.focal_px)

    def motion_field(self, places: np.ndarray) -> np.ndarray:
        """Matrices from a turn rate about the camera's axes [rad/s] to the motion of stars there, (..., 2, 3) [px]."""
        x, y = np.moveaxis(self.normalised(places), -1, 0)
        rows = [[x * y, -(1.0 + x * x), y], [1.0 + y * y, -x * y, -x]]
        return np.asarray(self.focal_px * np.moveaxis(np.array(rows), (0, 1), (-2, -1)))

    def flux(self, magnitudes: np.ndarray) -> np.ndarray:
        """Brightness of stars, 1 for the faintest that it sees (Pogson, 1856)."""
        return np.asarray(10.0 ** (-0.4 * (magnitudes - self.faintest)))


def render(
    camera: StarCamera,
    stars: Stars,
    quat_xyzw: np.ndarray,
    *,
    background: float = 0.2,
    noise: float = 0.02,
    seed: int = 0,
) -> np.ndarray:
    """Image of the sky, with photons counted in peaks of the faintest star.

    Args:
        camera: The camera.
        stars: Of the catalogue.
        quat_xyzw: Attitude of the body in the world.
        background: Brightness of the dark sky.
        noise: Standard deviation of a pixel.
        seed: Of the noise.

    Returns:
        Shape (height, width).
    """
    axes = camera.axes_in_world(quat_xyzw)
    near = camera.near(stars, axes)
    places, flux = camera.project(near.directions, axes), camera.flux(near.magnitudes)
    image = background + noise * np.random.default_rng(seed).standard_normal((camera.height, camera.width))
    reach = int(np.ceil(6.0 * camera.psf_px))
    for (x, y), light in zip(places, flux, strict=True):
        left, top = max(0, int(x) - reach), max(0, int(y) - reach)
        right, bottom = min(camera.width, int(x) + reach + 2), min(camera.height, int(y) + reach + 2)
        if left >= right or top >= bottom:
            continue
        dx, dy = np.arange(left, right) - x, np.arange(top, bottom) - y
        spot = np.exp(-0.5 * (dx[None, :] ** 2 + dy[:, None] ** 2) / camera.psf_px**2)
        image[top:bottom, left:right] += light * spot
    return image
