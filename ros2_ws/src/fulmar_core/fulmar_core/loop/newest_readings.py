"""What a controller receives beside the state: the newest reading of each name that it takes."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

import numpy as np

from fulmar_core.estimators.readings import ReadingKind, reading_problem, readings_of
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.image_gate import ImageWatch
from fulmar_core.wires.reading import Reading

REMEMBERED = 8  # readings of a name: more than come within a step, late ones included


class NewestReadings:
    """The newest readings of one robot, each as long as it lasts.

    Attributes:
        kinds: Rows of the readings that are taken, by name.
        refused: How many readings were refused.
        refusal: Why the newest of them was; empty if the newest reading was not.
    """

    def __init__(self, robot: Robot, names: Iterable[str], *, in_step: bool) -> None:
        """Begin without any.

        Args:
            robot: The robot.
            names: What is taken, see `Controller.readings`; sensors that the robot lacks are never there.
            in_step: Whether time stands still while a step is computed, as in lock step and evaluations. What other
                nodes say counts from the step after its own then, so that nothing depends on which of them is faster.

        Raises:
            ConfigError: A sensor of the user's own cannot be loaded.
        """
        known = readings_of(robot)
        self._robot = robot
        self.kinds: dict[str, ReadingKind] = {
            name: known[name]
            for name in dict.fromkeys(names)
            if known[name].sensor is None or name in robot.sensors.specs
        }
        self._each_step = {name for name, kind in self.kinds.items() if _comes_each_step(robot, name, kind)}
        self._in_step = in_step
        self.refused, self.refusal = 0, ""
        self._newest: dict[str, deque[tuple[int, np.ndarray]]] = {
            name: deque(maxlen=REMEMBERED) for name in self.kinds
        }
        self._images = {name: ImageWatch(name) for name, kind in self.kinds.items() if kind.image}

    def take(self, name: str, reading: Reading, stamp_ns: int) -> bool:
        """Take a reading in, measured at a time [ns]; whether it is believed, else it counts as not measured."""
        self.refusal = reading_problem(name, reading, self._robot)
        if self.refusal:
            self.refuse(name, self.refusal)
            return False
        kind = self.kinds[name]
        if kind.image and not self._images[name].came(stamp_ns):
            return False  # sent again
        numbers = kind.numbers(reading, self._robot)
        self._newest[name].append((stamp_ns, numbers[None] if kind.per_robot else numbers))
        return True

    def refuse(self, name: str, why: str) -> None:
        """Count a reading that is none."""
        self.refused, self.refusal = self.refused + 1, why
        if name in self._images:
            self._images[name].refused(why)

    def image_problem(self, names: Iterable[str], time_ns: int) -> str:
        """Why a controller that takes these readings cannot act on a state of a time; empty if it can [ns]."""
        watches = (self._images[name] for name in names if name in self._images)
        return next(filter(None, (watch.problem(time_ns) for watch in watches)), "")

    def at(self, time_ns: int) -> dict[str, np.ndarray]:
        """What is young enough at a time [ns], see `Inputs.readings`."""
        found = {}
        for name, newest in self._newest.items():
            latest_ns = time_ns if self.kinds[name].comes_with_its_step else time_ns - 1
            lasts_ns = round(1e9 * self.kinds[name].lasts_s)
            for stamp_ns, value in reversed(newest):
                if not self._in_step or stamp_ns <= latest_ns:
                    if time_ns - stamp_ns <= lasts_ns:
                        found[name] = value
                    break
        return found

    @property
    def silent(self) -> tuple[str, ...]:
        """Sensors and cameras that have said nothing yet."""
        return tuple(
            name for name, kind in self.kinds.items() if kind.comes_with_its_step and not self._newest[name]
        )

    def lacks_something_of(self, time_ns: int) -> bool:
        """Whether the reading of a time [ns] is still to come from a sensor that measures at each step."""
        return any(not self._newest[name] or self._newest[name][-1][0] < time_ns for name in self._each_step)


def _comes_each_step(robot: Robot, name: str, kind: ReadingKind) -> bool:
    if kind.image:
        return True  # the camera of a policy is as fast as its commands
    if kind.sensor is None or name in robot.sensors.own:
        return False
    spec = robot.sensors.specs[name]
    return not (getattr(spec, "rate_hz", 0.0) or getattr(spec, "delay_s", 0.0))
