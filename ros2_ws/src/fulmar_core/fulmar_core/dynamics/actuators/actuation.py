"""Between a command and what the actuators do: failures, noise, delay, parts that stick, slew and lag."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from array_api_compat import device

from fulmar_core.dynamics.actuators.sticking import Sticking, supplied
from fulmar_core.robots.actuators.family import Actuators
from fulmar_core.robots.actuators.parts import MovingParts
from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.mutable_state import MutableState
from fulmar_core.states.rotation import Array
from fulmar_core.worlds.world import World


class ActuationState(MutableState):
    """What the actuators of a batch of worlds do now; actuators first, worlds last.

    Attributes:
        FROM_ZERO: Names of arrays that are 0 when an episode begins, worlds last; all are in `MUTABLE`.
    """

    FROM_ZERO: ClassVar[tuple[str, ...]] = ("_time_s",)
    MUTABLE: ClassVar[tuple[str, ...]] = (
        "_before",
        "_wanted",
        "applied",
        "gain",
        "_since_s",
        "_late",
        "_open_late",
        "_line",
        "_time_s",
    )

    def __init__(
        self,
        actuators: Actuators,
        safe: Array,
        *,
        opens_late: bool = True,
        delay_ticks: int = 0,
        parts: MovingParts | None = None,
        world: World | None = None,
    ) -> None:
        """Begin where episodes begin.

        Args:
            actuators: Whose delay, slew and lag count; errors of on/off ones act on what they do, not on the command.
            safe: What they do when episodes begin, such as the safe command or the trim, shape (n, worlds), of the
                floating type to compute in.
            opens_late: Whether closed valves may open later than open ones close; saves the work where none does.
            delay_ticks: Physics ticks by which the latest command may act late, where another command may come
                meanwhile; 0 otherwise, which costs less. Valves that open late need 0.
            parts: What may stick within an episode, in worlds whose supply may fall; None saves the work where
                nothing changes.
            world: For memories that begin as it says; None saves the work of those that may be left out.
        """
        self._response, self._binary, self._opens_late = actuators.own_response, actuators.binary, opens_late
        self._scale = array_namespace(safe).asarray(actuators.scale, dtype=safe.dtype, device=device(safe))[
            :, None
        ]
        self._before, self._wanted, self.applied = safe, safe, safe
        self.gain = array_namespace(safe).ones_like(safe)
        self._since_s = 0.0
        self._late = array_namespace(safe).zeros_like(safe[0])  # until the command acts, in every world [s]
        self._open_late = self._late  # until closed valves are open [s]
        # What was commanded at the ticks before, the latest first.
        self._line = (
            array_namespace(safe).zeros((delay_ticks, 1, 1), dtype=safe.dtype, device=device(safe)) + safe
        )
        self._time_s = array_namespace(safe).zeros_like(safe[0])  # since each episode began [s]
        self._sticking = None if parts is None else Sticking(parts, safe)
        self._world: World
        self._slew: Array | None = None
        if self._response.slew:
            xp = array_namespace(safe)
            self._slew = xp.asarray(self._response.slew, dtype=safe.dtype, device=device(safe))[:, None]

    @property
    def lost(self) -> Array | None:
        """Mass that each body has lost through its actuators, shape (worlds,) [kg]; None where none ever does."""
        return None

    @property
    def fuel_share(self) -> Array | None:
        """What is left of a full tank, shape (worlds,) [-]; None where none ever empties."""
        return None

    @property
    def readings(self) -> dict[str, np.ndarray]:
        """What sensors measure of it without errors, worlds first; see `Inputs.readings`."""
        return {}

    def truths(self) -> dict[str, Any]:
        """What sensors measure of it, of a batch of one, by the names of the sensors; see `Truth.more`."""
        return {}

    def reset(self, which: Array, safe: Array) -> None:
        """Bring some worlds back to where they begin.

        Args:
            which: Their numbers.
            safe: What actuators do there when it begins, as in `__init__`, shape (n, 1 or as many).
        """
        for name in ("_before", "_wanted", "applied", "_line", *self.FROM_ZERO):
            values = array_namespace(safe).asarray(getattr(self, name), copy=True)
            values[..., which] = 0 if name in self.FROM_ZERO else safe
            setattr(self, name, values)

    def hold(self, command: Array) -> None:
        """Let every actuator apply a command, as if it had been held for long.

        Args:
            command: Within the actuators' limits, shape (n, worlds).
        """
        self._before = self._wanted = self.applied = command
        self._line = 0.0 * self._line + command

    def begin(self, command: Array, world: World, noise: Array | None) -> None:
        """Take a new command.

        Args:
            command: Within the actuators' limits, shape (n, worlds).
            world: Failures, gains, noise and delays.
            noise: Numbers in [-1, 1], shape (n, worlds); None for none.
        """
        self._before = self._wanted
        self.gain = world.gain
        if noise is None:
            self._wanted = command * world.alive
        elif self._binary:
            self._wanted = command * world.alive
            self.gain = world.gain * (1.0 + world.action_noise * noise)
        else:
            self._wanted = (command + world.action_noise * self._scale * noise) * world.alive
        if self._sticking is not None:
            self._world = world
            self.gain = self.gain * supplied(world, self._time_s)
        self._since_s = 0.0
        self._late = self._response.delay_s + world.action_delay
        self._open_late = self._late + self._response.opening_delay_s + world.opening_delay

    def advance(self, dt: float, *, latest_s: float) -> Array:
        """Let time pass.

        Args:
            dt: For how long [s].
            latest_s: Longest delay of any world; saves the work after it [s].

        Returns:
            What each actuator does during that time, shape (n, worlds).
        """
        target = self._target(dt, latest_s=latest_s)
        if self._slew is not None:
            most = self._slew * dt
            target = self.applied + clip(target - self.applied, -most, most)
        if self._response.lag_s > 0.0 and self._slew is None:
            target = self.applied + (target - self.applied) * min(1.0, dt / self._response.lag_s)
        self.applied = target
        return target

    def _target(self, dt: float, *, latest_s: float) -> Array:
        """What actuators move to while time passes, shape (n, worlds); arguments as in `advance`."""
        commanded = self._commanded(dt, latest_s=latest_s)
        if self._sticking is None:
            return commanded
        reached = self._sticking.reached(commanded, self._world, self._time_s + 0.5 * dt)
        self._time_s = self._time_s + dt
        return reached

    def _commanded(self, dt: float, *, latest_s: float) -> Array:
        """The command that acts while time passes, shape (n, worlds); arguments as in `advance`."""
        if self._line.shape[0]:
            return self._from_line(dt)
        target = self._wanted
        xp = array_namespace(target)
        now_s = self._since_s + 0.5 * dt
        if now_s < latest_s:
            if self._opens_late:
                target = xp.where(now_s < self._open_late, xp.minimum(self._before, target), target)
            target = xp.where(now_s < self._late, self._before, target)
        self._since_s += dt
        return target

    def _from_line(self, dt: float) -> Array:
        """The command of as many ticks ago as each world is late, shape (n, worlds); `dt` is the time of a tick [s]."""
        xp = array_namespace(self._wanted)
        line = xp.concat((self._wanted[None], self._line))
        target = self._wanted
        for ticks in range(1, line.shape[0]):
            target = xp.where((ticks - 0.5) * dt < self._late, line[ticks], target)
        self._line = line[:-1]
        return target
