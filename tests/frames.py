"""Frames of a camera without one: a ball before a dark background, and bags with them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from fulmar_bags.frame_messages import COMPRESSED, IMAGE
from fulmar_bags.message_types import type_store
from fulmar_bags.writer import BagWriter

NS = 1_000_000_000
START_NS = 1_700_000_000 * NS
COLOUR, DEPTH, IDS = "camera/image_raw", "camera/depth/image_raw", "camera/segmentation/image_raw"
ENCODINGS = {COLOUR: "rgb8", DEPTH: "32FC1", IDS: "16UC1"}
SIZE = (64, 48)  # [px]
BALL = 300  # its id


def scene(number: int = 0, size: tuple[int, int] = SIZE) -> dict[str, np.ndarray]:
    """Pixels by topic: a ball at 2 m that moves to the right and away by the number of the frame."""
    width, height = size
    y, x = np.mgrid[:height, :width]
    ball = (x - width / 2 - number) ** 2 + (y - height / 2) ** 2 < (height / 4) ** 2
    shade = np.stack((200.0 - x, 120.0 + 0 * x, 2.0 * y), axis=-1) * ball[:, :, None]
    depth = np.where(ball, 2.0 + 0.1 * number + 0.01 * x, np.inf)
    return {
        COLOUR: shade.clip(0, 255).astype(np.uint8),
        DEPTH: depth.astype(np.float32),
        IDS: np.where(ball, BALL, 0).astype(np.uint16),
    }


def _header(time_s: float) -> object:
    new = type_store().types
    stamp = new["builtin_interfaces/msg/Time"](*divmod(round(time_s * NS), NS))
    return new["std_msgs/msg/Header"](stamp, "camera_optical_frame")


def raw(
    pixels: np.ndarray, encoding: str, time_s: float = 1.0, *, padding: int = 0, big: bool = False
) -> bytes:
    """An Image in CDR; `padding` bytes follow each row."""
    height, width = pixels.shape[:2]
    rows = np.ascontiguousarray(pixels.astype(pixels.dtype.newbyteorder(">")) if big else pixels)
    rows = rows.view(np.uint8).reshape(height, -1)
    rows = np.pad(rows, ((0, 0), (0, padding)))
    message = type_store().types[IMAGE](
        _header(time_s), height, width, encoding, int(big), rows.shape[1], rows.reshape(-1)
    )
    return bytes(type_store().serialize_cdr(message, IMAGE))


def compressed(data: bytes, form: str, time_s: float = 1.0) -> bytes:
    """A CompressedImage in CDR."""
    message = type_store().types[COMPRESSED](_header(time_s), form, np.frombuffer(data, np.uint8))
    return bytes(type_store().serialize_cdr(message, COMPRESSED))


def read_back(data: bytes, kind: str = COMPRESSED) -> object:
    return type_store().deserialize_cdr(data, kind)


def write_messages(
    folder: Path, messages: Mapping[str, tuple[str, Sequence[bytes]]], hz: float = 10.0, info: object = None
) -> Path:
    """A bag of messages by topic, with the type of each topic, at one rate."""
    bag = BagWriter(folder, run_info=info or {})
    for topic, (kind, _) in messages.items():
        bag.add_topic(topic, kind, "stream")
    order = sorted((i, topic) for topic, (_, each) in messages.items() for i in range(len(each)))
    for i, topic in order:
        bag.write(topic, messages[topic][1][i], log_ns=START_NS + round(i * NS / hz))
    bag.close()
    return folder
