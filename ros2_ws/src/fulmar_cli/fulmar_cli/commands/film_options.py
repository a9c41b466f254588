"""Options of `fulmar report` that make a film of runs."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from fulmar_bringup.console import log_line
from fulmar_core.config.errors import ConfigError

SMALLEST_PX, LARGEST_PX = 64, 3840
FASTEST_FPS = 60.0
MOST_SPEED = 1000.0
PLAIN_FPS = {".mp4": 25.0}  # other formats are for pages, where files are to be small
SMALL_FPS = 12.5
REPORT_S = 5.0  # between two lines where nothing can be overwritten
BAR = 30  # characters


def film(
    bags: Sequence[Path], path: Path, *, size: str, fps: float | None, speed: float, span: str, force: bool
) -> None:
    """Make the film that the options ask for.

    Raises:
        ConfigError: An option is wrong, or the film cannot be made; see `make_film`.
        BagError: A bag cannot be read.
    """
    if fps is not None and not 0.0 < fps <= FASTEST_FPS:
        raise ConfigError(f"--fps {fps:g}: must be above 0, at most {FASTEST_FPS:g}.")
    if not 0.0 < speed <= MOST_SPEED:
        raise ConfigError(f"--speed {speed:g}: must be above 0, at most {MOST_SPEED:g}.")
    sizes, spans = size_of(size), span_of(span)
    from fulmar_console.video.film import FilmSettings, make_film

    settings = FilmSettings(sizes, fps or PLAIN_FPS.get(path.suffix.lower(), SMALL_FPS), speed, spans)
    for note in make_film(bags, path, settings, progress_line(), force=force):
        log_line(f"warning: {note}")


def size_of(text: str) -> tuple[int, int]:
    """Width and height of a text such as 960x540 [px]; even, as H.264 wants them.

    Raises:
        ConfigError: It is none.
    """
    parts = text.lower().split("x")
    if len(parts) != 2 or not all(part.isdecimal() and len(part) < 6 for part in parts):
        raise ConfigError(f"--size {text}: must be WIDTHxHEIGHT, such as 960x540.")
    width, height = (int(part) for part in parts)
    if not all(SMALLEST_PX <= each <= LARGEST_PX and each % 2 == 0 for each in (width, height)):
        raise ConfigError(f"--size {text}: both must be even, from {SMALLEST_PX} to {LARGEST_PX}.")
    return width, height


def span_of(text: str) -> tuple[float, float]:
    """From when to when, of a text such as 5,20 or 5 [s]; all where it is empty.

    Raises:
        ConfigError: It is none.
    """
    if not text:
        return 0.0, math.inf
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 2) or not all(math.isfinite(each) for each in numbers):
        raise ConfigError(f"--span {text}: must be BEGIN or BEGIN,END in seconds, such as 5,20.")
    begin, end = (*numbers, math.inf)[:2]
    if begin < 0.0 or end <= begin:
        raise ConfigError(f"--span {text}: must begin at 0 or later, and end after that.")
    return begin, end


def progress_line() -> Callable[[float, str], None]:
    """Shows how far work has come on standard error: a bar on a terminal, else a line now and then."""
    terminal = sys.stderr.isatty()
    last = time.monotonic()

    def show(share: float, words: str) -> None:
        nonlocal last
        now = time.monotonic()
        if terminal:
            done = round(BAR * share)
            end = "\n" if share >= 1.0 else ""
            sys.stderr.write(f"\r[{'=' * done}{' ' * (BAR - done)}] {words:<40.40}{end}")
            sys.stderr.flush()
        elif now - last >= REPORT_S:
            last = now
            log_line(f"{words} ({100.0 * share:.0f} %)")

    return show
