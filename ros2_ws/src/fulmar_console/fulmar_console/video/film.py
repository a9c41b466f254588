"""`fulmar report --video`: recorded runs as a film, several of them side by side."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fulmar_console.bags.paths import bags_of
from fulmar_console.bags.recording import read_recording
from fulmar_console.video.film_file import check_film_path, write_film
from fulmar_console.video.scene import Scene
from fulmar_core.config.errors import ConfigError
from sim_nodes.camera.opengl import context, find_platform

MOST_BAGS = 9
Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class FilmSettings:
    """How a film is made.

    Attributes:
        size: Width and height [px].
        fps: Frames a second.
        speed: Seconds of the run a second of the film.
        span: From when to when of the runs [s].
    """

    size: tuple[int, int] = (960, 540)
    fps: float = 25.0
    speed: float = 1.0
    span: tuple[float, float] = (0.0, math.inf)


def make_film(
    bags: Sequence[Path], path: Path, settings: FilmSettings, progress: Progress, *, force: bool
) -> list[str]:
    """Write a film of recorded runs; those of several bags are in a grid, and begin together.

    Args:
        bags: Each a bag, or a folder with the bags of one system.
        path: Of the film; its ending says the format.
        settings: Size, pace and part of the runs.
        progress: Is called with the share of the work and what is being done.
        force: Whether a file is replaced.

    Returns:
        What could not be read of the bags.

    Raises:
        ConfigError: The film cannot be written, or nothing can draw here.
        BagError: A bag cannot be read, or holds no robot.
    """
    check_film_path(path, force=force)
    if len(bags) > MOST_BAGS:
        raise ConfigError(f"--video shows up to {MOST_BAGS} bags, not {len(bags)}.")
    platform = find_platform()
    recordings = [
        read_recording(bags_of(bag), bag.resolve().name, lambda _share, words: progress(0.0, words))
        for bag in bags
    ]
    notes = [note for recording in recordings for note in recording.document["notes"]]
    columns = math.ceil(math.sqrt(len(bags)))
    rows = math.ceil(len(bags) / columns)
    tile = settings.size[0] // columns // 2 * 2, settings.size[1] // rows // 2 * 2
    begin, end = settings.span
    end = min(end, max(recording.document["seconds"] for recording in recordings))
    if end <= begin:
        raise ConfigError(f"--span begins at {begin:g} s, and the runs end after {end:g} s.")
    times = np.arange(begin, end, settings.speed / settings.fps)
    with contextlib.ExitStack() as stack:
        drawing = stack.enter_context(context(platform, *tile))
        scenes = [stack.enter_context(contextlib.closing(Scene(each, tile, drawing))) for each in recordings]
        write_film(path, _frames(scenes, times, (columns, rows), progress), settings.fps)
    return notes


def _frames(
    scenes: Sequence[Scene], times: np.ndarray, grid: tuple[int, int], progress: Progress
) -> Iterator[np.ndarray]:
    columns, rows = grid
    for number, t_s in enumerate(times):
        tiles = [scene.frame(float(t_s)) for scene in scenes]
        empty = np.zeros_like(tiles[0])
        tiles += [empty] * (columns * rows - len(tiles))
        progress((number + 1) / len(times), f"frame {number + 1} of {len(times)}")
        yield np.vstack([np.hstack(tiles[row * columns : (row + 1) * columns]) for row in range(rows)])
