"""What the stack knows of a kind of sensor: one row of `robots.sensors.table.SENSORS`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from fulmar_core.config.plausible_ranges import Plausible
from fulmar_core.states.state import RigidBodyState
from fulmar_core.wires.reading import Reading
from fulmar_core.wires.wire import Wire


@dataclass(frozen=True, slots=True)
class Truth:
    """What is true of a simulated robot at one instant."""

    state: RigidBodyState  # without a batch axis
    specific_force: np.ndarray | None = (
        None  # (3,) acceleration minus gravity, in the body; None: not computed [m/s²]
    )
    # What else sensors of some robots measure: by the name of the sensor, a value of its own type.
    more: Mapping[str, Any] = field(default_factory=dict)


class SimulatedSensor(Protocol):
    """The sensor of one simulated robot, in one episode after another. Its attributes are its whole state."""

    def reset(self, seed: int, number: int) -> None:
        """Begin episode `number` of a seed; random numbers come from `sampling.sensor_rng` and nowhere else."""
        ...

    def measure(self, truth: Truth, time_s: float) -> Reading | None:
        """What the sensor reports.

        Args:
            truth: True motion now.
            time_s: Time in the episode, never less than before [s].

        Returns:
            A reading; None as long as there is nothing new.
        """
        ...


@dataclass(frozen=True)
class MessageFields:
    """How a reading becomes the fields of a ROS message, and a message becomes a reading; no stamp, no frame."""

    paths: tuple[str, ...]  # such as `quaternion.x`; each a number, a text or a list
    write: Callable[[Reading, Any], Sequence[Any]]  # a reading and the robot's spec to a value for each path
    read: Callable[[Sequence[Any]], Reading]  # values of the paths, to a reading without a stamp


@dataclass(frozen=True)
class SensorKind:
    """A kind of sensor."""

    spec: type[Any]  # frozen dataclass: the sensor's part of a robot's YAML
    wire: Wire  # where its readings are published
    frame: str  # `frame_id` of its messages, without a robot's prefix
    message: MessageFields | None  # None: `fulmar_ros.sensor_wires` has a writer of its own for it
    # A spec, and whether there are errors of measurement, to a sensor; None: the simulated world itself measures it.
    simulate: Callable[[Any, bool], SimulatedSensor] | None
    # Why a reading cannot come from the device of a robot (`fulmar_core.robots.robot.Robot`); empty if it can.
    problem: Callable[[Reading, Any], str] = lambda _reading, _robot: ""
    plausible: tuple[Plausible, ...] = ()  # ranges of the spec's numbers; keys relative to the spec
    # A reading of a robot to the numbers that a controller gets, shape (k,).
    numbers: Callable[[Reading, Any], np.ndarray] = lambda reading, _robot: np.asarray(
        reading.value, dtype=float
    )
