"""Check of a robot's file: what its actuators can do to its body, and what looks like a mistake."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from math import pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_core.config.errors import ConfigError, ImplausibleError
from fulmar_core.config.plausibility import logger as plausibility
from fulmar_core.controllers.allocation import check_allocation
from fulmar_core.dynamics.linear_model import linearise
from fulmar_core.robots.actuators.pushing import WRENCH, Pushing
from fulmar_core.robots.actuators.rolling import Rolling
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot, load_robot_file
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.spatial import SpatialState
from fulmar_evaluation.aircraft_check import AircraftCheck, check_aircraft, problems_of
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
# Between `performance` and what the actuators give: beyond the first a warning, beyond the second a mistake of unit.
USUAL_GAP, LARGEST_GAP = 2.0, 20.0


@dataclass(frozen=True)
class RobotCheck:
    """Result of one check.

    Attributes:
        name: Of the robot, or of the file that is refused.
        robot: None where the file has values that no robot has.
        wrenches: About the body's origin; None with the robot.
        rank: Of what commands do to the axes in which the robot moves.
        missing_axes: Of these axes, those that no command moves alone; `AXES` has the names.
        aircraft: Trims and modes of an aircraft, which has no wrenches; None for any other robot.
        controllable: Whether commands bring the robot to any pose.
        problems: One line each; a robot without any has passed.
        warnings: Unusual values, one line each.
    """

    name: str
    robot: Robot | None = None
    wrenches: WrenchSet | None = None
    rank: int = 0
    missing_axes: tuple[str, ...] = ()
    controllable: bool = False
    aircraft: AircraftCheck | None = None
    problems: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether there is no problem."""
        return not self.problems

    def as_json(self) -> dict[str, Any]:
        """Keys as of `fulmar check robot --json`; what is not known is null."""
        known: dict[str, Any] = dict.fromkeys(
            ("actuators", "wrench", "zero_wrench_holdable", "controllable", "least_time")
        )
        if self.robot is not None and self.wrenches is not None:
            known = {
                "actuators": {
                    "count": len(self.robot.actuators.names),
                    "rank": self.rank,
                    "missing_axes": list(self.missing_axes),
                    "axes": list(self.wrenches.axes),
                },
                "wrench": wrench_json(self.robot, self.wrenches),
                "zero_wrench_holdable": self.wrenches.holds_zero_with_all_on,
                "controllable": self.controllable,
                "least_time": least_time(self.robot, self.wrenches),
            }
        if self.aircraft is not None:
            known |= {
                "actuators": {
                    "count": len(self.aircraft.robot.actuators.names),
                    "rank": self.rank,
                    "missing_axes": list(self.missing_axes),
                    "axes": list(self.aircraft.authority),
                    "authority": self.aircraft.authority,
                },
                "zero_wrench_holdable": bool(self.aircraft.trims),
                "controllable": self.controllable,
            }
        return {
            "robot": self.name,
            **known,
            "trim": [] if self.aircraft is None else self.aircraft.as_json(),
            "passed": self.passed,
            "problems": list(self.problems),
            "warnings": list(self.warnings),
        }


def check_robot(
    name: str, *, speed: float | None = None, altitude: float | None = None, height: float | None = None
) -> RobotCheck:
    """Check a robot by its name, or a robot's file.

    Args:
        name: Of a robot, or a path that ends in .yaml or .yml.
        speed: Of an aircraft; as the rest as of `check_aircraft` [m/s].
        altitude: Same; None: 0 [m].
        height: Same [m].

    Raises:
        ConfigError: There is none of that name, or the file cannot be read.
    """
    path = Path(name)
    with _warnings() as warnings:
        try:
            robot = load_robot_file(path) if path.suffix in (".yaml", ".yml") else load_robot(name)
        except ImplausibleError as error:
            return RobotCheck(path.stem, problems=(str(error),), warnings=tuple(warnings))
        if robot.flies:
            flown = check_aircraft(robot, speed=speed, altitude=altitude or 0.0, height=height)
            axes = [axis for axis in flown.authority if axis not in flown.missing_axes]
            return RobotCheck(
                robot.name,
                robot,
                aircraft=flown,
                rank=len(axes),
                missing_axes=flown.missing_axes,
                controllable=bool(flown.trims) and not flown.missing_axes,
                problems=tuple(problems_of(flown)),
                warnings=tuple(warnings),
            )
        if (speed, altitude, height) != (None, None, None):
            raise ConfigError(
                f"--speed, --altitude and --height are for aircraft, and '{robot.name}' is none."
            )
        wrenches = wrench_set_of(robot)
        effects = _effects(robot, wrenches)
        controllable = _controllable(robot, wrenches)
        problems = list(_problems(robot, wrenches, effects, controllable))
        if robot.state_type is SpatialState and isinstance(robot.actuators, Pushing):
            try:
                check_allocation(robot.actuators, WRENCH)
            except ValueError as error:
                plausibility.warning("no controller but a policy can drive it: %s", error)
        for gap, line in _gaps(robot, wrenches):
            if gap <= LARGEST_GAP:
                plausibility.warning("%s", line)
            elif not problems:  # what is wrong with the layout comes first
                problems.append(line)
    return RobotCheck(
        robot.name,
        robot,
        wrenches,
        rank=effects.rank,
        missing_axes=effects.missing_axes,
        controllable=controllable,
        problems=tuple(problems),
        warnings=tuple(warnings),
    )


def wrench_json(robot: Robot, wrenches: WrenchSet) -> dict[str, Any]:
    """Pure limits about the body's origin, three of each; null along axes in which the robot does not move.

    `force_n` and `torque_nm` are what can be made either way; `..._range` has both ways. With a common pressure line
    `without_shared_line` has what the actuators would give with supplies of their own. `force_n_about_com` is without a
    torque about the centre of mass instead, where that is not the origin.
    """
    found: dict[str, Any] = _sides(wrenches)
    found |= _ranges(wrenches) | {"shared_line": wrenches.shared}
    if wrenches.shared:
        alone = wrenches.without_shared_line()
        found["without_shared_line"] = _sides(alone) | _ranges(alone)
    if any(robot.body.com) and not isinstance(robot.actuators, Rolling):
        about = wrenches.about(robot.body.com)
        found["force_n_about_com"] = _sides(about)["force_n"]
        found["force_range_n_about_com"] = _ranges(about)["force_range_n"]
    return found


def least_time(robot: Robot, wrenches: WrenchSet) -> dict[str, list[float | None]]:
    """Least time from rest to rest for a metre along each axis and a quarter turn about each; null: it cannot [s].

    Full force one way and then the other, by the pure limits; of wheels with the top speed between. Lag, delay, water,
    products of inertia, the offset of the centre of mass and the rhythm of control are left aside.
    """
    body, wheels = robot.body, robot.actuators if isinstance(robot.actuators, Rolling) else None
    limits = dict(zip(wrenches.axes, wrenches.limits, strict=True))
    times: list[float | None] = []
    for i, axis in enumerate(AXES):
        low, high = limits.get(axis, (0.0, 0.0))
        way, inertia = (1.0, body.mass) if i < 3 else (QUARTER_TURN, body.inertia[i - 3])
        fastest = np.inf
        if wheels is not None:
            curvature = wheels.largest_curvature
            if axis == "torque_z" and curvature is not None:  # it turns by driving along its tightest circle
                way, inertia, (low, high) = QUARTER_TURN / curvature, body.mass, limits["force_x"]
            fastest = float(wheels.scale[0]) if i < 3 or curvature is not None else float(wheels.scale[1])
        times.append(_rest_to_rest(way, high / inertia, -low / inertia, fastest))
    return {"metre_s": times[:3], "quarter_turn_s": times[3:]}


def _rest_to_rest(way: float, faster: float, slower: float, fastest: float) -> float | None:
    """Time to go a way with an acceleration and a deceleration, no faster than a speed; None: never [s]."""
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


def _effects(robot: Robot, wrenches: WrenchSet) -> WrenchSet:
    """What commands do to each axis: of wheels, by how much velocities change that the robot drives with."""
    if not isinstance(robot.actuators, Rolling):
        return wrenches
    start = _ahead(robot)
    model = linearise(robot, start, _driving(robot), robot.timing.control_s)
    in_body = model.b[3:].copy()
    in_body[1] -= float(start.vx) * model.b[2]  # a heading turns the way ahead, which is no way to the side
    return WrenchSet(wrenches.axes, in_body, -np.ones(in_body.shape[1]), shared=False)


def _controllable(robot: Robot, wrenches: WrenchSet) -> bool:
    """Whether commands bring the robot to any pose.

    Of (A, B) the controllability matrix has full rank: in space those of a double integrator; in the plane those of the
    core's own model while driving ahead, for the pose, since wheels and boats go sideways only by turning on the way.
    One-way actuators need a command with all of them on that leaves no wrench, too (Brammer, "Controllability in linear
    autonomous systems with positive controllers", SIAM J. Control 10, 1972).
    """
    if not wrenches.holds_zero_with_all_on:
        return False
    if robot.state_type is SpatialState:
        count = len(wrenches.axes)
        a = np.block([[np.zeros((count, count)), np.eye(count)], [np.zeros((count, 2 * count))]])
        b = np.vstack((0.0 * wrenches.columns, wrenches.columns / wrenches.scale[:, None]))
        outputs = 2 * count
    else:
        model = linearise(robot, _ahead(robot), _driving(robot), robot.timing.control_s)
        a, b, outputs = model.a, model.b * robot.actuators.scale, 3
    reached = [b]
    for _ in range(len(a) - 1):
        reached.append(a @ reached[-1])
    rows = np.hstack(reached)[:outputs]
    sizes = np.abs(rows).max(axis=1, keepdims=True)
    if not sizes.min() > LEAST_EFFECT * sizes.max():
        return False
    return int(np.linalg.matrix_rank(rows / sizes, tol=LEAST_EFFECT)) == outputs


def _ahead(robot: Robot) -> PlanarState:
    """Driving ahead at half of the speed that tasks ask for."""
    zero = np.asarray(0.0)
    return PlanarState(zero, zero, zero, np.asarray(0.5 * robot.performance.speed), zero, zero)


def _driving(robot: Robot) -> np.ndarray:
    """Command of wheels that keeps that speed; propellers at a half, out of the dead zone; one-way actuators coast."""
    command = np.array(robot.actuators.safe_command, dtype=float)
    if isinstance(robot.actuators, Rolling):
        command[0] = 0.5 * robot.performance.speed
    elif not robot.actuators.one_way:
        command = 0.5 * robot.actuators.scale
    return command


def _problems(robot: Robot, wrenches: WrenchSet, effects: WrenchSet, controllable: bool) -> Iterator[str]:
    """One line for each thing that is wrong; what follows from another one is left out."""
    count = len(robot.actuators.names)
    sideways = robot.state_type is SpatialState or robot.performance.lateral_speed > 0.0
    missing = [axis for axis in effects.missing_axes if sideways or axis != "force_y"]
    if missing:
        yield (
            f"its {count} actuators have rank {effects.rank} of {len(effects.axes)}: no command makes a "
            f"{' or a '.join(PLAIN[axis] for axis in missing)} alone. Place or aim some of them otherwise."
        )
    elif not wrenches.holds_zero_with_all_on:
        ways = [
            f"{sign} {PLAIN[axis]}"
            for axis, limits in zip(wrenches.axes, wrenches.limits, strict=True)
            for sign, limit in zip(("negative", "positive"), limits, strict=True)
            if limit == 0.0
        ]
        yield (
            f"its {count} actuators push one way, and with all of them on a wrench remains: there is no "
            f"{', no '.join(ways) or 'wrench in some direction'}. Add one that pushes against them."
        )
    elif not controllable:
        yield "commands do not bring it to every pose: (A, B) of its linear model is not controllable."


def _gaps(robot: Robot, wrenches: WrenchSet) -> Iterator[tuple[float, str]]:
    """How many times numbers of `performance` differ from what the actuators give, with a line."""
    angles = np.arange(32) * 2.0 * np.pi / 32
    forces = [i for i, axis in enumerate(wrenches.axes) if axis in ("force_x", "force_y")]
    given = []
    if forces:
        directions = np.zeros((len(angles), len(wrenches.axes)))
        directions[:, forces] = np.stack((np.cos(angles), np.sin(angles)), axis=-1) * wrenches.scale[0]
        free = [i for i in range(len(wrenches.axes)) if i not in forces]
        most = max(wrenches.most_along(way, free=free) for way in directions) * wrenches.scale[0]
        given.append(("force", "N", robot.performance.force, float(most)))
    yaw = wrenches.axes.index("torque_z")
    if wrenches.columns[yaw].any():
        way = np.zeros(len(wrenches.axes))
        way[yaw] = wrenches.scale[yaw]
        others = [i for i in range(len(wrenches.axes)) if i != yaw]
        most = max(wrenches.most_along(sign * way, free=others) for sign in (1.0, -1.0)) * wrenches.scale[yaw]
        given.append(("torque", "N·m", robot.performance.torque, float(most)))
    for name, unit, wanted, found in given:
        if found < 1e-9:  # none at all: that is a matter of rank
            continue
        gap = max(wanted / found, found / wanted)
        if gap > USUAL_GAP:
            yield (
                gap,
                f"'performance.{name}' = {wanted:g} {unit}, and its actuators give {found:.4g} {unit} at most in the "
                "plane of x and y. Correct whichever is wrong; units are N and N·m.",
            )


@contextmanager
def _warnings() -> Iterator[list[str]]:
    """Warnings about unusual values that come up meanwhile."""
    lines: list[str] = []

    class Collector(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            lines.append(record.getMessage())

    handler = Collector(logging.WARNING)
    plausibility.addHandler(handler)
    try:
        yield lines
    finally:
        plausibility.removeHandler(handler)
