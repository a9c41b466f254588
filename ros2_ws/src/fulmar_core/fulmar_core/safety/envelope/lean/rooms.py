"""What rollouts leave of room: to sides and geofence in the plane, to the ground and to level flight for wings."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Protocol

import numpy as np

from fulmar_core.controllers.controller import Inputs
from fulmar_core.estimators.actuator_health.actuator_estimator import ActuatorEstimate
from fulmar_core.robots.actuators.families import row_of
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.envelope.lean.backup import TASKS as BACKUP_TASKS
from fulmar_core.safety.envelope.lean.backup import StopAndHold
from fulmar_core.safety.envelope.lean.circles import Circles
from fulmar_core.safety.envelope.lean.hull import HullRollout
from fulmar_core.safety.envelope.lean.samples import Samples
from fulmar_core.safety.envelope.lean.track import PlaneBounds
from fulmar_core.safety.envelope.lean.wheels import WheelRollout
from fulmar_core.safety.envelope.lean.wing import ATTACK_DEG, BANK_DEG, SLIP_DEG, SLOWER, WingRollout
from fulmar_core.safety.envelope.lean.wing_backup import LevelFlightBackup
from fulmar_core.safety.envelope.room import MARGIN_M, Room
from fulmar_core.states.spatial import SpatialState
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import Task
from fulmar_core.tasks.follow_reference import FollowReference

HOLDS_S = 5.0  # in which a law brings a boat about that is carried along after its stop [s]
WATER_M = 0.1  # kept between the ground or the water and the hull, beside what is rolled out [m]
GROUND, BANK, ATTACK, SLIP, AIRSPEED, CEILING = (
    "the water or the ground", "bank", "angle of attack", "sideslip", "airspeed", "z_max",
)  # fmt: skip
FIRST_SIDE = 6  # of the bounds of wings, from which on a turn helps
REACT_S = 0.1  # that a departure of the speed counts as, in metres [s]


class Backup(Protocol):
    """What acts in the place of a controller; see `StopAndHold`."""

    law: Any

    def reset(self) -> None:
        """Forget the past."""
        ...

    def stop(self, which: np.ndarray, now: RigidBodyState, stops_at: np.ndarray) -> None:
        """Begin with some robots."""
        ...

    def free(self, which: np.ndarray) -> None:
        """Leave some robots to their controllers."""
        ...

    def command(self, inputs: Inputs, estimate: ActuatorEstimate | None) -> np.ndarray:
        """Commands, before the actuators' limits, shape (n, m)."""
        ...


class Rooms(Protocol):
    """Room of n robots of one kind."""

    @property
    def backup(self) -> Backup:
        """With which they keep it."""
        ...

    def room(self, command: np.ndarray, inputs: Inputs, goal: np.ndarray | None) -> Room:
        """Room after one step of a command and then the backup.

        Args:
            command: After every limit, shape (n, m).
            inputs: It came from them.
            goal: Where the geofence is centred, shape (n, 3); None: nowhere [m].
        """
        ...

    def keep(self, holds: np.ndarray) -> None:
        """Let the backup heed the newest room of the robots that it has, shape (n,)."""
        ...


class PlaneRooms:
    """Of boats and wheels."""

    def __init__(
        self,
        robot: Robot,
        samples: Samples,
        control_hz: float,
        area: tuple[float, ...],
        fence: float,
        *,
        model: type[HullRollout] | type[WheelRollout],
    ) -> None:
        """Load model and backup; arguments as in `RolloutGuard`, and the coarse model of such robots."""
        dt = robot.timing.substeps(control_hz) * robot.timing.physics_dt
        self.rollout = model(robot, samples, dt)
        self._bounds = PlaneBounds(area, fence)
        self.margin = MARGIN_M + HOLDS_S * self.rollout.drift
        self.backup = StopAndHold(robot, control_hz, self._bounds)

    def room(self, command: np.ndarray, inputs: Inputs, goal: np.ndarray | None) -> Room:
        """See `Rooms.room`."""
        track = self.rollout.track(inputs.state, inputs.previous, command)
        every = self._bounds.distances(track.places, goal) - self.margin
        return _nearest(every, self._bounds.names, track.rate, track.speed, track.ends)

    def keep(self, holds: np.ndarray) -> None:
        """See `Rooms.keep`: a robot that stands has nothing to heed."""


class WingRooms:
    """Of aircraft: above the ground, within what the coarse model holds for, and in a circle inside the sides."""

    def __init__(
        self, robot: Robot, samples: Samples, control_hz: float, area: tuple[float, ...], fence: float
    ) -> None:
        """Load model and backup; arguments as in `RolloutGuard`.

        Raises:
            ConfigError: No circle fits into the area, or the craft has no trim at its speed.
        """
        self._dt = robot.timing.substeps(control_hz) * robot.timing.physics_dt
        self._circles = Circles(robot, area, fence)
        self._ground, self._ceiling = self._circles.height
        self.backup = LevelFlightBackup(robot, control_hz, self._ground)
        self.rollout = WingRollout(robot, samples, self._dt, self.backup)
        self._names = (GROUND, BANK, ATTACK, SLIP, AIRSPEED, CEILING, *self._circles.names)
        wings = robot.wings
        self._arm, self._slow = 0.5 * wings.span, SLOWER * wings.speed

    def room(self, command: np.ndarray, inputs: Inputs, goal: np.ndarray | None) -> Room:
        """See `Rooms.room`; angles count as the way of a wing's tip."""
        state = SpatialState.from_rigid(inputs.state.to_rigid())
        found = self.rollout.limits(state, self.backup.see(inputs), command)
        circles = self._newest = self._circles.room(state, self._dt, goal)
        every = (
            found.lowest - self._ground - WATER_M,
            self._arm * (math.radians(BANK_DEG) - found.bank),
            self._arm * (math.radians(ATTACK_DEG) - found.attack),
            self._arm * (math.radians(SLIP_DEG) - found.slip),
            REACT_S * (self._slow - found.speed),
            self._ceiling - found.highest - WATER_M,
            *(circles.metres - self._returns(state)[:, None]).T,
        )
        rate = np.sqrt(sum(part * part for part in state.rate))
        speed = np.sqrt(sum(part * part for part in state.velocity))
        room = _nearest(np.stack(every, axis=-1), self._names, rate, speed, circles.turn)
        return replace(room, stops_at=np.where(room.side < FIRST_SIDE, 0.0, circles.turn))

    def keep(self, holds: np.ndarray) -> None:
        """See `Rooms.keep`: a craft in level flight begins to turn before a side."""
        near = holds & (self._newest.metres.min(axis=1) < 0.0)
        self.backup.turn(near & (self.backup.turns == 0.0), self._newest.turn)

    def _returns(self, state: SpatialState) -> np.ndarray:
        """Room to the sides that craft have to have in hand which turn away from one, shape (n,) [m]."""
        turns = self.backup.turns
        return self._circles.lead * np.abs(turns) if len(turns) == len(state.x) else np.zeros(len(state.x))


def _nearest(
    every: np.ndarray, names: tuple[str, ...], rate: np.ndarray, speed: np.ndarray, ends: np.ndarray
) -> Room:
    side = every.argmin(axis=1)
    return Room(every[np.arange(len(every)), side], side, names, rate, speed, ends)


@dataclass(frozen=True)
class Rollouts:
    """What the guard of one family of robots is made of."""

    rooms: Callable[..., Rooms]  # of a robot, samples, command rate [Hz], area and geofence
    tasks: tuple[str, ...] = (
        BACKUP_TASKS  # that the robot's usual law has to do, so that it can be the backup
    )
    # Whether a task's goal is the middle of a geofence.
    fenced: Callable[[Task], bool] = lambda task: True
    # Refuses a robot within an area.
    check: Callable[[Robot, tuple[float, ...]], object] = lambda robot, area: None


_WHEELS = Rollouts(partial(PlaneRooms, model=WheelRollout))
# By family of actuators.
ROLLOUTS = {
    "propellers": Rollouts(partial(PlaneRooms, model=HullRollout)),
    "differential_drive": _WHEELS,
    "ackermann": _WHEELS,
    "control_surfaces": Rollouts(
        WingRooms,
        ("fly_hold",),
        lambda task: isinstance(task, FollowReference),
        lambda robot, area: Circles(robot, area, math.inf),
    ),
}


def rollouts_of(robot: Robot) -> Rollouts | None:
    """What the guard of a robot is made of; None where there is no coarse model of such robots."""
    return row_of(ROLLOUTS, type(robot.actuators))
