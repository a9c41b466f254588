"""Thruster health: working valves and external push, estimated from commands and odometry.

A bank of Kalman filters, one for each set of at most two lost valves: multiple-model estimation (Magill 1965, "Optimal
adaptive estimation of sampled stochastic processes"; Bar-Shalom, Li and Kirubarajan 2001, §11.6). Each filter believes
in its own set, moves the body under the thrust that the other valves then have, and estimates a force that is constant
in the world and a constant torque. How well each predicts the next measurement gives the likelihood of its set.

A lost valve stays closed, and under a shared pressure line leaves its share to the others, as in the simulators
(`ActuationState.begin`): with two valves commanded and one of them lost, the other gives the whole thrust.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.estimators.actuator_health.applied import Applied
from fulmar_core.estimators.actuator_health.filters import HealthSettings, HoldDetector, PushFilter
from fulmar_core.robots.actuators.thrusters import Thrusters
from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import side_by_side
from fulmar_core.states.planar import PlanarState

MOST_LOST = 2
REMEMBERED = 256  # commands whose wrenches are not computed again


@dataclass(frozen=True, slots=True)
class Health:
    """What is believed now."""

    effectiveness: np.ndarray  # (..., n) expected share of its thrust that each valve gives, 0 to 1 [-]
    alive: np.ndarray  # (..., n) 1 or 0, of the likeliest set [-]
    motion: np.ndarray  # (..., 6) measured columns without noise, of the likeliest set [m, rad, m/s, rad/s]
    push: np.ndarray  # (..., 3) force from outside along the world's x and y [N], torque [N·m]
    held: np.ndarray  # (...,) whether something holds the body: then nothing is learned of the others

    def __getitem__(self, index: int) -> Health:
        """Of one robot out of many."""
        return Health(*(getattr(self, name)[index] for name in Health.__slots__))


class ThrusterHealth:
    """The bank, for one robot or for many at once."""

    def __init__(self, robot: Robot, settings: HealthSettings | None = None) -> None:
        """List the hypotheses.

        Args:
            robot: A planar robot with thrusters, on air.
            settings: How far to trust model and measurements.

        Raises:
            ConfigError: The robot has no thrusters, or swims.
        """
        if not can_estimate_health(robot):
            raise ConfigError(
                f"the health of '{robot.name}' cannot be estimated: it is no body on air with thrusters."
            )
        thrusters = robot.actuated_by(Thrusters)
        self._robot, self._settings = robot, settings or HealthSettings()
        self._shared = thrusters.shared_pressure
        count = len(thrusters.nozzles)
        lost = [each for size in range(MOST_LOST + 1) for each in itertools.combinations(range(count), size)]
        self._alive = np.array([[float(i not in each) for i in range(count)] for each in lost])
        # Ahead, left, yaw moment.
        wrench = thrusters.thrust * thrusters.wrench_per_newton[:, [0, 1, 5]]
        self._doing = np.hstack((wrench, np.ones((count, 1))))  # and how many valves share the pressure
        failure = self._settings.failure
        chances = [failure ** len(each) * (1.0 - failure) ** (count - len(each)) for each in lost]
        self._prior = np.array(chances) / sum(chances)
        self._filters: dict[int, PushFilter] = {}
        self._known: dict[bytes, np.ndarray] = {}
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._state: np.ndarray | None = None  # (..., hypotheses, 9): pose, velocity, push
        self._chance = self._prior
        self._count = 0

    def see(self, measured: PlanarState, applied: np.ndarray | Applied | None, dt: float) -> Health:
        """Take a measurement.

        Args:
            measured: Odometry now, shapes (...,); another shape than before begins anew.
            applied: What the valves did since the last measurement: one command, shape (..., n), or several of one
                robot. None where that is not known: then nothing is learned of valves and push.
            dt: How long that was, a multiple of the physics step [s].

        Returns:
            What is believed now.
        """
        seen = side_by_side(*(np.asarray(column, dtype=float) for column in measured.columns()))
        if self._state is None or self._state.shape[:-2] != seen.shape[:-1]:
            self._begin(seen)
        elif applied is None:
            self._restart_motion(seen)
        else:
            self._follow(seen, applied, dt)
        return self._believed()

    def _begin(self, seen: np.ndarray) -> None:
        self._state = np.zeros((*seen.shape[:-1], len(self._alive), 9))
        self._state[..., :6] = seen[..., None, :]
        self._chance = np.broadcast_to(self._prior, self._state.shape[:-1])
        self._yaw = seen[..., 2].copy()
        self._count = 0
        self._hold = HoldDetector(self._settings, seen.shape[:-1])
        self._kept = self._state[..., 6:], self._chance  # from before anything spoke for a hold

    def _restart_motion(self, seen: np.ndarray) -> None:
        """Go on from the measurement with what is believed of valves and push: what moved the body is not known."""
        assert self._state is not None
        self._state = self._state.copy()
        self._state[..., :6] = seen[..., None, :]
        self._yaw = seen[..., 2].copy()
        self._count = 0

    def _follow(self, seen: np.ndarray, applied: np.ndarray | Applied, dt: float) -> None:
        assert self._state is not None
        equations = self._equations(dt)
        turned = self._turn(seen[..., 2]) @ equations.driven
        ahead = self._state @ equations.step + self._driven(applied, turned)
        off = seen[..., None, :] - ahead[..., :6]
        off[..., 2] = _wrapped(off[..., 2])
        found = off @ equations.gain(self._count)
        self._count += 1
        self._state = ahead + found[..., :9]
        odd = found[..., 9:]
        surprise = 0.5 * (odd * odd).sum(axis=-1)
        least = surprise.min(axis=-1, keepdims=True)
        surprise -= least
        chance = self._chance * np.exp(-np.minimum(surprise, self._settings.surprise))
        free = least[..., 0] - np.log(chance.sum(axis=-1))
        change = self._settings.change * dt
        chance *= (1.0 - change) / chance.sum(axis=-1, keepdims=True)
        self._chance = chance + change * self._prior
        if self._settings.held:
            self._heed_hold(seen, free, applied, dt)

    def _heed_hold(
        self, seen: np.ndarray, surprise: np.ndarray, applied: np.ndarray | Applied, dt: float
    ) -> None:
        """Learn nothing from a body that is held, and forget what was learned while it was not known to be."""
        assert self._state is not None
        commands = applied.commands if isinstance(applied, Applied) else np.asarray(applied)
        thrust = np.asarray((commands > 0.0).any(axis=None if isinstance(applied, Applied) else -1))
        self._hold.update(seen, surprise, thrust, dt)
        push, chance = self._kept
        held, innocent = self._hold.held, self._hold.innocent
        if held.any():
            at_rest = seen.copy()
            at_rest[..., 3:] = 0.0
            still = np.concatenate(
                (np.broadcast_to(at_rest[..., None, :], (*push.shape[:-1], 6)), push), axis=-1
            )
            self._state = np.where(held[..., None, None], still, self._state)
            self._chance = np.where(held[..., None], chance, self._chance)
        if innocent.all():
            self._kept = self._state[..., 6:], self._chance
        elif innocent.any():
            self._kept = (
                np.where(innocent[..., None, None], self._state[..., 6:], push),
                np.where(innocent[..., None], self._chance, chance),
            )

    def _driven(self, applied: np.ndarray | Applied, turned: np.ndarray) -> np.ndarray:
        """What the valves add to the state within the interval under each hypothesis, shape (..., hypotheses, 9).

        Args:
            applied: As in `see`.
            turned: What a wrench in the body's frame does that holds for the whole interval, shape (..., 3, 9).
        """
        if not isinstance(applied, Applied):
            return np.asarray(self._wrenches(np.asarray(applied, dtype=float)) @ turned)
        if len(applied.seconds) == 1:
            return np.asarray(self._wrenches_of_one(applied.commands[0]) @ turned)
        seconds, tick = applied.seconds, self._robot.timing.physics_dt
        whole = float(seconds.sum())
        # An early push moves the body farther than a late one: it has the rest of the interval to do so.
        rest = whole - np.cumsum(seconds)
        place = seconds * (2.0 * rest + seconds + tick) / (whole * (whole + tick))
        speed = seconds / whole
        wrenches = np.stack([self._wrenches(command) for command in applied.commands])
        driven = np.tensordot(speed, wrenches, 1) @ turned
        driven[..., :3] = np.tensordot(place, wrenches, 1) @ turned[..., :3]
        return np.asarray(driven)

    def _wrenches_of_one(self, command: np.ndarray) -> np.ndarray:
        """`_wrenches` of one robot's command; the newest are remembered, as valves know few of them."""
        key = command.tobytes()
        found = self._known.get(key)
        if found is None:
            if len(self._known) >= REMEMBERED:
                self._known.clear()
            found = self._known[key] = self._wrenches(command)
        return found

    def _wrenches(self, command: np.ndarray) -> np.ndarray:
        """Force ahead, to the left and yaw moment of the valves under each hypothesis, shape (..., hypotheses, 3)."""
        doing = (command[..., None, :] * self._alive) @ self._doing
        if not self._shared:
            return np.asarray(doing[..., :3])
        return np.asarray(doing[..., :3] / np.maximum(doing[..., 3:], 1.0))

    def _turn(self, yaw: np.ndarray) -> np.ndarray:
        """From the body's frame to the world's, half-way between the last heading and this one, shape (..., 3, 3)."""
        middle = self._yaw + 0.5 * _wrapped(yaw - self._yaw)
        self._yaw = yaw.copy()
        turn = np.zeros((*yaw.shape, 3, 3))
        turn[..., 0, 0] = turn[..., 1, 1] = np.cos(middle)
        turn[..., 0, 1] = np.sin(middle)
        turn[..., 1, 0] = -turn[..., 0, 1]
        turn[..., 2, 2] = 1.0
        return turn

    def _equations(self, dt: float) -> PushFilter:
        steps = max(1, round(dt / self._robot.timing.physics_dt))
        if steps not in self._filters:
            seconds = steps * self._robot.timing.physics_dt
            self._filters[steps] = PushFilter(self._robot, self._settings, seconds)
        return self._filters[steps]

    def _believed(self) -> Health:
        assert self._state is not None
        best = np.argmax(self._chance, axis=-1)
        rows = self._state.reshape(-1, *self._state.shape[-2:])
        motion = rows[np.arange(best.size), best.ravel(), :6]
        return Health(
            self._chance @ self._alive,
            self._alive[best],
            motion.reshape(*best.shape, 6),
            (self._chance[..., None, :] @ self._state[..., 6:])[..., 0, :],
            self._hold.held,
        )


def _wrapped(angle: np.ndarray) -> np.ndarray:
    """As `planar.wrapped`, without asking which library an array is of: this runs at every control step."""
    return angle - 2.0 * np.pi * (angle * (0.5 / np.pi)).round()


def can_estimate_health(robot: Robot) -> bool:
    """Whether the health of a robot's actuators can be estimated."""
    return isinstance(robot.actuators, Thrusters) and robot.body.planar and robot.hydrodynamics is None
