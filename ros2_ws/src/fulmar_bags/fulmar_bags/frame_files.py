"""The images of a bag as files, with a table of when and where each was taken."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bags import frame_codecs as codecs
from fulmar_bags.contents import Bag
from fulmar_bags.decode import NS, odometries
from fulmar_bags.frame_messages import COMPRESSED, Frame
from fulmar_bags.frame_topics import Camera, camera_name, cameras
from fulmar_bags.message_types import type_store
from fulmar_core.config.errors import BagError

TABLE = "frames.csv"
PLACE = ("x", "y", "z", "qx", "qy", "qz", "qw")
SLACK_S = 1.0  # beyond the odometry, in which an image still has a place [s]
JPEG = b"\xff\xd8\xff"  # how one begins


def write_frames(bag: Bag, folder: Path) -> tuple[Path, list[str]]:
    """Write a folder for each camera and kind, and a table beside them.

    Colours are JPEG as they were recorded, else PNG; depth is PNG of 16 bits in millimetres, 0 where nothing is;
    ids are PNG of 16 bits.

    Args:
        bag: Any with images.
        folder: Is made; what is in it under the same names is replaced.

    Returns:
        The table, and what is left out, in words.

    Raises:
        BagError: The bag has no image that can be read.
        OSError: The folder cannot be written.
    """
    left_out: list[str] = []
    seen = cameras(bag.topics.values(), left_out)
    if not seen:
        raise BagError(" ".join([f"{bag.path}: holds no image to export.", *left_out]))
    stamp_ns, poses = _path_of(bag)
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / TABLE).open("w", newline="", encoding="utf-8") as stream:
        table = csv.writer(stream)
        table.writerow(["camera", "kind", "file", "stamp_ns", *PLACE])
        for camera in seen:
            name = camera_name(bag.relative(camera.topic.name))
            for file, frame in _files(camera, folder / name, left_out):
                taken = int(frame.stamp_ns or 0)
                table.writerow([name, frame.kind, f"{name}/{file}", taken, *_place(taken, stamp_ns, poses)])
    return folder / TABLE, left_out


def _files(camera: Camera, folder: Path, left_out: list[str]) -> Iterator[tuple[str, Frame]]:
    """Write the images of one camera; gives the name of each file, and what is in it."""
    folder.mkdir(parents=True, exist_ok=True)
    damaged, lost = 0, 0
    for number in range(len(camera)):
        try:
            frame = camera.frame(number)
        except BagError:
            damaged += 1
            continue
        data, ending = _file_of(frame, camera.topic.data[number], camera.topic.type)
        if frame.kind == "depth":
            lost += int((np.isfinite(frame.pixels) & (frame.pixels > codecs.MOST / codecs.MILLIMETRES)).any())
        file = f"{number:06d}{ending}"
        (folder / file).write_bytes(data)
        yield file, frame
    left_out += [f"{camera.topic.name}: {damaged} images are damaged."] if damaged else []
    left_out += [f"{camera.topic.name}: of {lost} images what is farther than 65.5 m."] if lost else []


def _file_of(frame: Frame, message: bytes, kind: str) -> tuple[bytes, str]:
    if frame.kind == "depth":
        return codecs.png(codecs.millimetres(frame.pixels)), ".png"
    if kind == COMPRESSED and frame.kind == "colour":
        raw: Any = type_store().deserialize_cdr(message, kind)
        if bytes(raw.data[: len(JPEG)]) == JPEG:
            return bytes(raw.data), ".jpg"
    return codecs.png(np.ascontiguousarray(frame.pixels)), ".png"


def _path_of(bag: Bag) -> tuple[np.ndarray, np.ndarray]:
    """Stamps and poses of the odometry; none where the bag has none, or several to choose from."""
    try:
        seen = odometries(bag.odometry())
    except BagError:
        return np.zeros(0, dtype=np.int64), np.zeros((0, 7))
    return seen.stamp_ns, seen.pose


def _place(time_ns: int, stamp_ns: np.ndarray, poses: np.ndarray) -> list[float | str]:
    """The pose that was measured nearest to a time; empty where none was within a second."""
    if not len(stamp_ns):
        return [""] * len(PLACE)
    nearest = int(np.argmin(np.abs(stamp_ns - time_ns)))
    if abs(int(stamp_ns[nearest]) - time_ns) > SLACK_S * NS:
        return [""] * len(PLACE)
    return [float(value) for value in poses[nearest]]
