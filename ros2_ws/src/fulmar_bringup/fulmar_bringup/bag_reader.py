"""Reads a recorded run without ROS, as much of it as can be read."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from mcap.records import Channel, Message, Metadata, Schema

from fulmar_bringup.run_record import Actuation, Goal, HealthSample, Motion, RunRecord
from fulmar_core.errors import BagError
from fulmar_core.rotation import from_yaw, rotate
from fulmar_core.state import Pose
from fulmar_core.topics import (
    ACTUATORS_STATE,
    COMMAND,
    DIAGNOSTICS,
    GOAL_POINT,
    GOAL_POSE,
    METADATA,
    ODOMETRY,
    STATUS,
    TRUTH,
    Wire,
)
from fulmar_ros.bag_metadata import METADATA_FILE
from fulmar_ros.bag_records import bag_file, read_records
from fulmar_ros.bag_types import type_store
from fulmar_ros.bag_writer import RUN_KEY, RUN_RECORD

READ = (TRUTH, ODOMETRY, ACTUATORS_STATE, COMMAND, GOAL_POSE, GOAL_POINT, METADATA, STATUS, DIAGNOSTICS)
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
    file = bag_file(path)
    warnings: list[str] = []
    channels: dict[int, tuple[str, str]] = {}  # topic and type
    schemas: dict[int, str] = {}
    messages: list[Message] = []
    info: dict[str, Any] | None = None
    for record in read_records(file, warnings):
        if isinstance(record, Message):
            messages.append(record)
        elif isinstance(record, Schema):
            schemas[record.id] = record.name
        elif isinstance(record, Channel):
            channels[record.id] = (record.topic, schemas.get(record.schema_id, ""))
        elif isinstance(record, Metadata) and record.name == RUN_RECORD:
            info = _json_object(record.metadata.get(RUN_KEY, ""))
    info = info or _info_beside(file)
    if info is None:
        found = ", ".join(sorted(topic for topic, _ in channels.values())[:3]) or "none"
        raise BagError(
            f"{file}: no recording of Fulmar: lacks '{RUN_RECORD}', topics: {found}. Give a bag of a run."
        )
    decoded = _decode(str(info.get("robot", "")), channels, messages, warnings)
    if not messages:
        warnings.append(f"{file.name}: holds no message.")
    return _record(path, info, decoded, warnings)


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
    robot: str, channels: dict[int, tuple[str, str]], messages: Sequence[Message], warnings: list[str]
) -> dict[Wire, Decoded]:
    wires = {wire.name if wire.name.startswith("/") else f"/{robot}/{wire.name}": wire for wire in READ}
    decoded: dict[Wire, Decoded] = {wire: [] for wire in READ}
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
    return decoded


def _record(path: Path, info: dict[str, Any], decoded: dict[Wire, Decoded], warnings: list[str]) -> RunRecord:
    texts = [_json_object(message.data) for _, message in decoded[METADATA]]
    goals = [_goal(log_s, m.header, m.pose.position, m.pose.orientation) for log_s, m in decoded[GOAL_POSE]]
    goals += [_goal(log_s, m.header, m.point, None) for log_s, m in decoded[GOAL_POINT]]
    return RunRecord(
        path=path,
        info=info,
        truth=_motion(decoded[TRUTH]),
        odom=_motion(decoded[ODOMETRY]),
        applied=_actuation(decoded[ACTUATORS_STATE], ACTUATORS_STATE, warnings),
        commanded=_actuation(decoded[COMMAND], COMMAND, warnings),
        goals=tuple(sorted(goals, key=lambda goal: goal.log_s)),
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


def _goal(log_s: float, header: Any, position: Any, orientation: Any) -> Goal:
    quat = from_yaw(np.asarray(0.0))
    if orientation is not None:
        quat = np.array([orientation.x, orientation.y, orientation.z, orientation.w])
    return Goal(_stamp_s(header), log_s, Pose(np.array([position.x, position.y, position.z]), quat))


def _health(messages: Decoded) -> tuple[HealthSample, ...]:
    samples = [
        HealthSample(log_s, s.name, int(s.level), s.message, {pair.key: pair.value for pair in s.values})
        for log_s, message in messages
        for s in message.status
    ]
    return tuple(sorted(samples, key=lambda sample: sample.log_s))
