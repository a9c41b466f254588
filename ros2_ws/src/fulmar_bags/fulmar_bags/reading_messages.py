"""Messages to readings: by the row of a sensor, and a line for each wire that is no sensor's."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fulmar_bags.event_packets import events_of_cloud
from fulmar_bags.image_bytes import pixels_of
from fulmar_bags.message_reader import reading_of, stamp_ns
from fulmar_core.config.errors import shortened
from fulmar_core.estimators.readings import ReadingKind
from fulmar_core.robots.topics import (
    CAMERA_DEPTH,
    CAMERA_IMAGE,
    EVENTS,
    EVENTS_2,
    INERTIA,
    MOCAP,
    RATE,
    Wire,
)
from fulmar_core.wires.reading import Reading
from fulmar_core.wires.robot_name import Frames

FRAMES = ("odom", "map", "world")  # names of the room in motion captures; all with Z up
Read = Callable[[Any, Frames], Reading | str]  # a reading, or why there is none


def reader_of(kind: ReadingKind) -> Read:
    """What makes a reading of a message."""
    sensor = kind.sensor
    if sensor is None:
        return READERS[kind.wire]
    return lambda message, _frames: reading_of(message, sensor)


def _pose(message: Any, frames: Frames) -> Reading | str:
    frame = frames.plain(message.header.frame_id)
    if frame not in FRAMES:
        return f"pose is in '{shortened(frame)}', must be in one of {', '.join(FRAMES)}"
    p, q = message.pose.position, message.pose.orientation
    return Reading(np.array([p.x, p.y, p.z, q.x, q.y, q.z, q.w]), stamp_ns(message.header.stamp))


def _rate(message: Any, _frames: Frames) -> Reading | str:
    turning = message.twist.twist.angular
    covariance = np.array(message.twist.covariance).reshape(6, 6)[3:, 3:]
    if not (np.isfinite(covariance).all() and np.diag(covariance).min() > 0.0):
        return "rate has a covariance that is not positive"
    return Reading(
        np.array([turning.x, turning.y, turning.z]), stamp_ns(message.header.stamp), covariance=covariance
    )


def _inertia(message: Any, _frames: Frames) -> Reading:
    its = message.inertia
    tensor = np.array([[its.ixx, its.ixy, its.ixz], [its.ixy, its.iyy, its.iyz], [its.ixz, its.iyz, its.izz]])
    return Reading(tensor, stamp_ns(message.header.stamp))


def _events(message: Any, _frames: Frames) -> Reading | str:
    events, problem = events_of_cloud(message)
    return problem if events is None else Reading(events, stamp_ns(message.header.stamp))


def _depth(message: Any, _frames: Frames) -> Reading | str:
    pixels = pixels_of(message, "32FC1")
    if isinstance(pixels, str):
        return pixels
    # REP 118: NaN is a pixel that the camera could not measure, which is as good as one where nothing is.
    return Reading(np.where(np.isnan(pixels), np.float32(np.inf), pixels), stamp_ns(message.header.stamp))


def _color(message: Any, _frames: Frames) -> Reading | str:
    pixels = pixels_of(message, "rgb8")
    return pixels if isinstance(pixels, str) else Reading(pixels, stamp_ns(message.header.stamp))


READERS: dict[Wire, Read] = {
    MOCAP: _pose,
    RATE: _rate,
    INERTIA: _inertia,
    EVENTS: _events,
    EVENTS_2: _events,
    CAMERA_DEPTH: _depth,
    CAMERA_IMAGE: _color,
}
