"""Images of a camera as messages of ROS."""

from __future__ import annotations

import numpy as np
from sensor_msgs.msg import CameraInfo, Image

from fulmar_core.robots.sensors.camera import CameraConfig
from fulmar_ros.convert import stamp_of

ENCODINGS = {"uint8": "rgb8", "float32": "32FC1", "uint16": "16UC1"}


def image_messages(
    rgb: np.ndarray, depth: np.ndarray, segmentation: np.ndarray, frame: str, time_ns: int
) -> list[Image]:
    """Messages of one view, in the order of `CAMERA_IMAGES`.

    Args:
        rgb: uint8 (h, w, 3).
        depth: float32 (h, w) [m].
        segmentation: uint16 (h, w).
        frame: The camera's optical frame.
        time_ns: When it was seen [ns].
    """
    return [_message(pixels, frame, time_ns) for pixels in (rgb, depth, segmentation)]


def _message(pixels: np.ndarray, frame: str, time_ns: int) -> Image:
    height, width = pixels.shape[:2]
    message = Image(height=height, width=width, encoding=ENCODINGS[pixels.dtype.name], is_bigendian=0)
    message.header.stamp, message.header.frame_id = stamp_of(time_ns), frame
    message.step = pixels[0].nbytes
    message.data.frombytes(np.ascontiguousarray(pixels).data.cast("B"))
    return message


def info_of(camera: CameraConfig, frame: str) -> CameraInfo:
    """Intrinsics of a pinhole without distortion, to which a stamp is to be given."""
    k = camera.intrinsics
    message = CameraInfo(height=camera.height, width=camera.width, distortion_model="plumb_bob", d=[0.0] * 5)
    message.header.frame_id = frame
    message.k, message.r = k.ravel().tolist(), np.eye(3).ravel().tolist()
    message.p = np.column_stack((k, np.zeros(3))).ravel().tolist()
    return message
