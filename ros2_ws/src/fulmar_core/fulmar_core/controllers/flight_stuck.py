"""LQI of an aircraft with a surface that stands where it is: the others and the motors fly it.

The surface is a known constant input. What level flight takes beside it follows from the linear models: the change of
the other commands and of the attitude that leaves no acceleration. Gains are solved anew without the surface.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fulmar_core.controllers.flight_lqi import FlightLqi, FlightWeights
from fulmar_core.controllers.lqr import regulator
from fulmar_core.dynamics.flight_schedule import PLACE, SPEED, TURNED, FlightModel, Schedule
from fulmar_core.robots.actuators.control_surfaces import ControlSurfaces
from fulmar_core.robots.robot import Robot

REPLACED = "rudder"  # the surface that motors apart from each other can replace
# Of all level flights beside a surface the one is taken where this, the square of rotations, and the square of the
# changes of throttles add up to the least. Small sideslip takes thrust on one side alone, much leaves the angles in
# which the fin holds the craft. Per rad², ours.
ROTATED = 20.0


def can_replace(robot: Robot) -> bool:
    """Whether motors apart from each other turn an aircraft whose rudder does not."""
    craft = robot.actuated_by(ControlSurfaces)
    if REPLACED not in craft.names:
        return False
    aside = [motor.position[1] for motor in craft.motors]
    return min(aside, default=0.0) < 0.0 < max(aside, default=0.0)


class StuckLqi(FlightLqi):
    """LQI of an aircraft whose rudder stands.

    Attributes:
        value: Where it stands [rad].
    """

    title = "LQI of aircraft with a surface that stands"

    def __init__(self, robot: Robot, task: Any, gains: FlightWeights, usual: FlightLqi) -> None:
        """Solve for gains without the surface.

        Args:
            robot: One that `can_replace`.
            task: The task that is flown; see `FlightLqi`.
            gains: Weights.
            usual: The law of the sound craft, whose models these are.
        """
        self.number = robot.actuators.names.index(REPLACED)
        self.value = 0.0
        self._models = usual.schedule.models
        super().__init__(robot, task, gains, control_hz=usual.control_hz)

    def prepare(self) -> None:
        """See `FlightLqi.prepare`."""
        self._integrates = max(self.gains.height_integral, self.gains.side_integral) > 0.0
        self.schedule = Schedule(self.robot, self._speed, self._dt, self._gain, self._models)

    def _gain(self, model: FlightModel) -> np.ndarray:
        """Gains, and in a last column those of where the surface stands beyond its trim, shape (m, k + 1)."""
        a, b, q, r = self._problem(model)
        free = [i for i in range(b.shape[1]) if i != self.number]
        gain = np.zeros((b.shape[1], len(a)))
        gain[free] = regulator(a, b[:, free], q, r[np.ix_(free, free)]).gain
        states, commands = beside(model, self.number, self._craft.positions)
        constant = commands + gain[:, : len(states)] @ states
        return np.concatenate((gain, -constant[:, None]), axis=1)

    def _with_constants(self, x: np.ndarray) -> np.ndarray:
        return np.concatenate((x, np.full((len(x), 1), self.value)), axis=-1)


def beside(model: FlightModel, number: int, surfaces: int) -> tuple[np.ndarray, np.ndarray]:
    """Change of states (n,) and commands (m,) in level flight at the same speed for 1 rad of one surface.

    Args:
        model: About level flight.
        number: Of the surface.
        surfaces: How many there are; commands after them are throttles.
    """
    count, inputs = model.b.shape
    kept = [PLACE.start, PLACE.start + 1, SPEED.start]
    held = np.zeros((len(kept) + 1, count + inputs))
    held[np.arange(len(kept)), kept] = 1.0
    held[-1, count + number] = 1.0
    still = np.vstack((np.hstack((model.a - np.eye(count), model.b)), held))
    wanted = np.zeros(len(still))
    wanted[-1] = 1.0
    one = np.linalg.lstsq(still, wanted, rcond=1e-10)[0]
    _, sizes, rows = np.linalg.svd(still)
    ways = rows[int((sizes > 1e-10 * sizes[0]).sum()) :].T
    costs = np.zeros(count + inputs)
    costs[TURNED] = np.sqrt(ROTATED)
    costs[count + surfaces :] = 1.0
    found = one - ways @ np.linalg.lstsq(costs[:, None] * ways, costs * one, rcond=None)[0]
    return found[:count], found[count:]
