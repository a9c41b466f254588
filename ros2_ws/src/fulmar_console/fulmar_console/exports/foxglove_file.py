"""Bags for Foxglove: one MCAP with its own schemas, which it opens without a plugin. Needs the extra `foxglove`."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator
from functools import partial
from operator import itemgetter
from pathlib import Path

import numpy as np
from foxglove import Context, open_mcap

from fulmar_console.bags.bag_images import BagCamera
from fulmar_console.bags.recording import Recording
from fulmar_console.exports.foxglove_scene import NS, FoxgloveScene
from fulmar_console.exports.played import Played, played_robots

EPOCH_NS = NS  # of the first sample: a viewer takes 0 for no time
Step = tuple[float, Callable[[], None]]  # when [s], and what is published then


def write_foxglove(recording: Recording, path: Path) -> Path:
    """Write a recording as an MCAP file with scene, frames, poses, goals, signals, events and images.

    Raises:
        OSError: The file cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    context = Context()
    with open_mcap(path, allow_overwrite=True, context=context):
        for _, publish in steps_of(recording, FoxgloveScene(context)):
            publish()
    return path


def steps_of(recording: Recording, scene: FoxgloveScene, begin_ns: int = EPOCH_NS) -> Iterator[Step]:
    """Everything that a recording publishes on a scene, in its order.

    Args:
        recording: What is played.
        scene: Where.
        begin_ns: Stamp of its begin [ns].
    """
    robots = played_robots(recording)
    streams = [_samples(robot, scene, begin_ns) for robot in robots]
    streams += [_goals(robot, scene, begin_ns) for robot in robots]
    streams += [_images(recording, robot, scene, begin_ns) for robot in robots]
    return heapq.merge(*streams, _marks(recording, scene, begin_ns), key=itemgetter(0))


def _ns(t_s: float, begin_ns: int) -> int:
    return begin_ns + round(t_s * NS)


def _samples(robot: Played, scene: FoxgloveScene, begin_ns: int) -> Iterator[Step]:
    fields = ("error", "latency", "level", *robot.shares)
    names = [field.partition(":")[2] or field for field in fields]
    rows = np.column_stack([robot.column(field) for field in fields]).tolist()
    poses = robot.poses.tolist()
    for t_s, pose, row in zip(robot.column("t").tolist(), poses, rows, strict=True):

        def publish(t_s: float = t_s, pose: list[float] = pose, row: list[float] = row) -> None:
            scene.see(robot.record, pose, dict(zip(names, row, strict=True)), _ns(t_s, begin_ns))

        yield t_s, publish


def _goals(robot: Played, scene: FoxgloveScene, begin_ns: int) -> Iterator[Step]:
    for t_s, target in robot.goals():
        yield t_s, partial(scene.goal, robot.name, target, robot.tolerance_m, _ns(t_s, begin_ns))


def _images(recording: Recording, robot: Played, scene: FoxgloveScene, begin_ns: int) -> Iterator[Step]:
    for camera in recording.cameras.get(robot.index, ()):
        for number, t_s in enumerate(camera.t_s.tolist()):
            yield t_s, partial(_show, scene, robot.name, camera, number, _ns(t_s, begin_ns))


def _show(scene: FoxgloveScene, name: str, camera: BagCamera, number: int, time_ns: int) -> None:
    image = camera.readable(number)
    if image is not None:
        scene.image(name, camera.kind, image, time_ns)


def _marks(recording: Recording, scene: FoxgloveScene, begin_ns: int) -> Iterator[Step]:
    for mark in recording.document["marks"]:
        at = _ns(mark["t_s"], begin_ns)
        yield mark["t_s"], partial(scene.event, mark["robot"], mark["kind"], mark["words"], at)
