"""A process of its own for what draws: OpenGL and a compiler that torch brings do not live in one."""

from __future__ import annotations

import atexit
import functools
import multiprocessing
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np

from fulmar_core.robots.sensors.camera import CameraConfig
from fulmar_core.worlds.structures import KeepOut, Part, Structure
from sim_nodes.camera.renderer import Frames, Renderer

AT_REST = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])


@functools.cache
def _process() -> ProcessPoolExecutor:
    pool = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"))
    atexit.register(pool.shutdown, cancel_futures=True)
    return pool


def drawn_by(function: Callable[..., Any], *arguments: Any, **more: Any) -> Any:
    """What a function of a module returns there."""
    return _process().submit(function, *arguments, **more).result(timeout=60.0)


def drawn(camera: CameraConfig, structures: tuple[Structure, ...] = (), **more: Any) -> Frames:
    """What a camera sees; keywords as `Renderer` takes them, and `pose` and `poses` as `render` does."""
    found: Frames = drawn_by(_draw, camera, structures, **more)
    return found


def _draw(
    camera: CameraConfig,
    structures: tuple[Structure, ...],
    *,
    pose: Any = AT_REST,
    poses: Any = None,
    **more: Any,
) -> Frames:
    with Renderer(camera, structures, **more) as renderer:
        return renderer.render(pose, poses)


def alone(shape: Any, size: tuple[float, ...], at: tuple[float, ...], semantic: str = "module") -> Structure:
    """A structure of one part, upright."""
    part = Part("part", shape, size, (*at, 1.0, 0.0, 0.0, 0.0), semantic, (0.8, 0.5, 0.3))
    return Structure("one_part", "one part", (part,), KeepOut((0.0,) * 3, (0.0,) * 3, 1.0), 1.0)
