"""Messages of one topic as arrays.

Messages of one topic mostly have the same layout, byte for byte: names and frames repeat, only stamp and numbers
change. Such a topic is decoded at once; a topic whose layout changes goes through `rosbags`, message by message.
"""

from __future__ import annotations

import struct
import sys
from array import array
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_bags.bag_reading import TWIST
from fulmar_bags.gathered import Topic
from fulmar_bags.message_types import ENCAPSULATION, LITTLE_ENDIAN, Walk, type_store
from fulmar_bags.stored_bytes import blocks, heads_of, lengths_of
from fulmar_core.robots.topics import TRANSFORMS

NS = 1_000_000_000
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
    return [(log_ns, message) for log_ns, _, message in timed_messages(topic)]


def timed_messages(topic: Topic) -> Iterator[tuple[int, int, Any]]:
    """Times of receiving and of sending [ns] and message, one after the other, of those that can be read."""
    store = type_store()
    for log_ns, publish_ns, data in zip(topic.log_ns, topic.publish_ns, topic.data, strict=True):
        try:
            message = store.deserialize_cdr(data, topic.type)
        except Exception:  # noqa: BLE001 - foreign bytes raise whatever they please; `open_bag` counts them
            continue
        yield log_ns, publish_ns, message


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
    if not (transforms or has_header(topic.type)) or (lengths_of(topic.data) < place.stop).any():
        return None
    heads = heads_of(topic.data)
    raw = heads[:, place].copy().view("<u4")
    big = heads[:, 1] & LITTLE_ENDIAN == 0
    raw[big] = raw[big].byteswap()
    pairs = raw.astype(np.int64)
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
    names: tuple[str, ...] | None = None
    times, values, count = array("q"), array("d"), 0
    for log_ns, publish_ns, message in timed_messages(topic):
        names = tuple(message.name) if names is None else names
        numbers = getattr(message, field)
        if tuple(message.name) == names and len(numbers) == len(names):
            times.extend((stamp_of(message), log_ns, publish_ns))
            values.extend(numbers)
            count += 1
    names = names or ()
    return Vectors(names, *_stamps(times), np.array(values).reshape(count, len(names)), len(topic) - count)


def twist_vectors(topic: Topic) -> Vectors:
    """Twist or TwistStamped messages as (speed ahead [m/s], turn rate [rad/s]).

    Those without a stamp, as most drivers of others take them, count from when they were recorded.
    """
    plain = topic.type == TWIST
    times, values = array("q"), array("d")
    for log_ns, publish_ns, message in timed_messages(topic):
        twist = message if plain else message.twist
        times.extend((log_ns if plain else stamp_of(message), log_ns, publish_ns))
        values.extend((twist.linear.x, twist.angular.z))
    found = np.array(values).reshape(-1, 2)
    return Vectors(("speed", "yaw_rate"), *_stamps(times), found, len(topic) - len(found))


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
    frames, times, numbers = list[tuple[str, str]](), array("q"), array("d")
    for log_ns, publish_ns, m in timed_messages(topic):
        frames.append((sys.intern(m.header.frame_id), sys.intern(m.child_frame_id)))
        times.extend((stamp_of(m), log_ns, publish_ns))
        numbers.extend(
            (*_xyz(m.pose.pose.position), *_xyz(m.pose.pose.orientation), m.pose.pose.orientation.w)
        )
        numbers.extend((*_xyz(m.twist.twist.linear), *_xyz(m.twist.twist.angular)))
    table = np.array(numbers).reshape(-1, 13)
    return Odometries(
        *_stamps(times),
        tuple(frame for frame, _ in frames),
        tuple(child for _, child in frames),
        table[:, :7],
        table[:, 7:],
        len(topic) - len(frames),
    )


def _xyz(vector: Any) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z


def _times(topic: Topic) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stamps, times of receiving and of sending of a topic, each of shape (n,) int64 [ns]."""
    found = stamps_ns(topic)
    assert found is not None
    return found, np.array(topic.log_ns, dtype=np.int64), np.array(topic.publish_ns, dtype=np.int64)


def _stamps(times: array[int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """When messages are stamped, logged and published, of triples in a row, shapes (n,) [ns]."""
    stamp, log, publish = np.array(times, dtype=np.int64).reshape(-1, 3).T
    return stamp, log, publish


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
    if (lengths_of(topic.data) != len(first)).any() or (offsets and offsets[-1] + 8 > len(first)):
        return None
    fixed = np.zeros(len(first), dtype=bool)
    fixed[:ENCAPSULATION] = True
    for begin, end in walk.fixed:
        fixed[begin:end] = True
    layout = np.frombuffer(first, dtype=np.uint8)[fixed]
    numbers = np.zeros((len(topic), len(offsets)))
    for begin, some in blocks(topic.data):
        table = np.frombuffer(b"".join(some), dtype=np.uint8).reshape(len(some), len(first))
        if not (table[:, fixed] == layout).all():
            return None
        for column, offset in enumerate(offsets):
            numbers[begin : begin + len(some), column] = (
                table[:, offset : offset + 8].copy().view("<f8")[:, 0]
            )
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
