"""Bags for Rerun: one .rrd with robots, trails, goals, scalars, images and marks. Needs the extra `rerun`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr

from fulmar_console.bags.recording import Recording
from fulmar_console.exports.drawn_parts import DrawnPart, parts_of, rgba_of, structures_of
from fulmar_console.exports.played import Played, played_robots

TIMELINE = "time"  # seconds from the begin of the recording on
APPLICATION = "fulmar"
LEVELS = {"fault": "ERROR", "refused": "ERROR", "estop": "ERROR", "intervention": "WARN", "disturb": "WARN"}
KINDS = ("colour", "depth", "ids")


def write_rerun(recording: Recording, path: Path) -> Path:
    """Write a recording as a file that Rerun opens.

    Entities are `/ROBOT` (moves), `/ROBOT/body`, `/ROBOT_trail`, `/ROBOT_goal`, `/plots/ROBOT/...`, `/marks` and
    `/ROBOT_camera/colour`.

    Raises:
        OSError: The file cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    stream = rr.RecordingStream(APPLICATION, recording_id=recording.document["name"])
    stream.save(path)
    stream.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for robot in played_robots(recording):
        _write_robot(stream, robot)
        _write_images(stream, recording, robot)
    _write_marks(stream, recording.document["marks"])
    stream.flush()
    stream.disconnect()
    return path


def _write_robot(stream: rr.RecordingStream, robot: Played) -> None:
    name, color = robot.name, rgba_of(robot.record["color"])
    _write_parts(stream, f"/{name}/body", parts_of(robot.record))
    _write_parts(stream, "/things", structures_of(robot.record))
    times = [rr.TimeColumn(TIMELINE, duration=robot.column("t"))]
    pose = robot.poses
    moves = rr.Transform3D.columns(translation=pose[:, :3], quaternion=pose[:, 3:])
    stream.send_columns(f"/{name}", times, moves)
    stream.log(f"/{name}_trail", rr.LineStrips3D([pose[:, :3]], colors=[color]), static=True)
    for field in ("error", "latency", "level", *robot.shares):
        values = robot.column(field)
        known = np.isfinite(values)
        if known.any():
            at = [rr.TimeColumn(TIMELINE, duration=robot.column("t")[known])]
            path = f"/plots/{name}/{field.replace(':', '/')}"
            stream.send_columns(path, at, rr.Scalars.columns(scalars=values[known]))
    for t_s, target in robot.goals():
        stream.set_time(TIMELINE, duration=t_s)
        goal = rr.Ellipsoids3D(
            centers=[target[:3]], half_sizes=[[robot.tolerance_m] * 3], colors=[(60, 200, 90, 120)]
        )
        stream.log(f"/{name}_goal", goal)


def _write_parts(stream: rr.RecordingStream, path: str, parts: Sequence[DrawnPart]) -> None:
    """Meshes, and primitives, those of a shape together; a cone is drawn as a cylinder."""
    by_shape: dict[str, list[DrawnPart]] = {}
    for number, part in enumerate(parts):
        if part.mesh is not None:
            _write_mesh(stream, f"{path}/mesh_{number}", part, *part.mesh)
            continue
        by_shape.setdefault("cylinder" if part.shape == "cone" else part.shape, []).append(part)
    for shape, some in by_shape.items():
        sizes = np.array([part.size for part in some])
        common: dict[str, Any] = {
            "quaternions": [part.quat_xyzw for part in some],
            "colors": [[int(255 * each) for each in part.rgba] for part in some],
            "fill_mode": rr.components.FillMode.Solid,
        }
        at = [part.at for part in some]
        drawn: Any
        if shape == "cylinder":
            drawn = rr.Cylinders3D(lengths=sizes[:, 2], radii=0.5 * sizes[:, 0], centers=at, **common)
        elif shape == "capsule":
            straight = sizes[:, 2] - sizes[:, 0]
            # A capsule of Rerun begins at its origin.
            ends = [np.array(a) - 0.5 * s * _up(p) for a, s, p in zip(at, straight, some, strict=True)]
            drawn = rr.Capsules3D(lengths=straight, radii=0.5 * sizes[:, 0], translations=ends, **common)
        elif shape == "sphere":
            drawn = rr.Ellipsoids3D(half_sizes=0.5 * sizes, centers=at, **common)
        else:
            drawn = rr.Boxes3D(half_sizes=0.5 * sizes, centers=at, **common)
        stream.log(f"{path}/{shape}", drawn, static=True)


def _write_mesh(
    stream: rr.RecordingStream, path: str, part: DrawnPart, points: np.ndarray, corners: np.ndarray
) -> None:
    colors = np.tile([int(255 * each) for each in part.rgba], (len(points), 1))
    placed = rr.Transform3D(translation=part.at, quaternion=rr.Quaternion(xyzw=part.quat_xyzw))
    stream.log(path, placed, static=True)
    drawn = rr.Mesh3D(vertex_positions=points, triangle_indices=corners, vertex_colors=colors)
    stream.log(path, drawn, static=True)


def _up(part: DrawnPart) -> np.ndarray:
    """The z axis of a part in the frame of the body."""
    x, y, z, w = part.quat_xyzw
    return np.array((2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)))


def _write_images(stream: rr.RecordingStream, recording: Recording, robot: Played) -> None:
    for camera in recording.cameras.get(robot.index, ()):
        for number, t_s in enumerate(camera.t_s):
            image = camera.readable(number)
            if image is not None:
                stream.set_time(TIMELINE, duration=float(t_s))
                media = "image/png" if image.startswith(b"\x89PNG") else "image/jpeg"
                shown = rr.EncodedImage(contents=image, media_type=media)
                stream.log(f"/{robot.name}_camera/{KINDS[camera.kind]}", shown)


def _write_marks(stream: rr.RecordingStream, marks: Sequence[Mapping[str, Any]]) -> None:
    for mark in marks:
        stream.set_time(TIMELINE, duration=mark["t_s"])
        text = f"{mark['robot']}: {mark['kind']}: {mark['words']}"
        stream.log("/marks", rr.TextLog(text, level=LEVELS.get(mark["kind"], "INFO")))
