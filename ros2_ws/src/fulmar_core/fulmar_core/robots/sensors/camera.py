"""What a robot's file says of a camera: rate, image, mounting and clip; pinhole geometry of its images."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fulmar_core.config.plausible_ranges import Plausible
from fulmar_core.states.rotation import multiply, rotate

Pose = tuple[float, float, float, float, float, float, float]
MOST_PIXELS = 4096  # along either side of an image
# From a body's axes (x ahead, y to the left, z up) to ROS's optical axes (z ahead, x to the right, y down).
OPTICAL_IN_LINK = (-0.5, 0.5, -0.5, 0.5)
LINK, OPTICAL = "camera_link", "camera_optical_frame"  # frames of REP 103


@dataclass(frozen=True)
class CameraConfig:
    """Rate, image, mounting and clip of one camera. It sees colours, depth and semantic ids at the same pixels."""

    rate_hz: float = 10.0  # of images; at most one with each reading of the truth [Hz]
    width: int = 320  # [px]
    height: int = 240  # [px]
    field_of_view: float = 90.0  # across the width [°]
    # Pose of the frame `camera_link` in the body, x ahead along the optical axis: x, y, z [m], quaternion x, y, z, w.
    mount: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    near: float = 0.1  # along the axis: what is nearer is not seen [m]
    far: float = 100.0  # the same: what is farther is not seen [m]

    def __post_init__(self) -> None:
        if not all(1 <= side <= MOST_PIXELS for side in (self.width, self.height)):
            raise ValueError(f"'width' and 'height' must be 1 to {MOST_PIXELS} px.")
        if not 0.0 < self.field_of_view < 170.0:
            raise ValueError(f"'field_of_view' = {self.field_of_view:g} must lie between 0 and 170 degrees.")
        if not 0.0 < self.near < self.far:
            raise ValueError(f"'near' = {self.near:g} and 'far' = {self.far:g} must be 0 < near < far [m].")
        if self.rate_hz <= 0.0:
            raise ValueError(f"'rate_hz' = {self.rate_hz:g} must be greater than 0.")
        if abs(math.hypot(*self.quat_xyzw) - 1.0) > 1e-3:
            raise ValueError("'mount' must be x, y, z in metres and a unit quaternion x, y, z, w.")

    @property
    def position(self) -> tuple[float, float, float]:
        """Of the camera in the body [m]."""
        return self.mount[:3]

    @property
    def quat_xyzw(self) -> tuple[float, float, float, float]:
        """Attitude of `camera_link` in the body."""
        return self.mount[3:]

    @property
    def optical_quat_xyzw(self) -> tuple[float, float, float, float]:
        """Attitude of `camera_optical_frame` in the body: z ahead, x to the right, y down."""
        x, y, z, w = multiply(np.array(self.quat_xyzw), np.array(OPTICAL_IN_LINK)).tolist()
        return x, y, z, w

    @property
    def focal_px(self) -> float:
        """Focal length; pixels are square [px]."""
        return 0.5 * self.width / math.tan(math.radians(0.5 * self.field_of_view))

    @property
    def vertical_field_of_view(self) -> float:
        """Across the height [°]."""
        return math.degrees(2.0 * math.atan(0.5 * self.height / self.focal_px))

    @property
    def intrinsics(self) -> np.ndarray:
        """Matrix K of ROS's CameraInfo, shape (3, 3) [px]: the middle of the first pixel is (0, 0)."""
        cx, cy = 0.5 * (self.width - 1), 0.5 * (self.height - 1)
        return np.array([[self.focal_px, 0.0, cx], [0.0, self.focal_px, cy], [0.0, 0.0, 1.0]])

    def optical_pose(self, body_pose: np.ndarray) -> np.ndarray:
        """Pose of the optical frame in the world.

        Args:
            body_pose: Of the body in the world: x, y, z [m], quaternion x, y, z, w, shape (7,).

        Returns:
            The same of the frame with z ahead, x to the right and y down, shape (7,).
        """
        pose = np.asarray(body_pose, dtype=float)
        place = pose[:3] + rotate(pose[3:], np.array(self.position))
        return np.concatenate((place, multiply(pose[3:], np.array(self.optical_quat_xyzw))))


# By the names that a robot's file may give in the place of values.
PROFILES = {
    "standard": CameraConfig(),
    # SRB, RL-AVIST's environment: focal length 5, aperture 12, clip 0.1 to 50.1 m.
    "rl_avist": CameraConfig(width=64, height=64, field_of_view=100.4, near=0.1, far=50.1),
}

RANGES = (
    Plausible("sensors.camera.rate_hz", "Hz", (0.01, 1000.0), (0.5, 120.0), "data sheets: 1 to 120 images a second"),
    Plausible("sensors.camera.field_of_view", "°", (0.5, 170.0), (5.0, 130.0), "tele lenses to wide ones"),
    Plausible("sensors.camera.near", "m", (1e-4, 100.0), (0.005, 10.0), "a hand's breadth before the lens"),
    Plausible("sensors.camera.far", "m", (0.1, 1e6), (1.0, 1e5), "a laboratory to the horizon"),
)  # fmt: skip
