"""Envelope guard by rollouts: for robots of which no closed form says how they stop."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fulmar_core.controllers.controller import Inputs
from fulmar_core.estimators.actuator_health.actuator_estimator import ActuatorEstimate
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.envelope.braking import IDENTIFIED, RATE_SHARE, SPEED_SHARE, Beliefs, Braking
from fulmar_core.safety.envelope.guard import EnvelopeGuard
from fulmar_core.safety.envelope.lean.rooms import Rooms, rollouts_of
from fulmar_core.safety.envelope.lean.samples import draw_samples
from fulmar_core.safety.envelope.room import Room
from fulmar_core.safety.geofence import NO_AREA


class RolloutGuard(EnvelopeGuard):
    """As `EnvelopeGuard`, for boats, wheels and wings: each step is rolled forward until the backup has the robot.

    The controller's command acts for one step, then the backup, in every sample of the body and its surroundings. The
    robot is kept if all samples stay within its bounds. These robots come to rest, or fly down, in the safe state of
    their actuators: there the backup has no part.
    """

    stops = False

    def __init__(
        self,
        robot: Robot,
        control_hz: float,
        *,
        area: tuple[float, ...] = NO_AREA,
        geofence: float = math.inf,
        beliefs: Beliefs = IDENTIFIED,
    ) -> None:
        """Draw the samples, and load the backup.

        Args:
            robot: One that `rollouts_of` has a coarse model of.
            control_hz: Command rate [Hz].
            area: Sides in the form of `check_area`; `NO_AREA` for none [m].
            geofence: Farthest from the goal, of aircraft to its side; infinite for none [m].
            beliefs: How far the body may differ from its file, beside its `uncertainty`.

        Raises:
            ConfigError: No law of this robot can be the backup, or an area is too narrow for it.
        """
        samples, limits = draw_samples(robot, beliefs), robot.limits
        made = rollouts_of(robot)
        assert made is not None, f"there is no coarse model of '{robot.name}'"
        self._rooms: Rooms = made.rooms(robot, samples, control_hz, area, geofence)
        self._keeper = self._rooms.backup
        law: Any = self._keeper  # of another class than that of robots that float
        self.backup = law
        self.braking = Braking(
            deceleration=math.nan, turning=math.nan, pushed=math.nan, late_s=beliefs.delay_s,
            turn_rate=RATE_SHARE * limits.yaw_rate, speed=SPEED_SHARE * limits.speed,
        )  # fmt: skip
        self.watches, self._notices = True, False
        self._stands = False
        self._stays = robot.kind.stays
        self.events = []
        self.steps = self.steps_in_backup = 0
        self.room = None
        self._begin(1)

    def _begin(self, count: int) -> None:
        """Let every controller act."""
        self._holds, self._trips = np.zeros(count, dtype=bool), np.zeros(count, dtype=int)
        self._calm = self._unlike = np.zeros(count, dtype=int)
        self._stands = False
        self.backup.reset()

    def guarded(
        self,
        command: np.ndarray,
        inputs: Inputs,
        estimate: ActuatorEstimate | None = None,
        goal: np.ndarray | None = None,
    ) -> np.ndarray:
        """See `EnvelopeGuard.guarded`."""
        self._stands = False
        count = len(command)
        if len(self._holds) != count:
            self._begin(count)
        room = self.room = self._rooms.room(command, inputs, goal)
        tripped, freed = self._decide(room)
        self.steps, self.steps_in_backup = self.steps + count, self.steps_in_backup + int(self._holds.sum())
        if freed.any():
            self._keeper.free(freed)
        if tripped.any():
            self.backup.stop(tripped, inputs.state.to_rigid(), room.stops_at)
        sent = command
        if self._holds.any():
            self._rooms.keep(self._holds)
            sent = np.where(self._holds[:, None], self.backup.command(inputs, estimate), command)
        if tripped[0] or freed[0] or self._released:
            self._note(inputs.stamp_ns, room, command[0], sent[0])
        return sent

    def cause(self, room: Room) -> str:
        """See `EnvelopeGuard.cause`."""
        if room.metres[0] >= 0.0:
            return super().cause(room)
        name, left = room.names[room.side[0]], f"{room.metres[0]:+.2f} m of room after its next command"
        if self._stays:
            return f"it could not stop before {name} any more: {left}"
        return f"it could not regain level flight within its bounds any more: {name}, {left}"
