"""Images of a robot's cameras in a bag: when each was taken, and one of them as a file for the page."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import Any

import numpy as np
from PIL import Image as Pillow

from fulmar_bags.contents import Bag
from fulmar_bags.frame_messages import COMPRESSED, Frame
from fulmar_bags.frame_topics import Camera, cameras
from fulmar_bags.message_types import type_store
from fulmar_console.bags.robot_time import RobotTime
from fulmar_core.config.errors import BagError

KINDS = ("colour", "depth", "segmentation")  # by their number on the page
JPEG, PNG = b"\xff\xd8\xff", b"\x89PNG"
FARTHEST_M = 20.0  # what is farther is white, our value [m]
HUE_STEP = 0.381966  # of neighbouring ids: the golden section keeps them apart
QUALITY = 85


@dataclass(frozen=True)
class BagCamera:
    """One kind of images of one robot, and when each was taken on the page's time line [s]."""

    kind: int
    camera: Camera
    t_s: np.ndarray

    def readable(self, number: int) -> bytes | None:
        """An image; None where there is none of this number, or it is damaged."""
        if not 0 <= number < len(self.camera):
            return None
        try:
            return self.image(number)
        except BagError:
            return None

    def image(self, number: int) -> bytes:
        """JPEG or PNG of an image by its number; colours as they were recorded.

        Raises:
            BagError: It is damaged.
        """
        topic = self.camera.topic
        if topic.type == COMPRESSED and self.kind == 0:
            raw: Any = type_store().deserialize_cdr(topic.data[number], topic.type)
            data = bytes(raw.data)
            if data.startswith((JPEG, PNG)):
                return data
        return _encoded(self.camera.frame(number))


def cameras_of(bag: Bag, time: RobotTime) -> list[BagCamera]:
    """The cameras of a robot; the first of each kind."""
    own = [topic for topic in bag.topics.values() if topic.name.startswith(bag.prefix)]
    found: dict[int, BagCamera] = {}
    for camera in cameras(own):
        logs = np.array(camera.topic.log_ns, dtype=np.int64)
        t_s = np.maximum.accumulate(time.at_stamp(camera.taken_ns, logs))
        found.setdefault(KINDS.index(camera.kind), BagCamera(KINDS.index(camera.kind), camera, t_s))
    return list(found.values())


def _encoded(frame: Frame) -> bytes:
    """A frame as JPEG or PNG: depth in grey, near is dark; ids in colours."""
    pixels = frame.pixels
    file = io.BytesIO()
    if frame.kind == "depth":
        near = np.nan_to_num(pixels, nan=FARTHEST_M, posinf=FARTHEST_M)
        Pillow.fromarray((255.0 * (near / FARTHEST_M).clip(0.0, 1.0)).astype(np.uint8)).save(
            file, "JPEG", quality=QUALITY
        )
    elif frame.kind == "segmentation":
        Pillow.fromarray(_colours(pixels)).save(file, "PNG")
    else:
        Pillow.fromarray(np.ascontiguousarray(pixels, dtype=np.uint8)).save(file, "JPEG", quality=QUALITY)
    return file.getvalue()


def _colours(ids: np.ndarray) -> np.ndarray:
    """A colour for each id, black for none."""
    hue = 6.0 * ((ids * HUE_STEP) % 1.0)
    parts = [np.clip(np.abs((hue + shift) % 6.0 - 3.0) - 1.0, 0.0, 1.0) for shift in (0.0, 4.0, 2.0)]
    return (np.stack(parts, axis=-1) * np.where(ids > 0, 230.0, 0.0)[..., None]).astype(np.uint8)
