"""Images among the inputs of a policy: which ones its network takes, as its passport says it."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.camera import CameraConfig, Pose

DEPTH, COLOR = "camera_depth", "camera_image"
# What a network makes of a pixel, inside its graph; by the reading that it takes.
SCALING = {DEPTH: "0.5 / depth in m", COLOR: "value / 255"}
CHANNELS = {DEPTH: 1, COLOR: 3}
_CAMERA = ("width", "height", "field_of_view", "mount", "near", "far")  # what the robot's camera must share


@dataclass(frozen=True)
class ImageInput:
    """The images that a policy was trained with: their camera, and which of its pixels the network takes."""

    reading: str  # name of the reading, a key of `SCALING`
    width: int  # of the camera's images [px]
    height: int  # [px]
    field_of_view: float  # across the width [°]
    mount: Pose  # of `camera_link` in the body: x, y, z [m], quaternion x, y, z, w
    near: float  # [m]
    far: float  # [m]
    every: int  # of so many pixels along each side the middle one is taken; odd
    scaling: str  # see `SCALING`

    def __post_init__(self) -> None:
        if self.scaling != SCALING.get(self.reading):
            raise ValueError(f"'{self.reading}' scaled by '{self.scaling}' is none of: {SCALING}.")
        sides = (self.width, self.height)
        if self.every < 1 or self.every % 2 == 0 or any(side < 1 or side % self.every for side in sides):
            raise ValueError(
                f"'every' = {self.every} must be odd, and divide {self.width} and {self.height}."
            )

    @classmethod
    def of(cls, camera: CameraConfig, reading: str = DEPTH, *, every: int = 1) -> ImageInput:
        """Images of a robot's camera.

        Raises:
            ValueError: There is no such reading, or `every` is even, or does not divide both sides.
        """
        return cls(
            reading, **{name: getattr(camera, name) for name in _CAMERA}, every=every, scaling=SCALING.get(reading, "")
        )  # fmt: skip

    @classmethod
    def from_plain(cls, values: Any) -> ImageInput:
        """From what JSON makes of one.

        Raises:
            ValueError: A key is missing or unknown, or a value has no meaning.
        """
        kinds = {
            "reading": str,
            "scaling": str,
            "width": int,
            "height": int,
            "every": int,
            "mount": list | tuple,
        }
        if not isinstance(values, dict) or values.keys() != {f.name for f in fields(cls)}:
            raise ValueError(f"it must have {', '.join(f.name for f in fields(cls))}")
        for name, value in values.items():
            if not isinstance(value, kinds.get(name, int | float)) or isinstance(value, bool):
                raise ValueError(f"'{name}' is {value!r}")
        camera = CameraConfig(**{name: values[name] for name in _CAMERA} | {"mount": tuple(values["mount"])})
        found = cls.of(camera, values["reading"], every=values["every"])
        if found.scaling != values["scaling"]:
            raise ValueError(f"'scaling' is {values['scaling']!r}")
        return found

    @property
    def shape(self) -> tuple[int, int, int]:
        """Channels, rows and columns of the network's input `image`, which has the worlds before them."""
        return CHANNELS[self.reading], self.height // self.every, self.width // self.every

    @property
    def camera(self) -> CameraConfig:
        """A camera whose images are those pixels: the middles of its pixels lie where theirs do."""
        _, rows, columns = self.shape
        return CameraConfig(
            width=columns, height=rows, field_of_view=self.field_of_view, mount=self.mount, near=self.near, far=self.far
        )  # fmt: skip

    def taken(self, images: np.ndarray) -> np.ndarray:
        """What the network takes of images of the whole camera, or of `camera`.

        Args:
            images: As the camera gives them, shape (n, height, width) or (n, height, width, 3).

        Returns:
            Shape (n, channels, rows, columns), float32; the network scales them.
        """
        batch = images[..., None] if images.ndim == 3 else images
        if batch.shape[1] == self.height and self.every > 1:
            middle = self.every // 2
            batch = batch[:, middle :: self.every, middle :: self.every]
        return np.ascontiguousarray(np.moveaxis(batch, -1, 1), dtype=np.float32)

    def problem(self, robot: Robot, control_hz: float) -> str:
        """How the camera of a robot differs, as the end of a sentence; empty if it does not.

        Args:
            robot: The robot.
            control_hz: Rate of the policy, which needs an image for each command [Hz].
        """
        camera = robot.sensors.camera
        what = f"needs the reading '{self.reading}' of a camera of {self.width} × {self.height} px"
        if camera is None:
            return f"{what}, but '{robot.name}' has no camera. Add 'camera' to the 'sensors' of its file."
        for name in _CAMERA:
            trained, here = getattr(self, name), getattr(camera, name)
            if trained != here:
                return (
                    f"{what} with '{name}' = {_text(trained)}; the camera of '{robot.name}' has {_text(here)}. "
                    "Change that in its file, or train the policy again."
                )
        if camera.rate_hz < control_hz - 1e-9:
            return (
                f"{what} at {control_hz:g} Hz; that of '{robot.name}' has {camera.rate_hz:g} Hz. "
                "Raise 'rate_hz' in its file, or train the policy at a lower rate."
            )
        return ""


def _text(value: Any) -> str:
    return f"{list(value)}" if isinstance(value, tuple) else f"{value:g}"
