"""Envelope guard: a backup law takes over from a controller just in time, and gives back once there is room again."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from fulmar_core.controllers.controller import Inputs
from fulmar_core.estimators.actuator_health.actuator_estimator import ActuatorEstimate, sure_of
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.envelope.backup import Backup
from fulmar_core.safety.envelope.blocks import Blocks
from fulmar_core.safety.envelope.braking import IDENTIFIED, Beliefs, braking_of
from fulmar_core.safety.envelope.dead_check import NONE
from fulmar_core.safety.envelope.event import Event
from fulmar_core.safety.envelope.motion import Motion, attitude_after
from fulmar_core.safety.envelope.response_check import DEAD, SLOW, SOUND, WORDS, ResponseCheck
from fulmar_core.safety.envelope.room import SPEED, TURN, Room, StoppingRoom
from fulmar_core.safety.geofence import NO_AREA
from fulmar_core.states.state import RigidBodyState

RETURN_M = 0.15  # room with which the controller may act again [m]
FIRST_TICKS = 5  # with that room in a row before it does so first; twice as many each further time
LATCHES_AT = 4  # the trip that stays until a new goal
# Of the least thrust that is believed: below it the law's estimator takes what is missing for a push.
DOUBTED = 0.9
CALMER = (
    0.8  # of the turn rate and of the speed that trip the guard, below which the controller may act again
)


class EnvelopeGuard:
    """Takes over from the controllers of n robots of one kind; each robot by itself.

    Attributes:
        backup: What acts instead.
        watches: Whether it takes over from controllers; else it only stops robots that none drives.
        events: Trips and returns of the first robot since the guard was made, in their order.
        steps: Control steps that the guard has checked, of all robots.
        steps_in_backup: Those of them in which the backup acted.
        room: What the newest check found; None before the first.
        stops: Whether the backup stops robots whose controller may not act, in the place of the safe command.
    """

    stops = True
    _idle = True  # no robot was held at the newest step, and none is
    _released = False  # a new goal has ended a hold of the first robot, which no event says yet

    def __init__(
        self,
        robot: Robot,
        control_hz: float,
        *,
        area: tuple[float, ...] = NO_AREA,
        geofence: float = np.inf,
        watches: bool = True,
        notices: bool = True,
        sees_obstacles: bool = True,
        beliefs: Beliefs = IDENTIFIED,
    ) -> None:
        """Find out how well the robot brakes, and load the backup.

        Args:
            robot: One that floats.
            control_hz: Command rate [Hz].
            area: Sides in the form of `check_area`; `NO_AREA` for none [m].
            geofence: Farthest from the goal; infinite for none [m].
            watches: Whether it takes over from controllers; else it only stops robots that none drives.
            notices: Whether a body that answers commands otherwise than is believed is stopped for good.
            sees_obstacles: Whether it stops a robot in the plane before the obstacles of its goal, too.
            beliefs: How far the body may differ from its file.

        Raises:
            ConfigError: Its actuators are too weak, or no law holds a pose of it.
        """
        dt = robot.timing.substeps(control_hz) * robot.timing.physics_dt
        self.braking = braking_of(robot, beliefs, dt)
        self._notices = notices
        self._motion, self._half_s = Motion(robot), 0.5 * dt
        self._response = ResponseCheck(robot, self._motion, beliefs, self.braking, dt)
        self._blocks = Blocks(robot) if sees_obstacles and robot.state_type.AXES == 2 else None
        self._sums = StoppingRoom(self._motion, self.braking, dt, area, geofence, self._blocks)
        inside = self._sums.low, self._sums.high
        self.backup = Backup(robot, self.braking, control_hz, *inside, blocks=self._blocks)
        self.watches, self._names = watches, robot.actuators.names
        self._stands = False
        self.events: list[Event] = []
        self.steps = self.steps_in_backup = 0
        self.room: Room | None = None
        self._begin(1)

    def _begin(self, count: int) -> None:
        """Let every controller act."""
        self._holds, self._trips = np.zeros(count, dtype=bool), np.zeros(count, dtype=int)
        self._calm = np.zeros(count, dtype=int)  # steps in a row with enough room
        self._stands = False
        self._unlike = np.zeros(
            count, dtype=int
        )  # how each differs from the beliefs, of `response_check.WORDS`
        self._response.reset(count)
        self.backup.reset()

    def reset(self) -> None:
        """Let every controller act, and forget its trips: a new goal."""
        self._released = self._released or bool(self._holds[0])
        self._begin(len(self._holds))

    @property
    def holds(self) -> np.ndarray:
        """Which robots the backup drives, shape (n,)."""
        return self._holds

    @property
    def trips(self) -> np.ndarray:
        """How often it took over from each since the last reset, shape (n,)."""
        return self._trips

    @property
    def latched(self) -> bool:
        """Whether the backup keeps the first robot until a new goal."""
        return bool(self._holds[0] and self._trips[0] >= LATCHES_AT)

    def guarded(
        self,
        command: np.ndarray,
        inputs: Inputs,
        estimate: ActuatorEstimate | None = None,
        goal: np.ndarray | None = None,
    ) -> np.ndarray:
        """Commands of a controller, or of the backup for robots that it would have no room for, shape (n, m).

        Args:
            command: What the controller wants, after every limit, shape (n, m).
            inputs: It came from them.
            estimate: Of the estimator that the backup's law asks for; None where it asks for none.
            goal: Where the geofence is centred, shape (n, 3); None: nowhere [m].
        """
        self._stands = False
        now = inputs.state.to_rigid()
        count = len(now.position_in_world)
        if len(self._holds) != count:
            self._begin(count)
        middle = attitude_after(now.quat_xyzw, self._half_s * now.angular_velocity_in_body)
        found = self._response.see(now, middle, inputs.previous, inputs.stamp_ns)
        discs = self._discs(inputs)
        room = self.room = self._sums.room(now, middle, command, goal, self._response.strength, discs)
        if found.any():
            # A dead actuator explains more than what was found before it.
            self._unlike = np.where((self._unlike == SOUND) | (found == DEAD), found, self._unlike)
        tripped, freed = self._decide(room)
        if self._idle and not self._released:
            self.steps += count
            return command
        self.steps, self.steps_in_backup = self.steps + count, self.steps_in_backup + int(self._holds.sum())
        if tripped.any():
            self.backup.stop(tripped, now, room.stops_at, discs)
        sent = command
        if self._holds.any():
            ahead, known = self._rolled(now, inputs, estimate)
            known = self._without_dead(ahead, known)
            sent = np.where(self._holds[:, None], self.backup.command(ahead, known), command)
        if tripped[0] or freed[0] or self._released:
            self._note(inputs.stamp_ns, room, command[0], sent[0])
        return sent

    def _discs(self, inputs: Inputs) -> np.ndarray | None:
        """Obstacles of the goals, as in `Blocks`; None where there are none or they do not count."""
        discs = np.asarray(inputs.goal.obstacles)
        return None if self._blocks is None or not discs.size else discs

    def _rolled(
        self, now: RigidBodyState, inputs: Inputs, estimate: ActuatorEstimate | None
    ) -> tuple[Inputs, ActuatorEstimate | None]:
        """Inputs and estimate with bodies that answer late rolled forward to when a command acts.

        What the estimator makes of these bodies is wrong: it believes that commands act at once. Of bodies that are
        weak it takes the lost thrust for a push.
        """
        late = self._unlike == SLOW
        if estimate is not None:
            late = late | ((self._response.strength < DOUBTED) & (estimate.alive.min(axis=1) > 0.5))
        if not late.any():
            return inputs, estimate
        form = type(inputs.state)
        delay_s = np.where(self._unlike == SLOW, self._response.delay_s, 0.0)
        state = form.from_rigid(self._motion.after(now, inputs.previous, delay_s[:, None]))
        if estimate is None:
            return replace(inputs, state=state), None
        parts = zip(state.columns(), estimate.state.columns(), strict=True)
        mixed = form(*(np.where(late, rolled, believed) for rolled, believed in parts))
        push, alive = (
            np.where(late[:, None], 0.0, estimate.push),
            np.where((self._unlike == SLOW)[:, None], 1.0, estimate.alive),
        )
        return replace(inputs, state=state), replace(estimate, state=mixed, push=push, alive=alive)

    def _without_dead(self, inputs: Inputs, estimate: ActuatorEstimate | None) -> ActuatorEstimate | None:
        """An estimate that knows which actuators are dead, for a law that has no estimator of its own."""
        parts = self._response.parts
        if parts is None or not parts.found:
            return estimate
        known = parts.dead != NONE
        if estimate is None:
            state: Any = inputs.state
            return sure_of(np.where(known[:, None], parts.alive, 1.0), state)
        return replace(estimate, alive=np.where(known[:, None], parts.alive, estimate.alive))

    def _note(self, stamp_ns: int, room: Room, refused: np.ndarray, sent: np.ndarray) -> None:
        """Keep that the backup drives the first robot from now on, or does so no more."""
        held = bool(self._holds[0])
        cause, trip = self.cause(room) if held else "", int(self._trips[0])
        commands = tuple(refused.tolist()), tuple(sent.tolist())
        metres = float(room.metres[0])
        side = room.names[room.side[0]] if np.isfinite(metres) else ""
        self.events.append(Event(stamp_ns, held, cause, metres, trip, *commands, side))
        self._released = False

    def stopped(self, inputs: Inputs, estimate: ActuatorEstimate | None) -> np.ndarray:
        """Commands that stop robots whose controller may not act, and hold each where it can stop, shape (n, m).

        Args:
            inputs: Of the control step; their goal does not matter.
            estimate: Of the estimator that the backup's law asks for; None where it asks for none.
        """
        now = inputs.state.to_rigid()
        count = len(now.position_in_world)
        if not self._stands:
            self._begin(count)
            self._stands = True
            middle = attitude_after(now.quat_xyzw, self._half_s * now.angular_velocity_in_body)
            room = self._sums.room(now, middle, np.zeros_like(inputs.previous), None)
            self.backup.stop(np.ones(count, dtype=bool), now, room.stops_at)
        return self.backup.command(inputs, estimate)

    def _decide(self, room: Room) -> tuple[np.ndarray, np.ndarray]:
        """Which robots the backup takes over now, and which it gives back, each shape (n,)."""
        its = self.braking
        beyond = room.metres < 0.0
        beyond |= (room.rate > its.turn_rate) | (room.speed > its.speed)
        if self._notices:
            beyond |= self._unlike != SOUND
        self._idle = not (beyond.any() or self._holds.any())
        if self._idle:
            return self._holds, self._holds
        calm = room.metres > RETURN_M
        calm &= (room.rate < CALMER * its.turn_rate) & (room.speed < CALMER * its.speed)
        if self._notices:
            calm &= self._unlike == SOUND
        self._calm = np.where(self._holds & calm, self._calm + 1, 0)
        waits = FIRST_TICKS * 2 ** np.maximum(self._trips - 1, 0)
        freed = self._holds & (self._calm >= waits) & (self._trips < LATCHES_AT)
        tripped = ~self._holds & beyond
        self._holds = (self._holds & ~freed) | tripped
        self._trips = self._trips + tripped
        self._calm = np.where(tripped | freed, 0, self._calm)
        return tripped, freed

    def cause(self, room: Room) -> str:
        """Why the guard takes over from the first robot's controller, in words."""
        its = self.braking
        if self._notices and self._unlike[0] != SOUND:
            what, parts = int(self._unlike[0]), self._response.parts
            return f"{self._names[parts.dead[0]]} {WORDS[what]}" if parts and what == DEAD else WORDS[what]
        if room.metres[0] < 0.0:
            name = room.names[room.side[0]]
            return f"it could not stop before {name} any more: {room.metres[0]:+.2f} m of room after its next command"
        if room.rate[0] > its.turn_rate:
            return (
                f"{TURN}: {room.rate[0]:.2f} rad/s after its next command, at most {its.turn_rate:.2f} rad/s"
            )
        return f"{SPEED}: {room.speed[0]:.2f} m/s after its next command, at most {its.speed:.2f} m/s"
