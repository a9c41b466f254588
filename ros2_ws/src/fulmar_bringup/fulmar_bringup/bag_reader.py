"""Reads a recorded run without ROS, as much of it as can be read."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from mcap.records import Channel, Message, Metadata, Schema

from fulmar_bringup.run_record import Actuation, GivenGoal, HealthSample, Motion, Places, RunRecord
from fulmar_core.errors import BagError
from fulmar_core.rotation import rotate, yaw_of
from fulmar_core.topics import (
    ACTUATORS_STATE,
    BLOCK,
    COMMAND,
    DIAGNOSTICS,
    GOAL_WIRES,
    METADATA,
    OBSTACLES,
    ODOMETRY,
    STATUS,
    TRUTH,
    VELOCITY_COMMAND,
    Wire,
)
from fulmar_ros.bag_metadata import METADATA_FILE
from fulmar_ros.bag_records import bag_files, read_records
from fulmar_ros.bag_types import type_store
from fulmar_ros.bag_writer import RUN_KEY, RUN_RECORD

READ = (
    TRUTH,
    ODOMETRY,
    ACTUATORS_STATE,
    COMMAND,
    VELOCITY_COMMAND,
    *GOAL_WIRES.values(),
    OBSTACLES,
    BLOCK,
    METADATA,
    STATUS,
    DIAGNOSTICS,
)
ADD = 0  # action of a marker that is there
Decoded = list[tuple[float, Any]]  # when it was recorded [s], and the message


def read_run(path: Path) -> RunRecord:
    """Read one run.

    Args:
        path: Bag folder, or the MCAP file in it.

    Returns:
        The run. What is damaged or missing is left out and named in `warnings`.

    Raises:
        BagError: There is no bag, it is empty, or Fulmar did not record it.
    """
    path = Path(path)
    files = bag_files(path)
    warnings: list[str] = []
    decoded: dict[Wire, Decoded] = {wire: [] for wire in READ}
    topics: set[str] = set()
    info: dict[str, Any] | None = None
    count = 0
    for file in files:
        content = _content(file, warnings, alone=len(files) == 1)
        info = info or content.info or _info_beside(file)
        topics |= {topic for topic, _ in content.channels.values()}
        count += len(content.messages)
        robot = str((info or {}).get("robot", ""))
        _decode(robot, content.channels, content.messages, warnings, decoded)
    if info is None:
        found = ", ".join(sorted(topics)[:3]) or "none"
        raise BagError(
            f"{files[0]}: no recording of Fulmar: lacks '{RUN_RECORD}', topics: {found}. Give a bag of a run."
        )
    if not count:
        warnings.append(f"{files[0].name}: holds no message.")
    return _record(path, info, decoded, warnings)


@dataclass
class _Content:
    """One file, not decoded."""

    channels: dict[int, tuple[str, str]] = field(default_factory=dict)  # topic and type
    messages: list[Message] = field(default_factory=list)
    info: dict[str, Any] | None = None


def _content(file: Path, warnings: list[str], *, alone: bool) -> _Content:
    content, schemas = _Content(), dict[int, str]()
    try:
        for record in read_records(file, warnings):
            if isinstance(record, Message):
                content.messages.append(record)
            elif isinstance(record, Schema):
                schemas[record.id] = record.name
            elif isinstance(record, Channel):
                content.channels[record.id] = (record.topic, schemas.get(record.schema_id, ""))
            elif isinstance(record, Metadata) and record.name == RUN_RECORD:
                content.info = _json_object(record.metadata.get(RUN_KEY, ""))
    except BagError as error:  # of several files the others tell their part
        if alone:
            raise
        warnings.append(str(error))
    return content


def _info_beside(file: Path) -> dict[str, Any] | None:
    """Run information of the `metadata.yaml` next to a damaged file."""
    try:
        document = yaml.safe_load((file.parent / METADATA_FILE).read_text())
        return _json_object(document["rosbag2_bagfile_information"]["custom_data"][RUN_RECORD])
    except (OSError, yaml.YAMLError, KeyError, TypeError, ValueError):
        return None


def _json_object(text: str) -> dict[str, Any] | None:
    try:
        value = json.loads(text)
    except ValueError:
        return None
    return value if isinstance(value, dict) else None


def _decode(
    robot: str,
    channels: dict[int, tuple[str, str]],
    messages: Sequence[Message],
    warnings: list[str],
    decoded: dict[Wire, Decoded],
) -> None:
    """Add what one file holds to what is `decoded` already."""
    wires = {wire.name if wire.name.startswith("/") else f"/{robot}/{wire.name}": wire for wire in READ}
    bad: Counter[str] = Counter()
    for message in messages:
        topic, kind = channels.get(message.channel_id, ("", ""))
        wire = wires.get(topic)
        if wire is None:
            bad["a damaged part of the file"] += not topic
            continue
        try:
            if kind != wire.type:
                raise ValueError(kind)
            decoded[wire].append((message.log_time / 1e9, type_store().deserialize_cdr(message.data, kind)))
        except Exception:  # noqa: BLE001 - foreign bytes raise whatever they please; they are counted
            bad[topic] += 1
    warnings += [f"{count} messages of {topic} cannot be read." for topic, count in bad.items() if count]


def _record(path: Path, info: dict[str, Any], decoded: dict[Wire, Decoded], warnings: list[str]) -> RunRecord:
    texts = [_json_object(message.data) for _, message in decoded[METADATA]]
    goals = [
        GivenGoal(_stamp_s(message.header), log_s, _targets(message, name))
        for name, wire in GOAL_WIRES.items()
        for log_s, message in decoded[wire]
    ]
    return RunRecord(
        path=path,
        info=info,
        truth=_motion(decoded[TRUTH]),
        odom=_motion(decoded[ODOMETRY]),
        applied=_actuation(decoded[ACTUATORS_STATE], ACTUATORS_STATE, warnings),
        commanded=_velocity_commands(decoded[VELOCITY_COMMAND])
        if decoded[VELOCITY_COMMAND]
        else _actuation(decoded[COMMAND], COMMAND, warnings),
        goals=tuple(sorted(goals, key=lambda goal: goal.log_s)),
        obstacles=_discs(decoded[OBSTACLES]),
        block=_places(decoded[BLOCK]),
        controller=next((text for text in reversed(texts) if text), {}),
        health=_health(decoded[STATUS] + decoded[DIAGNOSTICS]),
        warnings=tuple(warnings),
    )


def _stamp_s(header: Any) -> float:
    return float(header.stamp.sec + header.stamp.nanosec / 1e9)


def _motion(messages: Decoded) -> Motion:
    def column(read: Callable[[Any], list[float]], width: int) -> np.ndarray:
        return np.array([read(message) for _, message in messages], dtype=float).reshape(-1, width)

    def vector(v: Any) -> list[float]:
        return [v.x, v.y, v.z]

    quat = column(lambda m: [*vector(m.pose.pose.orientation), m.pose.pose.orientation.w], 4)
    return Motion(
        stamp_s=np.array([_stamp_s(message.header) for _, message in messages]),
        log_s=np.array([log_s for log_s, _ in messages]),
        position=column(lambda m: vector(m.pose.pose.position), 3),
        quat_xyzw=quat,
        velocity_in_world=rotate(quat, column(lambda m: vector(m.twist.twist.linear), 3)),
        yaw_rate=column(lambda m: [m.twist.twist.angular.z], 1)[:, 0],
    )


def _actuation(messages: Decoded, wire: Wire, warnings: list[str]) -> Actuation:
    names = tuple(messages[0][1].name) if messages else ()
    alike = [(t, m) for t, m in messages if tuple(m.name) == names and len(m.effort) == len(names)]
    if len(alike) < len(messages):
        warnings.append(f"{len(messages) - len(alike)} messages of {wire.name} have other names or lengths.")
    effort = [message.effort for _, message in alike]
    return Actuation(
        stamp_s=np.array([_stamp_s(message.header) for _, message in alike]),
        log_s=np.array([log_s for log_s, _ in alike]),
        names=names,
        effort=np.array(effort, dtype=float).reshape(len(alike), len(names)),
    )


def _velocity_commands(messages: Decoded) -> Actuation:
    effort = [(message.twist.linear.x, message.twist.angular.z) for _, message in messages]
    return Actuation(
        stamp_s=np.array([_stamp_s(message.header) for _, message in messages]),
        log_s=np.array([log_s for log_s, _ in messages]),
        names=("speed", "yaw_rate"),
        effort=np.array(effort, dtype=float).reshape(-1, 2),
    )


def _targets(message: Any, topic: str) -> np.ndarray:
    """Targets of a goal message, shape (k, 3)."""
    if topic == "goal_velocity":
        twist = message.twist
        targets = [(twist.linear.x, twist.linear.y, twist.angular.z)]
    elif topic == "goal_point":
        targets = [(message.point.x, message.point.y, 0.0)]
    else:
        poses = message.poses if topic == "goal_path" else [message]
        targets = [(*_xy(each.pose), _yaw(each.pose.orientation)) for each in poses]
    return np.array(targets, dtype=float).reshape(-1, 3)


def _xy(pose: Any) -> tuple[float, float]:
    return pose.position.x, pose.position.y


def _yaw(q: Any) -> float:
    return float(yaw_of(np.array([q.x, q.y, q.z, q.w])))


def _discs(messages: Decoded) -> np.ndarray:
    """Obstacles of the last message, shape (m, 3)."""
    markers = messages[-1][1].markers if messages else []
    discs = [(*_xy(marker.pose), 0.5 * marker.scale.x) for marker in markers if marker.action == ADD]
    return np.array(discs, dtype=float).reshape(-1, 3)


def _places(messages: Decoded) -> Places:
    return Places(
        stamp_s=np.array([_stamp_s(message.header) for _, message in messages]),
        xy=np.array([_xy(message.pose) for _, message in messages], dtype=float).reshape(-1, 2),
    )


def _health(messages: Decoded) -> tuple[HealthSample, ...]:
    samples = [
        HealthSample(log_s, s.name, int(s.level), s.message, {pair.key: pair.value for pair in s.values})
        for log_s, message in messages
        for s in message.status
    ]
    return tuple(sorted(samples, key=lambda sample: sample.log_s))
