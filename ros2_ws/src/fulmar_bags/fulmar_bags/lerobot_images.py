"""Images of cameras in a dataset of LeRobot: colours as video, depth and segmentation as PNG of 16 bits in the table.

A video would spoil distances and ids. Source: what LeRobot 0.4.4 writes; `tests/peers` loads ours with it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bags import frame_codecs as codecs
from fulmar_bags.contents import Bag
from fulmar_bags.frame_topics import Camera, camera_name, cameras
from fulmar_core.config.errors import BagError

VIDEO_PATH = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
CHUNK = 1000  # files of one folder
VIDEO_MB = 200  # an episode that begins beyond this begins another file
CODEC, CANONICAL = "libx264", "h264"
OPTIONS = {
    "crf": "18",
    "g": "2",
    "bf": "0",
}  # every second frame can be read without another, as LeRobot has it
SAMPLED = 100  # frames of an episode that statistics are of
SAMPLE_WIDTH = 150  # of them [px]
SIGNED = 2**15 - 1  # LeRobot reads 16 bits as a number with a sign
EIGHT_BITS = 255.0


@dataclass(frozen=True)
class Seen:
    """The cameras of one bag, by the key of their feature."""

    cameras: dict[str, Camera]
    notes: list[str] = field(default_factory=list)  # what of them could not be read

    @property
    def begin_ns(self) -> int:
        """When each of them has a frame; 0 without any [ns]."""
        return max((int(each.taken_ns[0]) for each in self.cameras.values()), default=0)

    def features(self, fps: float) -> dict[str, Any]:
        """What `info.json` says of them."""
        return {key: _feature(each, fps) for key, each in self.cameras.items()}


def seen_in(bag: Bag) -> Seen:
    """The cameras of a bag; a topic that cannot be read gets a note."""
    notes: list[str] = []
    found = cameras(bag.topics.values(), notes)
    return Seen(
        {f"observation.images.{camera_name(bag.relative(each.topic.name))}": each for each in found}, notes
    )


def _feature(camera: Camera, fps: float) -> dict[str, Any]:
    width, height = camera.first.size
    names = ["height", "width", "channels"]
    if camera.kind != "colour":
        return {"dtype": "image", "shape": [height, width, 1], "names": names}
    about = {
        "video.height": height,
        "video.width": width,
        "video.codec": CANONICAL,
        "video.pix_fmt": _pixel_format(width, height),
        "video.is_depth_map": False,
        "video.fps": int(fps),
        "video.channels": 3,
        "has_audio": False,
    }
    return {"dtype": "video", "shape": [height, width, 3], "names": names, "info": about}


def check_alike(every: Sequence[Seen]) -> None:
    """Refuse bags with other cameras than the first.

    Raises:
        BagError: On the first one.
    """

    def kinds(seen: Seen) -> dict[str, tuple[Any, ...]]:
        return {key: (each.kind, *each.first.size) for key, each in seen.cameras.items()}

    def words(seen: Seen) -> str:
        return (
            ", ".join(f"{key} ({kind}, {w} × {h})" for key, (kind, w, h) in kinds(seen).items())
            or "no camera"
        )

    for number, seen in enumerate(every):
        if kinds(seen) != kinds(every[0]):
            raise BagError(
                f"bag {number + 1} has {words(seen)}, the first one {words(every[0])}. Export them apart."
            )


@dataclass
class Statistics:
    """Samples of the pixels of one feature, as shares of 255 where they are colours."""

    samples: list[np.ndarray] = field(default_factory=list)  # each (pixels, channels)
    count: int = 0  # frames

    def add(self, pixels: np.ndarray) -> None:
        """Take a frame as a sample."""
        step = max(1, pixels.shape[1] // SAMPLE_WIDTH)
        values = pixels[::step, ::step].reshape(-1, pixels.shape[2] if pixels.ndim == 3 else 1)
        self.samples.append(values / EIGHT_BITS if pixels.dtype == np.uint8 else values.astype(float))

    def table(self) -> np.ndarray:
        """All samples, shape (pixels, channels)."""
        return np.concatenate(self.samples)


class Videos:
    """The videos of one feature: episodes one after the other, in files of limited size."""

    def __init__(self, folder: Path, key: str, fps: float) -> None:
        """Begin without a file."""
        self._folder, self._key, self._rate = folder, key, Fraction(fps).limit_denominator(1000)
        self._number, self._frames = -1, 0
        self._file: Any = None
        self._stream: Any = None

    def add(self, frames: Iterable[np.ndarray]) -> dict[str, Any]:
        """Add an episode; returns where it is, as the table of episodes says it."""
        import av  # FFmpeg, which a dataset without colours does not need

        begin, first = self._frames, True
        for pixels in frames:
            if first:
                begin, first = self._place_for(pixels), False
            image = av.VideoFrame.from_ndarray(np.ascontiguousarray(pixels), format="rgb24")
            image.pts, image.time_base = self._frames, 1 / self._rate
            self._file.mux(self._stream.encode(image))
            self._frames += 1
        chunk, file = divmod(self._number, CHUNK)
        prefix = f"videos/{self._key}"
        return {
            f"{prefix}/chunk_index": chunk,
            f"{prefix}/file_index": file,
            f"{prefix}/from_timestamp": float(begin / self._rate),
            f"{prefix}/to_timestamp": float(self._frames / self._rate),
        }

    def close(self) -> None:
        """Finish the file."""
        if self._file is not None:
            self._file.mux(self._stream.encode())
            self._file.close()
            self._file = None

    def _place_for(self, pixels: np.ndarray) -> int:
        """Frames that are in the file before this episode; a new file where there is none, or that one is full."""
        if self._file is None or self._path.stat().st_size > VIDEO_MB << 20:
            self.close()
            self._number, self._frames = self._number + 1, 0
            self._path.parent.mkdir(parents=True, exist_ok=True)
            import av

            self._file = av.open(str(self._path), "w")
            height, width = pixels.shape[:2]
            self._stream = self._file.add_stream(CODEC, rate=self._rate, options=OPTIONS)
            self._stream.width, self._stream.height = width, height
            self._stream.pix_fmt = _pixel_format(width, height)
        return self._frames

    @property
    def _path(self) -> Path:
        chunk, file = divmod(self._number, CHUNK)
        return self._folder / VIDEO_PATH.format(video_key=self._key, chunk_index=chunk, file_index=file)


def _pixel_format(width: int, height: int) -> str:
    return "yuv420p" if width % 2 == height % 2 == 0 else "yuv444p"  # the former halves both sides


def frames_at(camera: Camera, stamp_ns: np.ndarray, statistics: Statistics) -> Iterator[np.ndarray]:
    """Pixels of the newest frame at each step; a damaged one is as the one before.

    Args:
        camera: With a frame at the first step.
        stamp_ns: Of the steps, shape (n,) [ns].
        statistics: Gets samples of them.

    Yields:
        Colours (h, w, 3) uint8; whole millimetres or ids (h, w) uint16, at most 32767.
    """
    numbers = camera.newest(stamp_ns)
    sampled = set(np.linspace(0, len(numbers) - 1, min(len(numbers), SAMPLED)).round().astype(int).tolist())
    last, pixels = -1, _whole(camera.first.pixels, camera.kind)
    for step, number in enumerate(numbers.tolist()):
        if number != last:
            try:
                found = camera.frame(number)
                pixels = _whole(found.pixels, found.kind) if found.size == camera.first.size else pixels
            except BagError:
                pass
            last = number
        if step in sampled:
            statistics.add(pixels)
        yield pixels
    statistics.count += len(numbers)


def _whole(pixels: np.ndarray, kind: str) -> np.ndarray:
    if kind == "colour":
        return pixels
    numbers = codecs.millimetres(pixels) if kind == "depth" else pixels
    return np.where(numbers <= SIGNED, numbers, 0).astype(np.uint16)


def as_cells(frames: Iterable[np.ndarray]) -> np.ndarray:
    """Frames as PNG, an array of bytes, shape (n,)."""
    packed = [codecs.png(pixels) for pixels in frames]
    cells = np.empty(len(packed), dtype=object)
    cells[:] = packed
    return cells
