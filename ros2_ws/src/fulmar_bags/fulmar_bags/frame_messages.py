"""Messages with frames, sensor_msgs/Image and CompressedImage, as pixels; and raw ones as the smaller ones of bags."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from fulmar_bags import frame_codecs as codecs
from fulmar_bags.message_types import type_store
from fulmar_core.config.errors import BagError

IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
FRAME_TYPES = (IMAGE, COMPRESSED)
Kind = Literal["colour", "depth", "segmentation"]
NS = 1_000_000_000
LABELS = ("segment", "label", "mask", "semantic")  # in the names of topics whose numbers are ids
DEPTH_WORDS = "depth"  # in those whose whole numbers are millimetres

# Of raw frames: type of a number, how many a pixel has, and which of them are red, green and blue.
_ENCODINGS: Mapping[str, tuple[type, int, tuple[int, ...]]] = {
    "rgb8": (np.uint8, 3, (0, 1, 2)),
    "bgr8": (np.uint8, 3, (2, 1, 0)),
    "8UC3": (np.uint8, 3, (2, 1, 0)),
    "rgba8": (np.uint8, 4, (0, 1, 2)),
    "bgra8": (np.uint8, 4, (2, 1, 0)),
    "mono8": (np.uint8, 1, ()),
    "8UC1": (np.uint8, 1, ()),
    "mono16": (np.uint16, 1, ()),
    "16UC1": (np.uint16, 1, ()),
    "32FC1": (np.float32, 1, ()),
}


@dataclass(frozen=True)
class Frame:
    """What a camera saw at one time.

    Attributes:
        kind: What the pixels are.
        stamp_ns: When [ns].
        pixels: Colours (h, w, 3) uint8 RGB; depth (h, w) float32 [m], infinite where nothing is; ids (h, w) uint16.
        encoding: As the message says it.
        reach: Of a depth: what is farther was lost when it was packed [m].
    """

    kind: Kind
    stamp_ns: int
    pixels: np.ndarray
    encoding: str
    reach: float = np.inf

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [px]."""
        return self.pixels.shape[1], self.pixels.shape[0]


def read_frame(data: bytes, kind: str, topic: str) -> Frame:
    """A frame of a message in CDR, of one of `FRAME_TYPES`; the topic's name says what 16-bit numbers are.

    Raises:
        BagError: The message is damaged, or its encoding is none that is read; one line with the topic.
    """
    try:
        message: Any = type_store().deserialize_cdr(data, kind)
    except Exception as error:  # foreign bytes raise whatever they please
        raise BagError(f"{topic}: a message is no {kind}.") from error
    try:
        return _of_raw(message, topic) if kind == IMAGE else _of_compressed(message, topic)
    except BagError as error:
        raise BagError(f"{topic}: {error}.") from error


def _of_raw(message: Any, topic: str) -> Frame:
    name = str(message.encoding)
    number, count, order = _known(name)
    width, height, step = int(message.width), int(message.height), int(message.step)
    kind = np.dtype(number).newbyteorder(">" if message.is_bigendian else "<")
    row = width * count * kind.itemsize
    if not (width and height and step >= row and len(message.data) >= step * height):
        what = f"{width} × {height} of '{name}' with {step} bytes a row and {len(message.data)} in all"
        raise BagError(f"a frame is damaged: {what}")
    rows = np.asarray(message.data[: step * height], dtype=np.uint8).reshape(height, step)[:, :row]
    pixels: np.ndarray = (
        np.ascontiguousarray(rows).view(kind).astype(number, copy=False).reshape(height, width, count)
    )
    return _frame(message, topic, pixels[:, :, order] if order else pixels[:, :, 0], name)


def _known(name: str) -> tuple[type, int, tuple[int, ...]]:
    found = _ENCODINGS.get(name)
    if found is None:
        more = " (a raw sensor pattern: convert it with image_proc)" if name.startswith("bayer") else ""
        raise BagError(f"encoding '{name}' of frames is not read{more}; these are: {', '.join(_ENCODINGS)}")
    return found


def _of_compressed(message: Any, topic: str) -> Frame:
    form = str(message.format)
    original = form.partition(";")[0].strip()
    data = bytes(message.data)
    if "compressedDepth" in form:
        if "rvl" in form or not original.startswith(("16UC1", "32FC1", "mono16")):
            raise BagError(
                f"format '{form}' of depth is not read; 'compressedDepth png' of 32FC1 or 16UC1 is"
            )
        whole = not original.startswith("32FC1")
        reach = np.inf if whole else codecs.depth_limit(data)
        depth = codecs.read_compressed_depth(data, whole=whole)
        return Frame("depth", _stamp_ns(message), depth, form, reach)
    pixels = codecs.read_image(data)
    if pixels.ndim == 2 and original.startswith("bayer"):
        _known(original)
    return _frame(message, topic, pixels, form)


def _frame(message: Any, topic: str, pixels: np.ndarray, encoding: str) -> Frame:
    """A frame of pixels whose kind follows from what they are, and of whole numbers from the name of the topic."""
    labelled = any(word in topic.lower() for word in LABELS)
    kind: Kind = "colour"
    if pixels.dtype == np.float32:
        kind, pixels = "depth", np.where(pixels > 0.0, pixels, np.float32(np.inf))
    elif pixels.ndim == 2 and DEPTH_WORDS in topic.lower() and not labelled and pixels.dtype == np.uint16:
        kind, pixels = "depth", codecs.metres(pixels)
    elif pixels.ndim == 2 and (labelled or pixels.dtype == np.uint16):
        kind, pixels = "segmentation", pixels.astype(np.uint16)
    elif pixels.ndim == 2:
        pixels = np.repeat(pixels[:, :, None], 3, axis=2)
    return Frame(kind, _stamp_ns(message), pixels, encoding)


def _stamp_ns(message: Any) -> int:
    return int(message.header.stamp.sec) * NS + int(message.header.stamp.nanosec)


# What a bag keeps of a raw frame: ending of the topic, format, and its bytes. image_transport takes the colours of a
# JPEG for swapped where its format ends in rgb8. Depth is there twice: RViz reads the first, Foxglove the second.
Packing = tuple[str, str, Callable[[np.ndarray], bytes]]
PACKINGS: Mapping[Kind, tuple[Packing, ...]] = {
    "colour": (("/compressed", "rgb8; jpeg compressed bgr8", codecs.jpeg),),
    "depth": (
        ("/compressedDepth", "32FC1; compressedDepth png", codecs.compressed_depth),
        ("/compressed", "16UC1; png compressed", lambda depth: codecs.png(codecs.millimetres(depth))),
    ),
    "segmentation": (("/compressed", "mono16; png compressed", codecs.png),),
}


def packed(data: bytes, topic: str) -> list[tuple[str, bytes]]:
    """A raw frame as what a bag keeps of it: names of topics, each with its CompressedImage in CDR.

    Raises:
        BagError: As `read_frame`.
    """
    frame = read_frame(data, IMAGE, topic)
    store = type_store()
    header = store.deserialize_cdr(data, IMAGE).header  # type: ignore[attr-defined]
    return [
        (
            topic + ending,
            bytes(store.serialize_cdr(_compressed(header, form, pack(frame.pixels)), COMPRESSED)),
        )
        for ending, form, pack in PACKINGS[frame.kind]
    ]


def _compressed(header: Any, form: str, data: bytes) -> Any:
    new = type_store().types[COMPRESSED]
    return new(header=header, format=form, data=np.frombuffer(data, dtype=np.uint8))
