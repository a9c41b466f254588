"""Check of a robot by the wrenches that its actuators make: rank, limits, controllability, and least times."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from dataclasses import dataclass
from math import inf, pi, sqrt
from typing import Any, ClassVar, Self, cast

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.plausibility import logger as plausibility
from fulmar_core.controllers.allocation import check_allocation
from fulmar_core.dynamics.hover import hover_command, level_state
from fulmar_core.dynamics.linear_model import LinearModel, linearise
from fulmar_core.robots.actuators.pushing import WRENCH, Pushing
from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels
from fulmar_core.robots.robot import Robot
from fulmar_core.states.planar import PlanarState
from fulmar_evaluation.performance_gaps import LARGEST_GAP, performance_gaps
from fulmar_evaluation.wrench_limits import AXES, WrenchSet, wrench_set_of

PLAIN = {
    "force_x": "force along x",
    "force_y": "force along y",
    "force_z": "force along z",
    "torque_x": "torque about x (roll)",
    "torque_y": "torque about y (pitch)",
    "torque_z": "torque about z (yaw)",
}
QUARTER_TURN = 0.5 * pi
# Of the largest entry of a row of a linear model by central differences: what is less is rounding [-].
LEAST_EFFECT = 1e-5


@dataclass(frozen=True)
class WrenchCheck:
    """Result for one robot, by default of one that something pushes in the plane."""

    robot: Robot
    wrenches: WrenchSet  # about the body's origin

    about_com: ClassVar[bool] = True  # whether the limits about the centre of mass are of interest

    @classmethod
    def of(cls, robot: Robot, **trim: float | None) -> Self:
        """Check a robot.

        Raises:
            ConfigError: A `trim` was asked for, which only aircraft have.
        """
        if any(value is not None for value in trim.values()):
            raise ConfigError(
                f"--speed, --altitude and --height are for aircraft, and '{robot.name}' is none."
            )
        return cls(robot, wrench_set_of(robot))

    @functools.cached_property
    def effects(self) -> WrenchSet:
        """What commands do to each axis."""
        return self.wrenches

    @property
    def sideways(self) -> bool:
        """Whether it is to move to either side by itself."""
        return self.robot.performance.lateral_speed > 0.0

    @functools.cached_property
    def controllable(self) -> bool:
        """Whether commands bring the robot to any pose.

        Of (A, B) the controllability matrix has full rank. One-way actuators need a command with all of them on that
        leaves no wrench, too (Brammer, "Controllability in linear autonomous systems with positive controllers", SIAM
        J. Control 10, 1972).
        """
        if not self.wrenches.holds_zero_with_all_on:
            return False
        a, b, outputs = self._model()
        reached = [b]
        for _ in range(len(a) - 1):
            reached.append(a @ reached[-1])
        rows = np.hstack(reached)[:outputs]
        sizes = np.abs(rows).max(axis=1, keepdims=True)
        if not sizes.min() > LEAST_EFFECT * sizes.max():
            return False
        return int(np.linalg.matrix_rank(rows / sizes, tol=LEAST_EFFECT)) == outputs

    def _model(self) -> tuple[np.ndarray, np.ndarray, int]:
        """A, B, and how many of the states count: the pose of the core's own model while driving ahead.

        Wheels and boats go sideways only by turning on the way.
        """
        model = self._linearised()
        return model.a, model.b * self.robot.actuators.scale, 3

    def _linearised(self) -> LinearModel:
        """Driving ahead at half of the speed that tasks ask for."""
        zero, speed = np.asarray(0.0), np.asarray(0.5 * self.robot.performance.speed)
        ahead = PlanarState(zero, zero, zero, speed, zero, zero)
        return linearise(self.robot, ahead, self._driving(), self.robot.timing.control_s)

    def _driving(self) -> np.ndarray:
        """Command meanwhile: propellers at a half, out of the dead zone; one-way actuators coast."""
        actuators = self.robot.actuators
        return np.array(actuators.safe_command, dtype=float) if actuators.one_way else 0.5 * actuators.scale

    def problems(self) -> Iterator[str]:
        """One line for each thing that is wrong; what follows from another one is left out."""
        problem = self._problem()
        if problem:
            yield problem
        for gap, line in performance_gaps(self.robot, self.wrenches):
            if gap <= LARGEST_GAP:
                plausibility.warning("%s", line)
            elif not problem:  # what is wrong with the layout comes first
                problem = line
                yield line

    def _problem(self) -> str:
        """What is wrong with the layout of the actuators; empty if nothing."""
        count = len(self.robot.actuators.names)
        missing = [axis for axis in self.effects.missing_axes if self.sideways or axis != "force_y"]
        if missing:
            return (
                f"its {count} actuators have rank {self.effects.rank} of {len(self.effects.axes)}: no command makes a "
                f"{' or a '.join(PLAIN[axis] for axis in missing)} alone. Place or aim some of them otherwise."
            )
        if not self.wrenches.holds_zero_with_all_on:
            ways = [
                f"{sign} {PLAIN[axis]}"
                for axis, limits in zip(self.wrenches.axes, self.wrenches.limits, strict=True)
                for sign, limit in zip(("negative", "positive"), limits, strict=True)
                if limit == 0.0
            ]
            return (
                f"its {count} actuators push one way, and with all of them on a wrench remains: there is no "
                f"{', no '.join(ways) or 'wrench in some direction'}. Add one that pushes against them."
            )
        if not self.controllable:
            return "commands do not bring it to every pose: (A, B) of its linear model is not controllable."
        return ""

    def as_json(self) -> dict[str, Any]:
        """What `fulmar check robot --json` has of it."""
        return {
            "actuators": {
                "count": len(self.robot.actuators.names),
                "rank": self.effects.rank,
                "missing_axes": list(self.effects.missing_axes),
                "axes": list(self.wrenches.axes),
            },
            "wrench": self._wrench(),
            "zero_wrench_holdable": self.wrenches.holds_zero_with_all_on,
            "controllable": self.controllable,
            "least_time": self._least_time(),
        }

    def _wrench(self) -> dict[str, Any]:
        """Pure limits about the body's origin, three of each; null along axes in which the robot does not move.

        `force_n` and `torque_nm` are what can be made either way; `..._range` has both ways. With a common pressure
        line `without_shared_line` has what the actuators would give with supplies of their own. `force_n_about_com` is
        without a torque about the centre of mass instead, where that is not the origin.
        """
        found: dict[str, Any] = _sides(self.wrenches)
        found |= _ranges(self.wrenches) | {"shared_line": self.wrenches.shared}
        if self.wrenches.shared:
            alone = self.wrenches.without_shared_line()
            found["without_shared_line"] = _sides(alone) | _ranges(alone)
        if self.about_com and any(self.robot.body.com):
            about = self.wrenches.about(self.robot.body.com)
            found["force_n_about_com"] = _sides(about)["force_n"]
            found["force_range_n_about_com"] = _ranges(about)["force_range_n"]
        return found

    def _least_time(self) -> dict[str, list[float | None]]:
        """Least time from rest to rest for a metre along each axis and a quarter turn about each; null: it cannot [s].

        Full force one way and then the other, by the pure limits; of wheels with the top speed between. Lag, delay,
        water, products of inertia, the offset of the centre of mass and the rhythm of control are left aside.
        """
        limits = dict(zip(self.wrenches.axes, self.wrenches.limits, strict=True))
        times = [_rest_to_rest(*self._stretch(i, limits)) for i in range(len(AXES))]
        return {"metre_s": times[:3], "quarter_turn_s": times[3:]}

    def _stretch(self, axis: int, limits: dict[str, np.ndarray]) -> tuple[float, float, np.ndarray, float]:
        """Way along or about an axis, inertia, limits, and top speed."""
        body = self.robot.body
        way, inertia = (1.0, body.mass) if axis < 3 else (QUARTER_TURN, body.inertia[axis - 3])
        return way, inertia, limits.get(AXES[axis], np.zeros(2)), inf

    def lines(self) -> list[tuple[str, str]]:
        """What people read, as labels and texts."""
        result = self.as_json()
        actuators, wrench, least = result["actuators"], result["wrench"], result["least_time"]
        rank = f"{actuators['count']}, rank {actuators['rank']} of {len(actuators['axes'])}"
        if actuators["missing_axes"]:
            rank += f", without {', '.join(actuators['missing_axes'])}"
        shared = " (a shared pressure line)" if wrench["shared_line"] else ""
        lines = [
            ("actuators", rank),
            ("pure force", _xyz(wrench["force_range_n"], "N") + shared),
            ("pure torque", _xyz(wrench["torque_range_nm"], "N·m") + shared),
        ]
        if wrench["shared_line"]:
            alone = wrench["without_shared_line"]
            lines.append(
                (
                    "  each by itself",
                    f"{_xyz(alone['force_range_n'], 'N')}; {_xyz(alone['torque_range_nm'], 'N·m')}",
                )
            )
        if "force_n_about_com" in wrench:
            lines.append(("  no torque about CoM", _xyz(wrench["force_range_n_about_com"], "N")))
        return [
            *lines,
            ("zero wrench, all on", "holds" if result["zero_wrench_holdable"] else "does not hold"),
            ("controllable", "yes" if result["controllable"] else "no"),
            ("least time, 1 m", _xyz(least["metre_s"], "s")),
            ("least time, 90°", _xyz(least["quarter_turn_s"], "s")),
        ]


class WheelCheck(WrenchCheck):
    """Of a robot on wheels, which go sideways only by turning on the way, and no faster than they spin."""

    about_com = False

    @functools.cached_property
    def effects(self) -> WrenchSet:
        """By how much velocities change that the robot drives with."""
        model = self._linearised()
        in_body = model.b[3:].copy()
        # A heading turns the way ahead, which is no way to the side.
        in_body[1] -= 0.5 * self.robot.performance.speed * model.b[2]
        return WrenchSet(self.wrenches.axes, in_body, -np.ones(in_body.shape[1]), shared=False)

    def _driving(self) -> np.ndarray:
        """Command of wheels that keeps that speed."""
        command = np.array(self.robot.actuators.safe_command, dtype=float)
        command[0] = 0.5 * self.robot.performance.speed
        return command

    def _stretch(self, axis: int, limits: dict[str, np.ndarray]) -> tuple[float, float, np.ndarray, float]:
        """The same; what does not turn on the spot turns by driving along its tightest circle."""
        way, inertia, most, _ = super()._stretch(axis, limits)
        speed, turn = map(float, self.robot.actuators.scale)
        curvature = self.robot.actuators.largest_curvature
        if curvature is None:
            return way, inertia, most, speed if axis < 3 else turn
        if AXES[axis] == "torque_z":
            way, inertia, most = QUARTER_TURN / curvature, self.robot.body.mass, limits["force_x"]
        return way, inertia, most, speed


class SpaceCheck(WrenchCheck):
    """Of a body in space."""

    sideways = True

    def _model(self) -> tuple[np.ndarray, np.ndarray, int]:
        """Of a double integrator; of what its actuators carry about the hover, from where it goes aside by tilting."""
        if self.robot.kind.lifted:
            hover, scale = hover_command(self.robot), self.robot.actuators.scale
            model = linearise(self.robot, level_state(), hover, self.robot.timing.control_s)
            return model.a, model.b * scale, len(model.a)
        count = len(self.wrenches.axes)
        a = np.block([[np.zeros((count, count)), np.eye(count)], [np.zeros((count, 2 * count))]])
        b = np.vstack((0.0 * self.wrenches.columns, self.wrenches.columns / self.wrenches.scale[:, None]))
        return a, b, 2 * count


class SatelliteCheck(SpaceCheck):
    """Of a body that wheels turn, as fast as their momentum lets them."""

    def problems(self) -> Iterator[str]:
        """With what its wheels cannot hold; see `WrenchCheck.problems`."""
        yield from super().problems()
        wheels, body = self.robot.actuated_by(ReactionWheels), self.robot.body
        held = wheels.top_momentum * np.abs(wheels.axes).sum(axis=0)
        fastest = float((held / body.inertia[:3]).min())
        if self.robot.performance.yaw_rate > fastest > 0.0:
            yield (
                f"'performance.yaw_rate' = {self.robot.performance.yaw_rate:g} rad/s; its wheels hold the momentum of "
                f"{fastest:.4g} rad/s at most ('spin_inertia' · 'top_speed' = {wheels.top_momentum:.4g} N·m·s each). "
                "Correct whichever is wrong."
            )


class FreeFlyerCheck(SpaceCheck):
    """Of a body in space that actuators push, which controllers allocate wrenches to."""

    def problems(self) -> Iterator[str]:
        """Beside the warning; see `WrenchCheck.problems`."""
        try:
            check_allocation(cast(Pushing, self.robot.actuators), WRENCH)
        except ValueError as error:
            plausibility.warning("no controller but a policy can drive it: %s", error)
        yield from super().problems()


def _rest_to_rest(way: float, inertia: float, most: np.ndarray, fastest: float) -> float | None:
    """Time to go a way between two limits of force or torque, no faster than a speed; None: never [s]."""
    slower, faster = -float(most[0]) / inertia, float(most[1]) / inertia
    if min(faster, slower) <= 0.0:
        return None
    both = 1.0 / faster + 1.0 / slower  # way = ½ peak² · both
    peak = min(sqrt(2.0 * way / both), fastest)
    return float(peak * both + (way - 0.5 * peak**2 * both) / peak)


def _sides(wrenches: WrenchSet) -> dict[str, Any]:
    each = _three(wrenches, np.minimum(-wrenches.limits[:, 0], wrenches.limits[:, 1]))
    return {"force_n": each[:3], "torque_nm": each[3:]}


def _ranges(wrenches: WrenchSet) -> dict[str, Any]:
    low, high = _three(wrenches, wrenches.limits[:, 0]), _three(wrenches, wrenches.limits[:, 1])
    each = [None if a is None or b is None else [a, b] for a, b in zip(low, high, strict=True)]
    return {"force_range_n": each[:3], "torque_range_nm": each[3:]}


def _three(wrenches: WrenchSet, values: np.ndarray) -> list[float | None]:
    """Values of six axes; None for those in which the robot does not move."""
    known = {axis: float(value) + 0.0 for axis, value in zip(wrenches.axes, values, strict=True)}
    return [known.get(axis) for axis in AXES]


def _xyz(values: list[Any], unit: str) -> str:
    """Three values, or three pairs of both ways; axes in which the robot does not move are left out."""
    known = [
        f"{axis} {_either_way(value) if isinstance(value, list) else f'{value:.4g}'}"
        for axis, value in zip("xyz", values, strict=True)
        if value is not None
    ]
    return f"{', '.join(known)} {unit}" if known else "none"


def _either_way(limits: list[float]) -> str:
    low, high = limits
    if low == high == 0.0:
        return "0"
    same = abs(low + high) <= 1e-6 * max(-low, high, 1e-12)
    return f"±{high:.4g}" if same else f"{low:.4g} to {high:.4g}"
