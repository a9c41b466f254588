"""What the page plays of one bag, or of the bags of one system: a JSON document, columns of float32, and images."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bags.decode import NS, Odometries, Vectors, odometries
from fulmar_bags.gathered import Topic
from fulmar_bags.message_reader import thing_of
from fulmar_console.bags.bag_images import BagCamera, cameras_of
from fulmar_console.bags.goal_errors import error_label, goal_errors
from fulmar_console.bags.history import Diagnostics, History, diagnostics_of, history_of
from fulmar_console.bags.recorded_robot import RecordedRobot, open_shown, robots_of
from fulmar_console.bags.robot_time import RobotTime, robot_time
from fulmar_console.bags.track import (
    POSE,
    Track,
    even_times,
    held_at,
    latencies_at,
    levels_at,
    poses_at,
    rate_of,
    shares_at,
    things_at,
)
from fulmar_console.colors import color_of
from fulmar_console.live.places import AT_ORIGIN, moved_all
from fulmar_core.config.errors import BagError
from fulmar_core.robots.topics import ACTUATORS_STATE, COMMAND, ODOMETRY, VELOCITY_COMMAND, thing_wire

READING = 0.7  # share of the work that reading files is, about
_NO_TIMES = np.zeros(0, dtype=np.int64)
NOTHING = ((), _NO_TIMES, _NO_TIMES, _NO_TIMES, np.zeros((0, 0)), 0)
Progress = Callable[[float, str], None]  # share of the work, and what is being done


@dataclass
class Recording:
    """Everything that the page plays of one argument of the command.

    Attributes:
        document: For JSON; see docs/bags.md, "On the page".
        columns: float32, little endian: the tracks one after the other.
        cameras: Of each robot, by its index.
    """

    document: dict[str, Any]
    columns: bytes
    cameras: dict[int, list[BagCamera]] = field(default_factory=dict)


@dataclass(frozen=True)
class _Part:
    """One robot with its odometry and its diagnostics."""

    robot: RecordedRobot
    odometry: Odometries
    diagnostics: Diagnostics

    @property
    def lockstep(self) -> bool:
        return bool((self.robot.bag.info or {}).get("lockstep"))


def read_recording(paths: Sequence[Path], name: str, progress: Progress) -> Recording:
    """Read one bag, or the bags of one system, whose robots share a time line.

    Args:
        paths: Of the bags.
        name: For people.
        progress: Is called with what is done meanwhile.

    Raises:
        BagError: None of them can be read, or none holds a robot.
    """
    parts, notes = _parts(paths, progress)
    begins = _begins(parts)
    times = [
        robot_time(part.odometry.stamp_ns, part.odometry.log_ns, begin)
        for part, begin in zip(parts, begins, strict=True)
    ]
    seconds = max(float(time.t_s[-1]) for time in times)
    hz = rate_of(seconds, len(parts))
    recording = Recording({}, b"")
    pieces, tracks, robots, marks, healths = list[bytes](), list[Any](), list[Any](), list[Any](), list[Any]()
    offset = 0
    for index, (part, time) in enumerate(zip(parts, times, strict=True)):
        progress(READING + (1.0 - READING) * index / len(parts), f"sampling {part.robot.name}")
        history = history_of(part.robot, time, part.diagnostics)
        track = _track(part, time, history, hz)
        pieces.append(np.ascontiguousarray(track.values, dtype="<f4").tobytes())
        count = len(track.values)
        tracks.append({"index": index, "offset": offset, "count": count, "fields": list(track.fields)})
        offset += count * len(track.fields)
        robots.append(_record(index, part.robot))
        marks += [
            {"t_s": t_s, "index": index, "robot": part.robot.name, "kind": kind, "words": words}
            for t_s, kind, words in history.marks
        ]
        healths.append({"index": index, "changes": _rounded(history), "targets": history.targets})
        recording.cameras[index] = cameras_of(part.robot.bag, time)
    recording.columns = b"".join(pieces)
    recording.document = {
        "name": name, "robots": robots, "seconds": round(seconds, 3), "hz": hz, "tracks": tracks,
        "marks": sorted(marks, key=lambda mark: mark["t_s"]), "health": healths, "notes": notes,
        "images": [
            {"index": index, "kind": camera.kind, "t_s": [round(float(t), 3) for t in camera.t_s]}
            for index, cameras in recording.cameras.items()
            for camera in cameras
        ],
    }  # fmt: skip
    return recording


def as_json(document: dict[str, Any]) -> bytes:
    """The text of a document."""
    return json.dumps(document, allow_nan=False, separators=(",", ":")).encode()


def _parts(paths: Sequence[Path], progress: Progress) -> tuple[list[_Part], list[str]]:
    """The robots of all bags, and what could not be read; those of one name go on in the next bag under another."""
    parts: list[_Part] = []
    notes: list[str] = []
    for number, path in enumerate(paths):

        def read(share: float, number: int = number, path: Path = path) -> None:
            progress(READING * (number + share) / len(paths), f"reading {path.name}")

        try:
            bag = open_shown(path, read)
            robots = robots_of(bag)
        except BagError as error:
            if len(paths) == 1:
                raise
            notes.append(str(error))
            continue
        notes += [f"{path.name}: {warning}" for warning in bag.warnings]
        diagnostics = diagnostics_of(bag)
        for robot in robots:
            seen = _odometry_of(robot, notes)
            if len(seen):
                parts.append(_Part(robot, seen, diagnostics))
    if not parts:
        raise BagError(notes[0] if notes else f"{paths[0]}: holds no robot.")
    return parts, notes


def _odometry_of(robot: RecordedRobot, notes: list[str]) -> Odometries:
    """What was measured of a robot, in `map`, without poses that are none."""
    reader = robot.reader
    try:
        topic = robot.bag.odometry()
    except BagError as error:
        notes.append(str(error))
        return odometries(Topic("", ODOMETRY.type))
    seen = reader.with_times(odometries(topic))
    seen = replace(seen, pose=moved_all((robot.info or {}).get("origin") or AT_ORIGIN, seen.pose))
    finite = np.isfinite(seen.pose).all(axis=1)
    if finite.all():
        return seen
    notes.append(f"{robot.name}: {int((~finite).sum())} poses are not finite: they are left out.")
    rows = np.flatnonzero(finite)
    frame, child = (tuple(texts[row] for row in rows) for texts in (seen.frame, seen.child_frame))
    return Odometries(
        seen.stamp_ns[rows], seen.log_ns[rows], seen.publish_ns[rows], frame, child, seen.pose[rows],
        seen.twist[rows], seen.left_out + int((~finite).sum()),
    )  # fmt: skip


def _begins(parts: Sequence[_Part]) -> list[float]:
    """When each robot begins on the time line, by when it was recorded; together, where one runs in lock step.

    Simulated time in lock step has no pace of its own, so that the wall clock says nothing about two of them.
    """
    first = [int(part.odometry.log_ns[0]) for part in parts]
    alike = len({part.robot.name for part in parts}) == len(parts)
    if alike and any(part.lockstep for part in parts):
        return [0.0] * len(parts)
    begins, after = list[float](), dict[str, float]()
    for part, log_ns in sorted(zip(parts, first, strict=True), key=lambda each: each[1]):
        rate = part.robot.bag.number("rate", 1.0)
        begin = (log_ns - min(first)) / NS * rate
        span = float(part.odometry.stamp_ns[-1] - part.odometry.stamp_ns[0]) / NS
        begins.append(max(begin, after.get(part.robot.name, 0.0)))
        after[part.robot.name] = begins[-1] + span
    order = sorted(range(len(parts)), key=lambda number: first[number])
    return [begins[order.index(number)] for number in range(len(parts))]


def _record(index: int, robot: RecordedRobot) -> dict[str, Any]:
    form = str(((robot.info or {}).get("goal") or {}).get("form", "pose"))
    return {
        "index": index, "name": robot.name, "color": color_of(index), "info": robot.info,
        "error": error_label(form), "controller": str((robot.bag.info or {}).get("controller") or ""),
    }  # fmt: skip


def _track(part: _Part, time: RobotTime, history: History, hz: float) -> Track:
    """All columns of one robot."""
    times = even_times(time, hz)
    info = part.robot.info or {}
    actuators = info.get("actuators") or ()
    reader = part.robot.reader
    pose, age = poses_at(times, time.t_s, part.odometry.pose)
    newest = np.clip(np.searchsorted(time.t_s, times, side="right") - 1, 0, None)
    goal = info.get("goal") or {}
    error = goal_errors(
        times, pose, part.odometry.twist[newest], history.goals,
        form=str(goal.get("form", "pose")), moves=bool(goal.get("moves")),
    )  # fmt: skip
    applied = reader.vectors(ACTUATORS_STATE)
    commands = Vectors(*NOTHING) if len(applied) else _commands(part)
    latency = (
        latencies_at(times, part.odometry, commands, time)
        if len(commands)
        else held_at(times, history.latencies)
    )
    poses = {name: reader.received(thing_wire(name), thing_of) for name in info.get("things") or ()}
    things = things_at(times, poses, time)
    columns = {
        "t": times, **dict(zip(POSE, pose.T, strict=True)), "age": age, "error": error,
        "latency": latency, "level": levels_at(times, history.levels),
    }  # fmt: skip
    shares = shares_at(times, applied if len(applied) else commands, time, actuators)
    fields = (*columns, *(f"share:{each['name']}" for each in actuators), *things.fields)
    table = np.column_stack((*columns.values(), shares, things.values))
    return Track(fields, table)


def _commands(part: _Part) -> Vectors:
    reader = part.robot.reader
    wire = VELOCITY_COMMAND if len(reader.bag.of(VELOCITY_COMMAND)) else COMMAND
    return reader.vectors(wire)


def _rounded(history: History) -> list[list[Any]]:
    return [[round(t_s, 3), health] for t_s, health in history.health]
