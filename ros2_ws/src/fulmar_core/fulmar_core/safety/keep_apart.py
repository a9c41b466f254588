"""Guard that keeps a robot apart from other robots of its fleet: it nears none faster than it can still brake.

Two robots whose guards both act share the free gap by what each can brake. The speed of robot i towards robot j is at
most u with u t + u² / (2 a) = g, where a is what i can brake by, t is how late its braking begins, and g is its share
of the gap. Where the controller asks for more, the guard takes the part of its push that leads towards the other
robot away, and lets the robot pass on its right-hand side: robots that meet do not wait for each other for ever.
One that stands still is passed on the side to which the controller pushes when the robot comes near.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.allocation import allocation_of
from fulmar_core.controllers.controller import Inputs
from fulmar_core.robots.actuators.pushing import PLANAR, Pushing
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.wires.neighbours import NEIGHBOURS

OLD_NS = 1_000_000_000  # older places of others count for nothing [ns]
MARGIN_M = 0.18  # between two hulls, for noise and for pushes
SHARE = 0.4  # of the weakest push that braking counts on: a part of it turns the body
LEAVES_M_S = 0.05  # speed away from a robot that is too near
BRAKES_S = 0.4  # in which the guard wants to lose a wrong speed
PASSES_M_S = 0.15  # speed across, to the right of a robot in the way
STANDS_M_S, STANDS_S = 0.03, 3.0  # below this speed for so long, another robot stands still
NEAR_M = 0.5  # gap within which the side on which one that stands still is passed stays the same
AHEAD_M_S2 = 0.02  # push towards another robot, beyond which the controller counts as wanting to pass it
WORDS = ("keeps apart from", "does not know where the others are")
HAD_KEPT = "the guard kept the robot apart from another one"  # warning of a run


@dataclass(frozen=True)
class Other:
    """Another robot of a fleet."""

    name: str
    robot: Robot
    guarded: bool = False  # whether a guard of its own keeps it apart

    @classmethod
    def of(cls, text: str) -> Other:
        """From `NAME TYPE` or `NAME TYPE guarded`.

        Raises:
            ValueError: The text is neither.
        """
        parts = text.split()
        if len(parts) not in (2, 3) or parts[2:] not in ([], ["guarded"]):
            raise ValueError(f"'neighbours' has '{text}', and an entry is NAME TYPE or NAME TYPE guarded.")
        return cls(parts[0], load_robot(parts[1]), guarded=len(parts) == 3)


class KeepApartGuard:
    """Bounds the speed of robots towards others.

    Attributes:
        holds: Which robots the guard holds back now, shape (n,).
        interventions: Control steps in which it held the first robot back.
    """

    def __init__(self, robot: Robot, others: Sequence[Other], dt: float) -> None:
        """Find out how well every robot brakes.

        Args:
            robot: It moves in the plane and pushes in every direction.
            others: At least one.
            dt: Time of a control step [s].

        Raises:
            ConfigError: The robot cannot brake in every direction.
        """
        check_can_brake(robot)
        actuators, response = robot.actuated_by(Pushing), robot.actuators.response
        full = np.abs(actuators.full_thrust[:, None] * actuators.wrench_per_newton).sum(axis=0)[PLANAR]
        weight = np.diag(1.0 / np.array([full[0], full[0], full[2]]) ** 2)
        self._allocation = allocation_of(actuators, weight=weight, cost=0.0)
        self._actuators, self._mass, self._dt = actuators, robot.body.mass, dt
        self._late_s = robot.sensors.odometry.delay_s + response.delay_s + response.opening_delay_s + dt
        own = braking(robot)
        theirs = np.array([braking(other.robot) if other.guarded else 0.0 for other in others])
        self._brakes, self._parts = own, own / (own + theirs)
        self._radii = np.array([robot.body.radius + other.robot.body.radius for other in others])
        self._guarded = np.array([other.guarded for other in others])
        self._names = [other.name for other in others]
        self.holds = np.zeros(1, dtype=bool)
        self.interventions, self._words = 0, ""
        self._sides: np.ndarray | None = None  # right 1, left -1, 0 not chosen; shape (n, k)
        self._stood_s = np.zeros(
            (1, len(others))
        )  # for how long each other robot has been slow, shape (n, k)

    def reset(self) -> None:
        """Hold no robot back: a new episode, or a jump."""
        self.holds = np.zeros(1, dtype=bool)
        self._words, self._sides = "", None

    @property
    def words(self) -> str:
        """Why the first robot is held back; empty if it is not."""
        return self._words

    def guarded(self, command: np.ndarray, inputs: Inputs) -> np.ndarray:
        """Commands of a controller, or the guard's own for robots that near another one too fast, shape (n, m).

        Without `NEIGHBOURS` among the readings the robots brake: nothing is known of the others.
        """
        state = inputs.state
        place, velocity = np.stack((state.x, state.y), axis=-1), np.stack((state.vx, state.vy), axis=-1)
        heading = np.asarray(state.yaw)
        wrench = np.concatenate(self._actuators.wrench_in_body(command), axis=-1)[:, PLANAR]
        wanted = turned(wrench[:, :2], heading) / self._mass
        seen = inputs.readings.get(NEIGHBOURS)
        if seen is None:
            self.holds, self._words = np.ones(len(command), dtype=bool), WORDS[1]
            bounded = -velocity / BRAKES_S
        else:
            others = seen.reshape(len(command), -1, 4)
            bounded, nearest = self._bounded(wanted, place, velocity, others)
            self.holds = np.abs(bounded - wanted).max(axis=-1) > 1e-9
            self._words = f"{WORDS[0]} '{self._names[nearest[0]]}'" if self.holds[0] else ""
        self.interventions += int(self.holds[0])
        if not self.holds.any():
            return command
        force = turned(self._mass * bounded, -heading)
        own = np.asarray(self._allocation.best(np.concatenate((force, wrench[:, 2:]), axis=-1)))
        return np.where(self.holds[:, None], own, command)

    def _bounded(
        self, wanted: np.ndarray, place: np.ndarray, velocity: np.ndarray, others: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Accelerations within the bounds, shape (n, 2) [m/s²], and the nearest other robot of each, shape (n,)."""
        away = others[..., :2] - place[:, None]
        far = np.maximum(np.linalg.norm(away, axis=-1), 1e-9)
        ahead = away / far[..., None]  # (n, k, 2)
        right = np.stack((ahead[..., 1], -ahead[..., 0]), axis=-1)
        gap = far - self._radii - MARGIN_M
        right = self._sides_of(wanted, right, others[..., 2:], gap)[..., None] * right
        nears = np.sum(velocity[:, None] * ahead, axis=-1)
        comes = np.maximum(-np.sum(others[..., 2:] * ahead, axis=-1), 0.0)
        most = self._most(self._parts * gap) - np.where(self._guarded, 0.0, comes)
        bound = (most - nears) / BRAKES_S
        found = wanted.copy()
        order = np.argsort(-gap, axis=1)  # the nearest last: it counts most
        rows = np.arange(len(found))
        for _ in range(2):
            for column in order.T:
                n, t, limit = ahead[rows, column], right[rows, column], bound[rows, column]
                push = np.sum(found * n, axis=-1)
                excess = np.maximum(push - limit, 0.0)
                passes = (excess > 0.0) & (np.sum(wanted * n, axis=-1) > AHEAD_M_S2)
                found = found - excess[:, None] * n
                across = np.sum(found * t, axis=-1)
                aside = (PASSES_M_S - np.sum(velocity * t, axis=-1)) / BRAKES_S
                found = found + np.where(passes, np.maximum(aside - across, 0.0), 0.0)[:, None] * t
        for column in order.T:  # what leads past one robot must not lead into another
            n, limit = ahead[rows, column], bound[rows, column]
            found = found - np.maximum(np.sum(found * n, axis=-1) - limit, 0.0)[:, None] * n
        return found, np.argmin(gap, axis=1)

    def _sides_of(
        self, wanted: np.ndarray, right: np.ndarray, speeds: np.ndarray, gap: np.ndarray
    ) -> np.ndarray:
        """On which side each other robot is passed: right 1, left -1, shape (n, k).

        Robots that move all pass to their right, and so do not meet again. What stands still does not act by that rule:
        there the right may lead away from the goal, and the robot would wait for ever.
        """
        if self._sides is None or self._sides.shape != gap.shape:
            self._sides, self._stood_s = np.zeros(gap.shape), np.zeros(gap.shape)
        slow = np.linalg.norm(speeds, axis=-1) < STANDS_M_S
        self._stood_s = np.where(slow, self._stood_s + self._dt, 0.0)
        still = self._stood_s > STANDS_S
        across = np.sum(wanted[:, None] * right, axis=-1)
        chosen = np.where(across < -AHEAD_M_S2, -1.0, 1.0)
        sides = np.where(still, np.where(self._sides == 0.0, chosen, self._sides), 1.0)
        self._sides = np.where(still & (gap < NEAR_M), sides, 0.0)
        return sides

    def _most(self, gap: np.ndarray) -> np.ndarray:
        """Highest speed towards another robot from which a robot still stops within a gap [m], in [m/s]."""
        slow = self._brakes * self._late_s
        return np.where(
            gap > 0.0, np.sqrt(slow**2 + 2.0 * self._brakes * np.maximum(gap, 0.0)) - slow, -LEAVES_M_S
        )


def braking(robot: Robot) -> float:
    """What a robot surely brakes by in any direction of the plane [m/s²]."""
    actuators = robot.actuated_by(Pushing)
    full = np.abs(actuators.full_thrust[:, None] * actuators.wrench_per_newton).sum(axis=0)[PLANAR]
    weight = np.diag(1.0 / np.array([full[0], full[0], full[2]]) ** 2)
    angles = np.linspace(0.0, 2.0 * np.pi, 72, endpoint=False)
    ways = np.stack((np.cos(angles), np.sin(angles)), axis=-1)
    wanted = np.concatenate((full[0] * ways, np.zeros((len(ways), 1))), axis=-1)
    made, _ = actuators.wrench_in_body(allocation_of(actuators, weight=weight, cost=0.0).best(wanted))
    return SHARE * float(np.sum(made[:, :2] * ways, axis=-1).min()) / robot.body.mass


def check_can_brake(robot: Robot) -> None:
    """Refuse a robot that the guard cannot keep apart.

    Raises:
        ConfigError: With what it would take.
    """
    sideways = robot.performance.lateral_speed > 0.0
    if not (robot.body.planar and robot.actuators.one_way and sideways):
        raise ConfigError(
            f"'keep_apart' brakes robots that push in every direction of the plane, and '{robot.name}' does not. Leave "
            "it out for this robot; the others keep apart from it."
        )


def turned(vectors: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Vectors of the plane, shape (n, 2), turned to the left by angles, shape (n,) [rad]."""
    cos, sin = np.cos(angle), np.sin(angle)
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack((cos * x - sin * y, sin * x + cos * y), axis=-1)
