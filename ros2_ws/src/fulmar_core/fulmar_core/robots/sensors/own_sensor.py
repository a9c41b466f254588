"""A user's own sensor, loaded by its dotted path: `mypackage.mymodule:MySensor`, see docs/own-sensor.md.

It is made as `MySensor(settings)`, and has `message` and `fields`, and for simulation `reset(rng)` and
`measure(truth, time_s)`. The class is loaded when it is used: a robot's file, also one in a bag, is read without it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fulmar_core.config.errors import ConfigError, DeviceError, FulmarError, shortened
from fulmar_core.config.own_class import (
    check_class_path,
    construct,
    load_class,
    one_line,
    settings_beside,
    source_of,
)
from fulmar_core.robots.sensors.kind import MessageFields, SensorKind, Truth
from fulmar_core.robots.sensors.sampling import sensor_rng
from fulmar_core.wires.reading import Reading
from fulmar_core.wires.wire import Wire

MEMBERS = ("message", "fields", "reset", "measure")
ROLE = "sensor"
CALL = "MySensor(settings)"
_TOPIC = re.compile(r"[a-z][a-z0-9_]*(/[a-z][a-z0-9_]*)*")
_MESSAGE = re.compile(r"[a-z][a-z0-9_]*/msg/[A-Z][A-Za-z0-9]*")


@dataclass(frozen=True)
class OwnSensorSpec:
    """An entry below `sensors: own:` of a robot's file."""

    sensor: str  # dotted path of the class
    # In the place of those in the file beside its module.
    settings: dict[str, Any] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        try:
            check_class_path(self.sensor)
        except ConfigError as error:
            raise ValueError(f"'sensor': {error}") from None

    def make(self) -> Any:
        """The user's object.

        Raises:
            ConfigError: The class cannot be loaded, lacks a member, or its constructor raises.
        """
        cls = load_class(self.sensor, members=MEMBERS, what=ROLE)
        return construct(cls, CALL, ROLE, {**settings_beside(cls), **self.settings})


def own_sensor_kind(name: str, spec: OwnSensorSpec) -> SensorKind:
    """The row of a user's own sensor.

    Args:
        name: In the robot's file, which is its topic, too, where the class names none.
        spec: What the file says of it.

    Raises:
        ConfigError: The class cannot be loaded, or its topic, message or fields are no names.
    """
    cls = load_class(spec.sensor, members=MEMBERS, what=ROLE)
    topic, message = str(getattr(cls, "topic", name)), str(cls.message)
    fields = (cls.fields,) if isinstance(cls.fields, str) else tuple(cls.fields)
    here = f"sensor '{spec.sensor}'"
    if not _TOPIC.fullmatch(topic):
        raise ConfigError(f"{here}: topic '{shortened(topic)}' is no name of a topic. Example: range/front")
    if not _MESSAGE.fullmatch(message):
        raise ConfigError(
            f"{here}: message '{shortened(message)}' names no type. Example: sensor_msgs/msg/Range"
        )
    if not fields or not all(isinstance(path, str) and path for path in fields):
        raise ConfigError(f"{here}: 'fields' must name fields of {message}, such as ('range',).")
    wire = Wire(
        topic, message, "plant", "stream", "whenever it measures", f"the sensor `{name}` of the user's own",
        unit=str(getattr(cls, "unit", "")), frame=f"`{getattr(cls, 'frame', 'base_link')}`",
    )  # fmt: skip

    def write(reading: Reading, _spec: Any) -> list[Any]:
        values = reading.value
        if len(values) != len(fields):
            raise ValueError(f"{len(values)} values for {len(fields)} fields: {', '.join(fields)}")
        return [_plain(value) for value in values]

    return SensorKind(
        spec=OwnSensorSpec,
        wire=wire,
        frame=str(getattr(cls, "frame", "base_link")),
        message=MessageFields(paths=fields, write=write, read=lambda values: Reading(tuple(values))),
        simulate=lambda own, noisy: OwnSensor(name, own, noisy=noisy),
        problem=lambda reading, _robot: _problem(name, reading),
        numbers=lambda reading, _robot: _numbers(reading.value),
    )


def own_sensor_source(spec: OwnSensorSpec) -> Any:
    """The file that the class is in."""
    return source_of(load_class(spec.sensor, members=MEMBERS, what=ROLE))


class OwnSensor:
    """A user's class behind the interface of simulated sensors."""

    def __init__(self, name: str, spec: OwnSensorSpec, *, noisy: bool) -> None:
        """Make one; without noise the class gets no random numbers.

        Raises:
            ConfigError: As `OwnSensorSpec.make`.
        """
        self._name, self._path, self._noisy = name, spec.sensor, noisy
        self._own = spec.make()

    def reset(self, seed: int, number: int) -> None:
        """Begin an episode; see `SimulatedSensor`."""
        self._call("reset", sensor_rng(seed, number, self._name) if self._noisy else None)

    def measure(self, truth: Truth, time_s: float) -> Reading | None:
        """A reading whose value has one entry for each field; None while there is nothing new.

        Raises:
            DeviceError: The class raised, or returned something else.
        """
        found = self._call("measure", truth, time_s)
        if found is None or isinstance(found, Reading):
            return found
        if np.isscalar(found):
            return Reading((found,))
        if not isinstance(found, Sequence | np.ndarray):
            raise DeviceError(
                f"{ROLE} '{self._path}': measure returned {type(found).__name__}, which must be a value for each "
                "field, or None."
            )
        return Reading(tuple(found))

    def _call(self, method: str, *given: Any) -> Any:
        try:
            return getattr(self._own, method)(*given)
        except FulmarError:
            raise
        except Exception as error:
            where = one_line(error, self._path.partition(":")[0])
            raise DeviceError(f"{ROLE} '{self._path}': {method} raised {where}.") from error


def _plain(value: Any) -> Any:
    """A value as messages take it."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    return value.item() if isinstance(value, np.generic) else value


def _numbers(values: Sequence[Any]) -> np.ndarray:
    """The numbers among the values of the fields, one after the other; texts are left out."""
    parts = [np.ravel(np.asarray(each, dtype=float)) for each in values if not isinstance(each, str)]
    return np.concatenate(parts) if parts else np.zeros(0)


def _problem(name: str, reading: Reading) -> str:
    try:
        finite = bool(np.isfinite(_numbers(reading.value)).all())
    except (TypeError, ValueError):
        return f"{name} reports something that is no number"
    return "" if finite else f"{name} reports a value that is not finite"
