"""Images as readings: why one cannot be from the robot's camera, and how long it may be acted on."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.wires.reading import Reading

IMAGE_LASTS_S = 0.5  # older images are not acted on; as long as a watchdog waits for commands at most [s]
ENCODINGS = {"float32": "32FC1", "uint8": "rgb8"}  # by the type of the pixels


def depth_problem(reading: Reading, robot: Robot) -> str:
    """Why a reading is no depth image of a robot's camera; empty if it is: float32, shape (height, width) [m]."""
    return _pixels_problem(reading.value, robot, "float32", ()) or (
        "the depth image holds negative distances" if float(np.min(reading.value)) < 0.0 else ""
    )


def color_problem(reading: Reading, robot: Robot) -> str:
    """Why a reading is no colour image of a robot's camera; empty if it is: uint8, shape (height, width, 3)."""
    return _pixels_problem(reading.value, robot, "uint8", (3,))


def _pixels_problem(pixels: Any, robot: Robot, kind: str, channels: tuple[int, ...]) -> str:
    camera = robot.sensors.camera
    if camera is None:
        return f"an image came, but '{robot.name}' has no camera in its file"
    if pixels.dtype.name != kind or pixels.shape[2:] != channels:
        return f"the image has pixels of {pixels.dtype.name}, must be {ENCODINGS[kind]}"
    if pixels.shape[:2] != (camera.height, camera.width):
        height, width = pixels.shape[:2]
        return f"the image is {width} × {height} px, the camera of '{robot.name}' has {camera.width} × {camera.height}"
    return ""


def nothing_seen(robot: Robot, names: Iterable[str]) -> dict[str, np.ndarray]:
    """Images of a camera that looks at nothing, for one robot, of those readings that are images."""
    camera = robot.sensors.camera
    if camera is None:
        return {}
    size = (1, camera.height, camera.width)
    nothing: dict[str, np.ndarray] = {
        "camera_depth": np.full(size, np.inf, np.float32),
        "camera_image": np.zeros((*size, 3), np.uint8),
    }
    return {name: nothing[name] for name in names if name in nothing}
