"""Images of cameras as files that a browser shows, made in a thread of their own. Knows no ROS."""

from __future__ import annotations

import io
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from PIL import Image as Pillow

from fulmar_console.source import Image

PERIOD_S = 0.1  # between two images of one camera at least [s]
QUALITY = 80
FARTHEST_M = 20.0  # that is white in an image of depth [m]
RGB, DEPTH, IDS = range(3)  # kinds of image
ENDS_S = 2.0
Key = tuple[int, int]  # index of the robot, and kind


@dataclass(frozen=True)
class RawImage:
    """An image as `sensor_msgs/Image` has it."""

    encoding: str
    height: int
    width: int
    data: bytes


def encoded(image: RawImage) -> bytes:
    """Colours as JPEG; depth in grey, near is dark, and ids in colours of their own as PNG.

    Raises:
        ValueError: It has another encoding, or not the bytes of its size.
    """
    shape = (image.height, image.width)
    if image.encoding == "32FC1":
        depth = np.nan_to_num(np.frombuffer(image.data, np.float32).reshape(shape), posinf=FARTHEST_M)
        grey = (255.0 * np.clip(depth / FARTHEST_M, 0.0, 1.0)).astype(np.uint8)
        return _file(Pillow.fromarray(grey), "PNG", compress_level=1)
    if image.encoding == "16UC1":
        ids = (np.frombuffer(image.data, np.uint16).reshape(shape) % len(PALETTE)).astype(np.uint8)
        shown = Pillow.fromarray(ids)
        shown.putpalette(PALETTE.tobytes())
        return _file(shown, "PNG", compress_level=1)
    if image.encoding in ("rgb8", "bgr8"):
        pixels = np.frombuffer(image.data, np.uint8).reshape(*shape, 3)
        if image.encoding == "bgr8":
            pixels = pixels[..., ::-1]
        return _file(Pillow.fromarray(np.ascontiguousarray(pixels)), "JPEG", quality=QUALITY)
    if image.encoding == "mono8":
        return _file(Pillow.fromarray(np.frombuffer(image.data, np.uint8).reshape(shape)), "JPEG")
    raise ValueError(
        f"an image has the encoding '{image.encoding}', must be rgb8, bgr8, mono8, 32FC1 or 16UC1"
    )


def _palette() -> np.ndarray:
    """256 colours, shape (256, 3): none is black, which is 0 alone; neighbours differ."""
    number = np.arange(256)
    colors = np.stack([64 + 191 * ((number * step) % 256) / 255.0 for step in (97, 57, 23)], axis=1)
    colors[0] = 0.0
    return colors.astype(np.uint8)


PALETTE = _palette()


def _file(image: Pillow.Image, form: str, **options: int) -> bytes:
    file = io.BytesIO()
    image.save(file, form, **options)
    return file.getvalue()


class CameraImages:
    """Encodes the newest image of each camera, ten a second at most; what comes meanwhile is left out."""

    def __init__(self) -> None:
        """Begin; `take` has what is done, `close` ends it."""
        self._wake = threading.Condition()
        self._raw: dict[Key, Callable[[], RawImage]] = {}
        self._done: dict[Key, Image] = {}
        self._last_s: dict[Key, float] = {}
        self._over = False
        self.problem = ""  # of the newest image that could not be shown; empty: none
        self._thread = threading.Thread(target=self._run, name="images", daemon=True)
        self._thread.start()

    def offer(self, key: Key, image: Callable[[], RawImage]) -> None:
        """Take an image, unless one of its camera was taken just now; `image` is called in another thread."""
        now = time.monotonic()
        if now - self._last_s.get(key, 0.0) < PERIOD_S:
            return
        self._last_s[key] = now
        with self._wake:
            self._raw[key] = image
            self._wake.notify()

    def take(self) -> list[Image]:
        """What was made since this was asked last, the newest of each camera."""
        if not self._done:
            return []
        with self._wake:
            done, self._done = self._done, {}
        return list(done.values())

    def close(self) -> None:
        """End the thread."""
        with self._wake:
            self._over = True
            self._wake.notify()
        self._thread.join(ENDS_S)

    def _run(self) -> None:
        while True:
            with self._wake:
                self._wake.wait_for(lambda: self._raw or self._over)
                if self._over:
                    return
                key = next(iter(self._raw))
                make = self._raw.pop(key)
            try:
                image = Image(key[0], key[1], encoded(make()))
            except (ValueError, OSError) as error:  # of a camera of one's own
                self.problem = str(error)
                continue
            with self._wake:
                self._done[key] = image
