"""The cameras of a bag: which topics hold frames, of what size and kind, and when each frame was taken."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_bags.decode import stamps_ns
from fulmar_bags.frame_messages import FRAME_TYPES, IMAGE, Frame, Kind, read_frame
from fulmar_bags.gathered import Topic
from fulmar_bags.stored_bytes import lengths_of
from fulmar_core.config.errors import BagError

PACKED_ENDINGS = ("/compressedDepth", "/compressed")  # behind the name of the raw topic, the better one first
PLAIN_ENDINGS = ("/image_raw", "/image_rect", "/image_color", "/image")  # that say nothing about a camera
LOOKED_AT = 5  # messages that may be damaged before the first frame
KINDS: tuple[Kind, ...] = ("colour", "depth", "segmentation")


@dataclass(frozen=True)
class Camera:
    """Frames of one kind of one camera.

    Attributes:
        topic: Its messages that can be read; they stay in their file until they are looked at.
        first: The first frame.
        taken_ns: When each was taken, by its stamp, or when it was recorded where it has none, shape (n,) [ns].
    """

    topic: Topic
    first: Frame
    taken_ns: np.ndarray

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.topic)

    @property
    def kind(self) -> Kind:
        """What the pixels are."""
        return self.first.kind

    def frame(self, number: int) -> Frame:
        """One of its frames.

        Raises:
            BagError: It is damaged.
        """
        return read_frame(self.topic.data[number], self.topic.type, self.topic.name)

    def newest(self, times_ns: np.ndarray) -> np.ndarray:
        """Number of the newest frame at each time [ns], -1 before the first; shape of the times."""
        return np.searchsorted(self.taken_ns, times_ns, side="right") - 1

    def nearest(self, time_ns: float) -> int:
        """Number of the frame that was taken nearest to a time [ns]."""
        return int(np.argmin(np.abs(self.taken_ns - time_ns)))


def cameras(topics: Iterable[Topic], problems: list[str] | None = None) -> list[Camera]:
    """The cameras of topics: one where a raw topic and packed ones have the same frames; colour before depth and ids.

    Args:
        topics: Of a bag, any.
        problems: Grows by a line for each topic whose frames cannot be read.
    """
    found: dict[str, Camera] = {}
    for topic in sorted(topics, key=_quality):
        if topic.type not in FRAME_TYPES or not len(topic.readable()) or _raw_name(topic.name) in found:
            continue
        try:
            found[_raw_name(topic.name)] = _camera(topic.readable())
        except BagError as error:
            if problems is not None:
                problems.append(str(error))
    return sorted(found.values(), key=lambda each: (KINDS.index(each.kind), each.topic.name))


def _camera(topic: Topic) -> Camera:
    first = first_frame(topic)
    stamps = stamps_ns(topic)
    stamped = stamps is not None and bool(np.all(stamps > 0))
    taken = stamps if stamped and stamps is not None else np.array(topic.log_ns, dtype=np.int64)
    if (np.diff(taken) < 0).any():
        order = np.argsort(taken, kind="stable")
        topic, taken = topic.chosen(order), taken[order]
    return Camera(topic, first, taken)


def first_frame(topic: Topic) -> Frame:
    """The first frame of a topic with messages; some of them may be damaged.

    Raises:
        BagError: That of the first message, where none of the first few can be read.
    """
    errors = []
    for data in topic.data[:LOOKED_AT]:
        try:
            return read_frame(data, topic.type, topic.name)
        except BagError as error:
            errors.append(error)
    raise errors[0]


def _raw_name(name: str) -> str:
    return next((name.removesuffix(end) for end in PACKED_ENDINGS if name.endswith(end)), name)


def _quality(topic: Topic) -> int:
    if topic.type == IMAGE:
        return 0
    return 1 + next(
        (i for i, end in enumerate(PACKED_ENDINGS) if topic.name.endswith(end)), len(PACKED_ENDINGS)
    )


def camera_name(topic: str) -> str:
    """Name of a camera by its topic without the robot's prefix: of `camera/depth/image_raw`, `camera_depth`."""
    name = _raw_name(topic)
    name = next((name.removesuffix(end) for end in PLAIN_ENDINGS if name.endswith(end)), name)
    return name.strip("/").replace("/", "_") or "camera"


def describe_frames(topic: Topic) -> dict[str, Any] | None:
    """What `fulmar bag info` says of the frames of a topic; None of a topic without any."""
    if topic.type not in FRAME_TYPES or not len(topic):
        return None
    try:
        first = first_frame(topic)
    except BagError as error:
        return {"problem": str(error)}
    width, height = first.size
    return {
        "kind": first.kind,
        "width": width,
        "height": height,
        "encoding": first.encoding,
        "mean_bytes": float(lengths_of(topic.data).mean()),
        "reach_m": first.reach if np.isfinite(first.reach) else None,
    }
