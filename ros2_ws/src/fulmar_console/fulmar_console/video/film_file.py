"""Films as files: MP4 by PyAV, animated WebP and GIF by Pillow."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterable, Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np
from PIL import Image

from fulmar_core.config.errors import ConfigError, did_you_mean

ENDINGS = (".mp4", ".webp", ".gif")
GIF_COLORS = 128
WEBP_QUALITY = 55  # of 100
MP4_QUALITY = "23"  # constant rate factor of H.264, less is better and larger
BEGUN = ".begun"  # behind the name of a file that is not whole yet
Frames = Iterable[np.ndarray]  # each uint8 (h, w, 3)


def check_film_path(path: Path, *, force: bool) -> None:
    """Refuse a file that cannot become a film, before anything is drawn.

    Raises:
        ConfigError: Its ending is not known, its folder is missing, it exists, or PyAV is missing.
    """
    if path.suffix.lower() not in ENDINGS:
        hint = did_you_mean(path.suffix.lower(), ENDINGS) if path.suffix else ""
        raise ConfigError(f"--video {path}: the name must end in {', '.join(ENDINGS)}.{hint}")
    if path.is_dir():
        raise ConfigError(f"--video {path}: this is a folder; name a file.")
    if not path.absolute().parent.is_dir():
        raise ConfigError(f"--video {path}: there is no folder {path.parent}.")
    if path.exists() and not force:
        raise ConfigError(f"--video {path}: exists already; --force replaces it.")
    if path.suffix.lower() == ".mp4" and importlib.util.find_spec("av") is None:
        raise ConfigError("an .mp4 needs PyAV: pip install 'fulmar[video]', or name a .webp or a .gif.")


def write_film(path: Path, frames: Frames, fps: float) -> None:
    """Write a film; a file of that name is replaced once the new one is whole.

    Args:
        path: Where to; its ending is the format.
        frames: All of one size, drawn while they are written.
        fps: Frames a second.

    Raises:
        ConfigError: The file cannot be written.
    """
    begun = path.with_name(f".{path.stem}{BEGUN}{path.suffix.lower()}")
    try:
        WRITERS[path.suffix.lower()](begun, iter(frames), fps)
        begun.replace(path)
    except OSError as error:
        raise ConfigError(f"--video {path}: {error.strerror or error}.") from error
    finally:
        begun.unlink(missing_ok=True)


def _mp4(path: Path, frames: Iterator[np.ndarray], fps: float) -> None:
    import av

    with av.open(str(path), "w", format="mp4") as container:
        stream = None
        for pixels in frames:
            if stream is None:
                rate = Fraction(fps).limit_denominator(1000)
                stream = container.add_stream("libx264", rate=rate, options={"crf": MP4_QUALITY})
                stream.height, stream.width = pixels.shape[:2]
                stream.pix_fmt = "yuv420p"
            for packet in stream.encode(av.VideoFrame.from_ndarray(pixels, format="rgb24")):
                container.mux(packet)
        if stream is not None:
            container.mux(stream.encode(None))


def _webp(path: Path, frames: Iterator[np.ndarray], fps: float) -> None:
    images = (Image.fromarray(pixels) for pixels in frames)
    next(images).save(
        path, save_all=True, append_images=images, duration=round(1000.0 / fps), loop=0,
        quality=WEBP_QUALITY, method=4, format="WEBP",
    )  # fmt: skip


def _gif(path: Path, frames: Iterator[np.ndarray], fps: float) -> None:
    images = (
        Image.fromarray(pixels).quantize(GIF_COLORS, dither=Image.Dither.NONE) for pixels in frames
    )  # each with colours of its own
    next(images).save(
        path, save_all=True, append_images=images, duration=round(1000.0 / fps), loop=0, optimize=False,
        format="GIF",
    )  # fmt: skip


WRITERS: dict[str, Callable[[Path, Iterator[np.ndarray], float], None]] = {
    ".mp4": _mp4,
    ".webp": _webp,
    ".gif": _gif,
}
