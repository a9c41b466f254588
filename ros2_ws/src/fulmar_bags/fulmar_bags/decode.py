"""Messages of one topic as arrays.

Messages of one topic mostly have the same layout, byte for byte: names and frames repeat, only stamp and numbers
change. Such a topic is decoded at once; a topic whose layout changes goes through `rosbags`, message by message.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_bags.contents import Topic
from fulmar_bags.message_types import ENCAPSULATION, LITTLE_ENDIAN, Walk, type_store
from fulmar_core.robots.topics import TRANSFORMS

NS = 1_000_000_000
TWIST = "geometry_msgs/msg/Twist"
STAMP = slice(ENCAPSULATION, ENCAPSULATION + 8)  # of a message that begins with a header
FIRST_STAMP = slice(STAMP.start + 4, STAMP.stop + 4)  # of the first transform, behind their number


@dataclass(frozen=True)
class Vectors:
    """Named vectors over time."""

    names: tuple[str, ...]
    stamp_ns: np.ndarray  # (n,) int64
    log_ns: np.ndarray  # (n,) int64, when the recorder received each
    publish_ns: np.ndarray  # (n,) int64, when each was sent
    values: np.ndarray  # (n, m)
    left_out: int  # messages with other names or lengths, or that cannot be read

    def __len__(self) -> int:
        """Number of vectors."""
        return len(self.stamp_ns)


@dataclass(frozen=True)
class Odometries:
    """Odometry over time, as it was on the wire."""

    stamp_ns: np.ndarray  # (n,) int64
    log_ns: np.ndarray  # (n,) int64, when the recorder received each
    publish_ns: np.ndarray  # (n,) int64, when each was sent
    frame: tuple[str, ...]  # of the pose, by message
    child_frame: tuple[str, ...]  # of the twist, by message
    pose: np.ndarray  # (n, 7) x, y, z [m], quaternion xyzw
    twist: np.ndarray  # (n, 6) in the child frame [m/s, rad/s]
    left_out: int  # messages that cannot be read

    def __len__(self) -> int:
        """Number of messages."""
        return len(self.stamp_ns)


def messages(topic: Topic) -> list[tuple[int, Any]]:
    """Time of recording [ns] and message, of those that can be read."""
    return [(log_ns, message) for log_ns, _, message in _timed(topic)]


def _timed(topic: Topic) -> list[tuple[int, int, Any]]:
    """Times of receiving and of sending [ns] and message, of those that can be read."""
    store, found = type_store(), []
    for log_ns, publish_ns, data in zip(topic.log_ns, topic.publish_ns, topic.data, strict=True):
        try:
            found.append((log_ns, publish_ns, store.deserialize_cdr(data, topic.type)))
        except Exception:  # noqa: BLE001 - foreign bytes raise whatever they please; `open_bag` counts them
            continue
    return found


def has_header(kind: str) -> bool:
    """Whether messages of a type begin with a header."""
    fields = type_store().fielddefs.get(kind)
    return bool(fields and fields[1] and fields[1][0][1][1] == "std_msgs/msg/Header")


def stamps_ns(topic: Topic) -> np.ndarray | None:
    """Stamps of all messages, shape (n,) int64 [ns]; None where the type has none, or a message is too short.

    A list of transforms has the stamp of its first.
    """
    transforms = topic.type == TRANSFORMS.type
    place = FIRST_STAMP if transforms else STAMP
    if not (transforms or has_header(topic.type)) or any(len(data) < place.stop for data in topic.data):
        return None
    little = all(data[1] & LITTLE_ENDIAN for data in topic.data)
    raw = np.frombuffer(b"".join(data[place] for data in topic.data), dtype="<u4" if little else ">u4")
    pairs = raw.reshape(-1, 2).astype(np.int64)
    return pairs[:, 0] * NS + pairs[:, 1]


def stamp_of(message: Any) -> int:
    """Stamp of a message with a header [ns]."""
    return int(message.header.stamp.sec) * NS + int(message.header.stamp.nanosec)


def joint_vectors(topic: Topic, field: str) -> Vectors:
    """JointState messages as vectors.

    Args:
        topic: Of type JointState.
        field: `position` or `effort`.

    Returns:
        Those with the names of the first one.
    """
    fast = _alike(topic, lambda walk: walk.joint_state(field))
    if fast is not None:
        return Vectors(fast.texts, *_times(topic), fast.numbers, 0)
    found = _timed(topic)
    names = tuple(found[0][2].name) if found else ()
    alike = [
        each for each in found if tuple(each[2].name) == names and len(getattr(each[2], field)) == len(names)
    ]
    return Vectors(
        names,
        *_times_of(alike),
        np.array([getattr(m, field) for *_, m in alike], dtype=float).reshape(len(alike), len(names)),
        len(topic) - len(alike),
    )


def twist_vectors(topic: Topic) -> Vectors:
    """Twist or TwistStamped messages as (speed ahead [m/s], turn rate [rad/s]).

    Those without a stamp, as most drivers of others take them, count from when they were recorded.
    """
    found, plain = _timed(topic), topic.type == TWIST
    twists = [message if plain else message.twist for *_, message in found]
    logs, published = np.array([each[:2] for each in found], dtype=np.int64).reshape(-1, 2).T
    stamps = logs if plain else np.array([stamp_of(message) for *_, message in found], dtype=np.int64)
    return Vectors(
        ("speed", "yaw_rate"),
        stamps,
        logs,
        published,
        np.array([(twist.linear.x, twist.angular.z) for twist in twists], dtype=float).reshape(-1, 2),
        len(topic) - len(found),
    )


def odometries(topic: Topic) -> Odometries:
    """Odometry messages as arrays."""
    fast = _alike(topic, lambda walk: walk.odometry())
    if fast is not None:
        frame, child = fast.texts
        count = len(topic)
        return Odometries(
            *_times(topic),
            (frame,) * count,
            (child,) * count,
            fast.numbers[:, :7],
            fast.numbers[:, 7:],
            0,
        )
    found = _timed(topic)

    def column(read: Callable[[Any], Sequence[float]], width: int) -> np.ndarray:
        return np.array([read(m) for *_, m in found], dtype=float).reshape(-1, width)

    return Odometries(
        *_times_of(found),
        tuple(m.header.frame_id for *_, m in found),
        tuple(m.child_frame_id for *_, m in found),
        column(
            lambda m: [
                *_xyz(m.pose.pose.position),
                *_xyz(m.pose.pose.orientation),
                m.pose.pose.orientation.w,
            ],
            7,
        ),
        column(lambda m: [*_xyz(m.twist.twist.linear), *_xyz(m.twist.twist.angular)], 6),
        len(topic) - len(found),
    )


def _xyz(vector: Any) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z


def _times(topic: Topic) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stamps, times of receiving and of sending of a topic, each of shape (n,) int64 [ns]."""
    found = stamps_ns(topic)
    assert found is not None
    return found, np.array(topic.log_ns, dtype=np.int64), np.array(topic.publish_ns, dtype=np.int64)


def _times_of(found: list[tuple[int, int, Any]]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """As `_times`, of messages with a header."""
    table = [(stamp_of(message), log_ns, publish_ns) for log_ns, publish_ns, message in found]
    stamps, logs, published = np.array(table, dtype=np.int64).reshape(-1, 3).T
    return stamps, logs, published


@dataclass(frozen=True)
class _Decoded:
    texts: tuple[str, ...]
    numbers: np.ndarray  # (n, m)


def _alike(
    topic: Topic, walk_through: Callable[[_Walk], tuple[tuple[str, ...], list[int]]]
) -> _Decoded | None:
    """All messages at once, if only their stamps and the numbers that are asked for differ in layout.

    Returns:
        None where they have not all the layout of the first one.
    """
    if not topic.data:
        return None
    first = topic.data[0]
    try:
        walk = _Walk(first)
        texts, offsets = walk_through(walk)
    except (struct.error, UnicodeDecodeError):
        return None
    if any(len(data) != len(first) for data in topic.data) or (offsets and offsets[-1] + 8 > len(first)):
        return None
    table = np.frombuffer(b"".join(topic.data), dtype=np.uint8).reshape(len(topic), len(first))
    fixed = np.zeros(len(first), dtype=bool)
    fixed[:ENCAPSULATION] = True
    for begin, end in walk.fixed:
        fixed[begin:end] = True
    if not (table[:, fixed] == table[0, fixed]).all():
        return None
    columns = [table[:, offset : offset + 8].copy().view("<f8") for offset in offsets]
    numbers = np.concatenate(columns, axis=1) if columns else np.zeros((len(topic), 0))
    return _Decoded(texts, numbers)


class _Walk(Walk):
    """Goes through one message with a header and finds its numbers."""

    def __init__(self, data: bytes) -> None:
        super().__init__(data, STAMP.stop)

    def joint_state(self, field: str) -> tuple[tuple[str, ...], list[int]]:
        self.text()
        names = tuple(self.text() for _ in range(self.count()))
        arrays = {name: self.doubles() for name in ("position", "velocity", "effort")}
        if len(arrays[field]) != len(names):
            raise struct.error("another length")
        return names, arrays[field]

    def odometry(self) -> tuple[tuple[str, ...], list[int]]:
        frames = self.text(), self.text()
        begin = self.aligned(8)
        pose = [begin + 8 * i for i in range(7)]
        twist = [begin + 8 * (7 + 36 + i) for i in range(6)]
        return frames, pose + twist


def by_stamp(stamps_ns: Sequence[int] | np.ndarray) -> dict[int, list[int]]:
    """Indices of messages by their stamp, the first one last: `pop` takes messages of one stamp in their order."""
    found: dict[int, list[int]] = {}
    for index in range(len(stamps_ns) - 1, -1, -1):
        found.setdefault(int(stamps_ns[index]), []).append(index)
    return found
