"""A link between the plants and the controllers of many worlds; see `worlds.link`, whose lock step it stands for.

The controller answers each odometry at once, so that both ways add up to the delay of its command, and a message that
is lost on either way is a command that does not come. Commands do not overtake one another here, and bandwidth is not
simulated.
"""

from __future__ import annotations

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace
from fulmar_core.states.counter_rng import uniform_from, words, world_keys
from fulmar_core.states.mutable_state import MutableState
from fulmar_core.states.rotation import Array
from fulmar_core.wires.silence import default_timeout
from fulmar_core.worlds.link import Link

LINK = 5  # stream of random numbers, beside those of `counter_rng`, of scenarios and of actuators


def longest_way(link: Link) -> float:
    """Longest time there and back [s]."""
    return 2.0 * (link.delay_s + link.jitter_s)


class BatchLink(MutableState):
    """Which command each world's plant has, and how late it is."""

    MUTABLE = ("_received", "_silent_s")

    def __init__(self, link: Link, robot: Robot, command: Array, *, seed: int, control_dt: float) -> None:
        """Begin where episodes begin.

        Args:
            link: Of the scenario.
            robot: Its safe command follows a silence, where it can stop.
            command: What actuators do then, shape (worlds, n).
            seed: Of the run.
            control_dt: Time of a control step [s].
        """
        self._link, self._seed, self._dt = link, seed, control_dt
        xp = array_namespace(command)
        # What cannot stop flies on with its last command: its safe controller is not in the batch.
        self._safe: Array | None = None
        if robot.kind.rests:
            self._safe = xp.asarray(np.asarray(robot.actuators.safe_command), dtype=command.dtype)
        self._timeout_s = default_timeout(control_dt)
        self._received = command
        self._silent_s = 0.0 * command[:, 0]  # since the newest command came [s]

    def reset(self, which: Array, command: Array) -> None:
        """Bring some worlds back to where they begin; `command` of all worlds, shape (worlds, n)."""
        xp = array_namespace(command)
        self._received = xp.asarray(self._received, copy=True)
        self._received[which] = command[which]
        self._silent_s = xp.asarray(self._silent_s, copy=True)
        self._silent_s[which] = 0.0

    def carry(self, command: Array, numbers: Array, repeats: Array, steps: Array) -> tuple[Array, Array]:
        """Send the commands of a control step.

        Args:
            command: Of each controller, shape (worlds, n).
            numbers: Number of each world, shape (worlds,).
            repeats: How often each has begun anew, shape (worlds,).
            steps: Control steps of each so far, shape (worlds,).

        Returns:
            What each plant has to carry out from its arrival on, shape (worlds, n), and how late that is, shape
            (worlds,) [s].
        """
        xp, link = array_namespace(command), self._link
        bits = words(world_keys(self._seed, numbers, repeats, LINK), steps, 4)
        there, back, first, second = (uniform_from(bits[row], command.dtype) for row in range(4))
        arrives = (there >= link.loss) & (back >= link.loss)
        late = 2.0 * link.delay_s + link.jitter_s * (2.0 * first - 1.0 + 2.0 * second - 1.0)
        self._silent_s = xp.where(arrives, xp.zeros_like(late), self._silent_s + self._dt)
        received = xp.where(arrives[:, None], command, self._received)
        if self._safe is not None:
            silent = self._silent_s >= self._timeout_s
            received = xp.where(silent[:, None], self._safe[None, :], received)
        self._received = received
        return received, late
