"""Frames of cameras as bytes: colours as JPEG, whole numbers as PNG of 16 bits, depth as image_transport packs it.

Sources: format strings of sensor_msgs/CompressedImage; `compressedDepth` of compressed_depth_image_transport: a header
of 12 bytes (int32 0, float32 A, float32 B), then a PNG of A/z + B, 0 where nothing is.
"""

from __future__ import annotations

import struct
from io import BytesIO

import numpy as np
from PIL import Image, UnidentifiedImageError

from fulmar_core.config.errors import BagError

QUALITY = 90  # of JPEG [%]
FASTEST = 1  # level of PNG: higher ones take several times as long for some percent
# Of compressedDepth: image_transport's own 10 m would lose all that is farther [m]. Its quantization of 100 makes steps
# of z²/10100, half of which is the error: 0.1 % at 20 m. What is nearer than 0.154 m reads as 0.154 m.
DEPTH_MAX, QUANTIZATION = 100.0, 100.0
MOST = 2**16 - 1  # of 16 bits
MILLIMETRES = 1000.0  # in a metre, as REP 118 has whole numbers of depth
HEADER = struct.Struct("<iff")
READ = ("JPEG", "PNG", "WEBP", "AVIF")  # what Pillow is asked to try


def jpeg(colours: np.ndarray) -> bytes:
    """Colours, shape (h, w, 3) uint8 RGB, as JPEG."""
    stream = BytesIO()
    Image.fromarray(colours).save(stream, "jpeg", quality=QUALITY)
    return stream.getvalue()


def png(numbers: np.ndarray) -> bytes:
    """Whole numbers, shape (h, w) uint8 or uint16, or colours, shape (h, w, 3) uint8, as PNG of as many bits."""
    stream = BytesIO()
    Image.fromarray(numbers).save(stream, "png", compress_level=FASTEST)
    return stream.getvalue()


def compressed_depth(
    depth: np.ndarray, *, depth_max: float = DEPTH_MAX, quantization: float = QUANTIZATION
) -> bytes:
    """Depth [m], shape (h, w), as `compressedDepth png`, without what is no distance or farther than `depth_max`."""
    a = quantization * (quantization + 1.0)
    b = 1.0 - a / depth_max
    depth = np.asarray(depth, dtype=np.float32)
    with np.errstate(divide="ignore", invalid="ignore"):
        there = (depth > 0.0) & (depth <= depth_max)
        packed = np.where(there, np.clip(np.rint(a / depth + b), 1.0, MOST), 0.0)
    return HEADER.pack(0, a, b) + png(packed.astype(np.uint16))


def millimetres(depth: np.ndarray) -> np.ndarray:
    """Depth [m] as whole millimetres, uint16; 0 where nothing is, or what is there is farther than 65.5 m."""
    with np.errstate(invalid="ignore"):
        whole = np.rint(np.asarray(depth, dtype=np.float64) * MILLIMETRES)
        return np.where((whole > 0.0) & (whole <= MOST), whole, 0.0).astype(np.uint16)


def metres(whole: np.ndarray) -> np.ndarray:
    """Depth [m], float32, of millimetres; infinite where they are 0."""
    return np.where(whole > 0, whole / np.float32(MILLIMETRES), np.float32(np.inf)).astype(np.float32)


def read_image(data: bytes) -> np.ndarray:
    """The pixels of a JPEG, PNG, WebP or AVIF.

    Returns:
        Colours (h, w, 3) uint8, or numbers (h, w) of uint8 or uint16.

    Raises:
        BagError: It is none of them, or damaged.
    """
    try:
        with Image.open(BytesIO(data), formats=READ) as image:
            image.load()
            if image.mode.startswith("I"):
                return np.asarray(image).astype(np.uint16)
            return np.asarray(image if image.mode == "L" else image.convert("RGB"))
    except (OSError, ValueError, SyntaxError, EOFError, Image.DecompressionBombError) as error:
        what = "is no JPEG, PNG, WebP or AVIF" if isinstance(error, UnidentifiedImageError) else "is damaged"
        raise BagError(f"the image {what} ({len(data)} bytes)") from error


def read_compressed_depth(data: bytes, *, whole: bool) -> np.ndarray:
    """Depth [m], shape (h, w) float32, of `compressedDepth png`; infinite where nothing is.

    Args:
        data: With its header, whose A and B count.
        whole: Whether it is of millimetres (`16UC1`), of which the header says nothing.

    Raises:
        BagError: It is damaged, or its header makes no distances.
    """
    packed = read_image(data[HEADER.size :])
    if packed.ndim != 2:
        raise BagError("the image of a depth has colours")
    if whole:
        return metres(packed)
    _, a, b = HEADER.unpack_from(data)
    if not (np.isfinite((a, b)).all() and a > 0.0):
        raise BagError(f"the header of the depth is damaged (A = {a:g}, B = {b:g})")
    with np.errstate(divide="ignore"):
        depth = np.float32(a) / (packed.astype(np.float32) - np.float32(b))
    return np.where((packed > 0) & (depth > 0.0), depth, np.float32(np.inf)).astype(np.float32)


def depth_limit(data: bytes) -> float:
    """How far a `compressedDepth` of float32 reaches [m]; infinite if it does not say."""
    if len(data) < HEADER.size:
        return np.inf
    _, a, b = HEADER.unpack_from(data)
    return float(a / (1.0 - b)) if a > 0.0 and b < 1.0 else np.inf
