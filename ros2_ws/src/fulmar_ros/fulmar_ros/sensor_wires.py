"""Publishers of a robot's sensors, by the table of sensors."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile

from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.kind import SensorKind
from fulmar_core.wires.reading import BACK_NS, Reading
from fulmar_core.wires.robot_name import PLAIN, Frames
from fulmar_core.wires.wire import Wire
from fulmar_ros.convert import OdometryWriter, stamp_of
from fulmar_ros.frame_wires import OdometryTransform
from fulmar_ros.message_class import needed_class
from fulmar_ros.wire_image import layout_of, numbers_in

Encode = Callable[[Reading, int], Any]  # a reading and its stamp [ns] to a message, or to its bytes
ODOMETRY = "odometry"


class ReadingWriter:
    """Readings of one sensor as messages, by the fields that its row of the table names.

    Most messages are a header, texts and doubles: they are written as bytes, see `wire_image`.
    """

    def __init__(self, kind: SensorKind, spec: Any, frames: Frames = PLAIN) -> None:
        """Prepare the message.

        Args:
            kind: Row of the sensor; it names fields.
            spec: What the robot's file says of the sensor.
            frames: Of the robot.
        """
        assert kind.message is not None
        self._message = needed_class(kind.wire)()
        self._spec, self._values = spec, kind.message.write
        self._message.header.frame_id = frames.named(kind.frame)
        self._fields: list[tuple[Any, str]] = []
        for path in kind.message.paths:
            *outer, last = path.split(".")
            part = self._message
            for name in outer:
                part = getattr(part, name)
            self._fields.append((part, last))
        self._paths = kind.message.paths
        self._layout: ReadingLayout | None = None
        self._has_layout = True  # as long as no reading has shown the contrary

    def write(self, reading: Reading, time_ns: int) -> Any:
        """The message as bytes; or the message itself, which is overwritten by the next call."""
        values = self._values(reading, self._spec)
        data = self._layout.write(values, time_ns) if self._layout is not None else None
        return self._first(values, time_ns) if data is None else data

    def _first(self, values: Sequence[Any], time_ns: int) -> Any:
        """The message of a reading with other texts or more numbers than those before."""
        self._message.header.stamp = stamp_of(time_ns)
        for (part, name), value in zip(self._fields, values, strict=True):
            setattr(part, name, value)
        if not self._has_layout:
            return self._message
        try:
            self._layout = ReadingLayout(self._message, self._paths, values)
        except ValueError:
            self._layout, self._has_layout = None, False
            return self._message
        return self._layout.write(values, time_ns)


class ReadingLayout:
    """Where the values of a sensor's fields lie in the bytes of its messages."""

    def __init__(self, message: Any, paths: Sequence[str], values: Sequence[Any]) -> None:
        """Learn it from a message.

        Args:
            message: Filled with the values.
            paths: Of its fields.
            values: A number, a list of numbers or a list of texts for each path.

        Raises:
            ValueError: The message is more than texts, then numbers.
        """
        self._texts = [value if _is_text(value) else None for value in values]
        self._numbers: list[float] = []
        places: dict[str, int | slice] = {}
        for path, part, name, count in numbers_in(message):
            at, value = len(self._numbers), getattr(part, name)
            places[path] = at if count is None else slice(at, at + count)
            self._numbers.extend((value,) if count is None else value)
        self._places = [
            None if _is_text(value) else places.get(path) for path, value in zip(paths, values, strict=True)
        ]
        if any(place is None and text is None for place, text in zip(self._places, self._texts, strict=True)):
            raise ValueError(f"{type(message).__name__} has fields that are neither doubles nor texts.")
        texts = (
            message.header.frame_id,
            *(text for each in self._texts if each is not None for text in each),
        )
        self._written = list(values)
        self._image = layout_of(copy.deepcopy(message), *texts)

    def write(self, values: Sequence[Any], time_ns: int) -> bytes | None:
        """A message as bytes; None if it has other texts or another count of numbers."""
        numbers, written = self._numbers, self._written
        for at, (place, value) in enumerate(zip(self._places, values, strict=True)):
            if value is written[at] and isinstance(value, tuple):
                continue  # covariances, which stay as they are
            written[at] = value
            if place is None:
                if value != self._texts[at]:
                    return None
            elif isinstance(place, int):
                numbers[place] = value
            elif len(value) != place.stop - place.start:
                return None
            else:
                numbers[place] = value
        return self._image.write(time_ns, numbers)


def _is_text(value: Any) -> bool:
    """Whether a value is a list of texts."""
    return isinstance(value, list | tuple) and bool(value) and isinstance(value[0], str)


class SensorWires:
    """Publishers of the sensors that a robot's file names, in the order of the table."""

    def __init__(
        self,
        node: Node,
        robot: Robot,
        frames: Frames,
        qos: Callable[[Wire], QoSProfile],
        publish: Callable[[Publisher, Any], None],
        *,
        odometry: bool,
        lockstep: bool = False,
        transform: OdometryTransform | None = None,
    ) -> None:
        """Create the publishers.

        Args:
            node: Their owner.
            robot: The robot.
            frames: Of the robot.
            qos: Quality of service of a wire.
            publish: Publishes a message, or its bytes.
            odometry: Whether to publish the odometry; if not, another node does.
            lockstep: Whether the odometry goes last; else it goes first, since the controller waits for it.
            transform: Publishes each odometry as a transform, too.
        """
        self._transform, self._lockstep = transform, lockstep
        self._publish = publish
        self._made: dict[str, Publisher] = {}
        self._encode: dict[str, Encode] = {}
        self._newest_ns: dict[str, int] = {}  # newest stamp of a sensor that stamps its own readings
        specs = robot.sensors.specs
        for name, kind in robot.sensors.kinds.items():
            if name != ODOMETRY or odometry:
                wire = kind.wire
                self._made[name] = node.create_publisher(needed_class(wire), wire.name, qos(wire))
                self._encode[name] = _encoder(name, kind, specs[name], frames)

    @property
    def publishers(self) -> list[Publisher]:
        """All of them."""
        transform = [self._transform.publisher] if self._transform is not None else []
        return [*self._made.values(), *transform]

    @property
    def odometry(self) -> Publisher | None:
        """That of the odometry; None: another node publishes it."""
        return self._made.get(ODOMETRY)

    def publish(self, readings: Mapping[str, Reading], sample_ns: int) -> None:
        """Publish the readings of a sample.

        Args:
            readings: By the sensors' names.
            sample_ns: Time of the sample [ns].
        """
        # In lock step the odometry asks for an answer: what belongs to it is under way before it.
        if not self._lockstep:
            self.publish_odometry(readings, sample_ns)
        for name in self._made:
            if name in readings and name != ODOMETRY:
                self._publish_if_new(name, readings[name], sample_ns)
        if self._lockstep:
            self.publish_odometry(readings, sample_ns)
        if self._transform is not None and ODOMETRY in readings:
            self._transform.publish(readings[ODOMETRY].value, sample_ns)

    def publish_odometry(self, readings: Mapping[str, Reading], sample_ns: int) -> None:
        """Publish the odometry of a sample, subscribed or not; arguments as in `publish`."""
        if ODOMETRY in self._made and ODOMETRY in readings:
            self._publish(self._made[ODOMETRY], self._encode[ODOMETRY](readings[ODOMETRY], sample_ns))

    def publish_stamped(self, readings: Mapping[str, Reading], sample_ns: int) -> None:
        """Publish the readings that have a stamp of their own, of a sample that came before; as `publish`."""
        self.publish({name: each for name, each in readings.items() if each.stamp_ns is not None}, sample_ns)

    def _publish_if_new(self, name: str, reading: Reading, sample_ns: int) -> None:
        """Publish a reading that has subscribers and, if it is stamped, comes for the first time."""
        if not self._made[name].get_subscription_count():
            return
        if reading.stamp_ns is not None:
            newest_ns = self._newest_ns.get(name)
            if newest_ns is not None and 0 <= newest_ns - reading.stamp_ns <= BACK_NS:
                return  # further back, the clock was set
            self._newest_ns[name] = reading.stamp_ns
        self._publish(self._made[name], self._encode[name](reading, reading.stamp(sample_ns)))


def _encoder(name: str, kind: SensorKind, spec: Any, frames: Frames) -> Encode:
    if name == ODOMETRY:  # on the path of control, where a message costs more than its bytes
        writer = OdometryWriter(spec, frame=frames.odom, child_frame=frames.base)
        return lambda reading, time_ns: writer.raw(reading.value, time_ns)
    return ReadingWriter(kind, spec, frames).write
