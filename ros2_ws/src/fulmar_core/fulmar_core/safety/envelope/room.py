"""Room that a body that floats has left before it could not stop within its bounds any more, in closed form.

The body carries out one step of its controller's command. From then on it is stopped: the command to stop is late, then
the body has to slow its turn, and then it brakes along its velocity with the weakest push that it has in any direction,
v² / 2a. What pushes from outside pushes outwards all the while.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.safety.envelope.blocks import NAME as BLOCK
from fulmar_core.safety.envelope.blocks import Blocks
from fulmar_core.safety.envelope.braking import Braking
from fulmar_core.safety.envelope.motion import Motion, lengths
from fulmar_core.safety.geofence import NO_AREA
from fulmar_core.states.state import RigidBodyState

MARGIN_M = 0.03  # kept from every bound, for noise of the odometry [m]
# Kept besides by a body that nears a bound, for what the law that stops it is worse than the sums; it grows up to the
# speed where the law has to spend its thrust on braking alone.
MOVING_M, MOVING_M_S = 0.09, 0.15  # [m], [m/s]
FENCE, TURN, SPEED = "geofence", "turn rate", "speed"


@dataclass(frozen=True)
class Room:
    """How much n bodies have left."""

    metres: np.ndarray  # to the nearest of the sides and the geofence, shape (n,) [m]
    side: np.ndarray  # which that is, an index into `names`, shape (n,)
    names: tuple[str, ...]
    rate: np.ndarray  # turn rate after the step, shape (n,) [rad/s]
    speed: np.ndarray  # speed after the step, shape (n,) [m/s]
    stops_at: np.ndarray  # where the body would stop, shape (n, 3) [m]


class StoppingRoom:
    """Measures the room of bodies of one kind; see the module."""

    def __init__(
        self,
        motion: Motion,
        braking: Braking,
        dt: float,
        area: tuple[float, ...],
        geofence: float,
        blocks: Blocks | None = None,
    ) -> None:
        """Take the bounds.

        Args:
            motion: Of the robot.
            braking: How well it brakes.
            dt: Time of a control step [s].
            area: Sides in the form of `check_area`; `NO_AREA` for none [m].
            geofence: Farthest from the goal; infinite for none [m].
            blocks: Measures distances from obstacles; None where these do not count.
        """
        self._blocks = blocks
        self._motion, self._braking, self._dt, self._fence = motion, braking, dt, geofence
        bounded = tuple(area) != NO_AREA
        axes = "xyz"[: len(area) // 2] if bounded else ""
        self.low = np.array(area[0::2]) if bounded else np.zeros(0)
        self.high = np.array(area[1::2]) if bounded else np.zeros(0)
        count, self._fenced = len(self.low), bool(np.isfinite(geofence))
        # Of each side: its axis, and what makes its distance of the coordinate.
        self._axes = np.tile(np.arange(count), 2)
        self._signs = np.repeat((1.0, -1.0), count)
        self._ends = np.concatenate((-self.low, self.high))
        self.names = (*(f"{axis}_min" for axis in axes), *(f"{axis}_max" for axis in axes), FENCE)

    def room(
        self,
        now: RigidBodyState,
        middle: np.ndarray,
        command: np.ndarray,
        goal: np.ndarray | None,
        strength: np.ndarray | float = 1.0,
        discs: np.ndarray | None = None,
    ) -> Room:
        """Room after one step of a command.

        Args:
            now: State now, of n bodies.
            middle: Attitude in the middle of the step, shape (n, 4).
            command: Of the step, after every limit, shape (n, m).
            goal: Where the geofence is centred, shape (n, 3); None: nowhere [m].
            strength: Of the thrust, as a share of what is believed, shape (n,) [-].
            discs: That stand in the way, as in `Blocks`; None for none.
        """
        its, dt = self._braking, self._dt
        place, velocity, rate = self._motion.moved(now, middle, command, dt)
        speed, turns = lengths(velocity), lengths(rate)
        waits = its.late_s + its.slowing_s(turns) / strength
        pushed = its.pushed * (dt + waits)
        # Way along the velocity, for each metre a second that it has towards a side.
        per = waits + 0.5 * (speed + pushed) / (strength * its.deceleration)
        drift = 0.5 * pushed * (dt + waits) + pushed * per
        far, out = self._distances(place, velocity, goal)
        nearing = _nearing(out)
        way = np.where(out > 0.0, per[:, None] * out + drift[:, None], 0.0)
        every, names = far - way - MARGIN_M - MOVING_M * nearing, self.names
        stops_at = place + velocity * per[:, None]
        if discs is not None:
            assert self._blocks is not None, "this room has no obstacles"
            # What is passed aside is no nearer than on the way, however fast the body nears it now.
            gap, share = self._blocks.gaps(place, stops_at, discs)
            moving = drift + MOVING_M * _nearing(speed)
            left = gap - MARGIN_M - np.where(share > 0.0, moving[:, None], 0.0)
            names = (*names[: far.shape[1]], *(f"{BLOCK} {number + 1}" for number in range(gap.shape[1])))
            every = np.concatenate((every, left), axis=1)
        side = every.argmin(axis=1) if every.shape[1] else np.zeros(len(every), dtype=int)
        metres = every.min(axis=1) if every.shape[1] else np.full(len(every), np.inf)
        return Room(metres, side, names, turns, speed, stops_at)

    def _distances(
        self, place: np.ndarray, velocity: np.ndarray, goal: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Distance from each bound, and speed towards it, shapes (n, bounds) [m], [m/s]."""
        far = place[:, self._axes] * self._signs + self._ends
        towards = velocity[:, self._axes] * -self._signs
        if goal is None or not self._fenced:
            return far, towards
        away = place - goal
        length = np.sqrt((away * away).sum(axis=1, keepdims=True))
        out = (away * velocity).sum(axis=1, keepdims=True) / np.maximum(length, 1e-9)
        left = np.where(out > 0.0, self._fence - length, np.inf)
        return np.concatenate((far, left), axis=1), np.concatenate((towards, out), axis=1)


def _nearing(speed: np.ndarray) -> np.ndarray:
    """Share of `MOVING_M` that a speed towards a bound costs, any shape [-]."""
    return np.asarray(np.minimum(np.maximum(speed, 0.0) / MOVING_M_S, 1.0))
