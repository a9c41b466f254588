"""sensor_msgs/Image read from its bytes (CDR) without copying the pixels one by one, and its pixels as an array."""

from __future__ import annotations

import struct
from types import SimpleNamespace
from typing import Any

import numpy as np

PIXELS = {"32FC1": (np.float32, 1), "rgb8": (np.uint8, 3)}  # type and channels


def read_image(data: bytes) -> SimpleNamespace:
    """The message with the fields of a ROS one, its `data` as an array of bytes that shares memory with `data`.

    Raises:
        ValueError: The bytes are no such message.
    """
    order = "<" if data[1:2] == b"\x01" else ">"
    try:
        seconds, rest, size = struct.unpack_from(f"{order}iII", data, 4)
        at = _aligned(16 + size)
        height, width, letters = struct.unpack_from(f"{order}III", data, at)
        encoding = data[at + 12 : at + 11 + letters].decode()
        at += 12 + letters
        swapped = data[at]
        step, count = struct.unpack_from(f"{order}II", data, _aligned(at + 1))
        at = _aligned(at + 1) + 8
    except (struct.error, IndexError, UnicodeDecodeError) as error:
        raise ValueError(f"no message of an image: {error}") from error
    if len(data) < at + count:
        raise ValueError(f"no message of an image: {len(data) - at} of {count} bytes of pixels")
    header = SimpleNamespace(stamp=SimpleNamespace(sec=seconds, nanosec=rest))
    return SimpleNamespace(
        header=header, height=height, width=width, encoding=encoding, is_bigendian=swapped, step=step,
        data=np.frombuffer(data, np.uint8, count, at),
    )  # fmt: skip


def pixels_of(message: Any, encoding: str) -> np.ndarray | str:
    """Pixels of an image of one encoding of `PIXELS`, or why they cannot be read.

    Returns:
        Shape (height, width), or (height, width, channels) of several; a copy of its own.
    """
    kind, channels = PIXELS[encoding]
    height, width, step = int(message.height), int(message.width), int(message.step)
    if message.encoding != encoding or message.is_bigendian:
        ending = ", big-endian" if message.is_bigendian else ""
        return f"the image is '{str(message.encoding)[:20]}'{ending}, must be '{encoding}'"
    row, data = width * channels * np.dtype(kind).itemsize, np.asarray(message.data, dtype=np.uint8)
    if not height or not width or step < row or len(data) != step * height:
        return f"the image is damaged: {len(data)} bytes for {width} × {height} px with {step} a row"
    pixels = np.ascontiguousarray(data.reshape(height, step)[:, :row]).view(kind)
    return pixels.reshape((height, width, channels)[: 3 if channels > 1 else 2]).copy()


def _aligned(at: int) -> int:
    """The next place for a number of four bytes; the first four bytes of a message do not count."""
    return (at + 3) // 4 * 4
