"""Steady level flight: the attitude, the deflections and the throttle that leave no acceleration; how flights begin."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.dynamics.flight_dynamics import FlightDynamics, FlightWorld
from fulmar_core.dynamics.level_flight import NUDGE, LevelFlight
from fulmar_core.dynamics.rigid_body import inertia_of, turn_acceleration
from fulmar_core.robots.robot import Robot
from fulmar_core.states.attitude import conjugate, euler_of, from_euler, plus, product, turn
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.spatial import SpatialState
from fulmar_core.worlds.parts import Air
from fulmar_core.worlds.scenario import Scenario

FREE_AIR = 100.0  # height above ground without effect that stands for free air [m]
RESIDUAL = 1e-6  # largest acceleration of a trim [m/s², rad/s²]


@dataclass(frozen=True)
class Trim:
    """A steady state of level flight along the world's x axis."""

    speed: float  # through the air [m/s]
    height: float | None  # of the centre of mass above the ground; None: free air [m]
    altitude: float  # of the craft above mean sea level in free air, else that of the ground [m]
    alpha: float  # angle of attack [rad]
    state: SpatialState  # shapes ()
    command: np.ndarray  # shape (n,), cannot be written: deflections [rad] and throttles
    thrust: float  # of all propellers [N]

    @property
    def ground(self) -> float:
        """Altitude of z = 0 above mean sea level [m]."""
        return self.altitude if self.height is not None else self.altitude - FREE_AIR

    @property
    def elevator(self) -> float:
        """Deflection [rad]."""
        return float(self.command[0])

    @property
    def throttle(self) -> float:
        """Of each motor [-]."""
        return float(self.command[-1])


def still_air(robot: Robot, count: int, altitude: float = 0.0) -> FlightWorld:
    """Worlds with nominal bodies in still air over ground at an altitude above mean sea level [m]."""
    scenario = Scenario("still", sensor_noise=False, body="nominal", air=Air(altitude=altitude))
    return FlightDynamics(robot).draw_world(scenario, Draws(0, np.zeros(count), np.zeros(count)))


def free_air(robot: Robot) -> Robot:
    """The same aircraft without ground effect, as high up."""
    return replace(robot, airframe=replace(robot.wings, ground_effect=None))


@functools.lru_cache(maxsize=64)  # laws, observers and tasks ask for the same ones
def find_trim(robot: Robot, speed: float, height: float | None = None, altitude: float = 0.0) -> Trim:
    """Find the trim at a speed.

    Args:
        robot: An aircraft.
        speed: Through the air, > 0 [m/s].
        height: Of the centre of mass above the ground, > 0, which switches ground effect on; None: free air [m].
        altitude: Of the craft in free air, else of the ground, above mean sea level [m].

    Raises:
        ConfigError: The robot is no aircraft, a number is impossible, or there is no trim within the limits.
    """
    if robot.airframe is None:
        raise ConfigError(
            f"'{robot.name}' is no aircraft, so it has no trim. `fulmar list robots` shows others."
        )
    if not 0.0 < speed < math.inf:
        raise ConfigError(f"speed = {speed:g} m/s must be greater than 0.")
    if height is not None and not 0.0 < height < math.inf:
        raise ConfigError(f"height = {height:g} m must be greater than 0: the craft flies above the ground.")
    if not -500.0 <= altitude <= 11_000.0:
        raise ConfigError(f"altitude = {altitude:g} m must lie between -500 and 11000, in the troposphere.")
    from scipy.optimize import least_squares  # slow to import, and only aircraft need it

    craft = robot if height is not None else free_air(robot)
    problem = _Problem(
        craft, speed, height or FREE_AIR, altitude if height is not None else altitude - FREE_AIR
    )
    found = least_squares(
        problem.residual, problem.start, bounds=problem.bounds, xtol=1e-14, ftol=1e-14, gtol=1e-14
    )
    worst = float(np.abs(problem.residual(found.x)).max())
    if worst > RESIDUAL:
        advice = (
            f"Try a speed near {robot.airframe.speed:g} m/s."
            if speed != robot.airframe.speed
            else "It is 'airframe.speed': look at that, at thrust, mass and area, and at the terms of CL, CD and Cm."
        )
        raise ConfigError(
            f"'{robot.name}' has no trim at {speed:g} m/s and {'in free air' if height is None else f'{height:g} m'}: "
            f"{problem.shortfall(found.x)}. {advice}"
        )
    return problem.trim(found.x, height, altitude)


def nominal_flight(robot: Robot, height: np.ndarray) -> LevelFlight:
    """Level flight of the robot as its file has it, over ground at sea level, at heights (n,) [m]."""
    return LevelFlight(robot, still_air(robot, len(height)), height)


def level_command(robot: Robot, state: SpatialState) -> np.ndarray:
    """What actuators do in level flight at the heights of states, shapes (n,): shape (n, m)."""
    return nominal_flight(robot, np.asarray(state.z, dtype=float)).command


def in_trim(robot: Robot, start: SpatialState, world: FlightWorld) -> tuple[SpatialState, np.ndarray]:
    """Starts that were drawn for still air at sea level, in the air of their worlds, and what actuators do there.

    Wind carries a craft along: it flies through the air as it was drawn, and over the ground with the wind besides.

    Args:
        robot: An aircraft.
        start: Velocities through the air, shapes (n,).
        world: Of each.

    Returns:
        States, whose angle of attack is that of level flight where the drawn one was, and commands, shape (n, m).
    """
    own, usual = LevelFlight(robot, world, start.z), nominal_flight(robot, start.z)
    columns = dict(
        zip(
            ("qx", "qy", "qz", "qw"),
            product(start.quat, product(conjugate(usual.quat), own.quat)),
            strict=True,
        )
    )
    speeds = plus(start.velocity, (world.wind[0], world.wind[1], world.wind[2]))
    return replace(start, **columns, **dict(zip(("vx", "vy", "vz"), speeds, strict=True))), own.command


def flying_at(robot: Robot, pose: np.ndarray) -> SpatialState:
    """An aircraft in level flight through still air at a pose of 7 numbers, shapes ().

    With wings and nose level it has the attitude of its trim along the heading. Another attitude is as it is written,
    and the air meets it as in that trim.
    """
    written = SpatialState.resting(np.asarray(pose, dtype=float))
    roll, pitch, yaw = euler_of(written.quat)
    zero = 0.0 * yaw
    flight = nominal_flight(robot, np.atleast_1d(written.z))
    x, y, z, w = flight.quat
    level = x[0], y[0], z[0], w[0]
    upset = from_euler(zero, zero, yaw)
    if max(abs(float(roll)), abs(float(pitch))) > NUDGE:
        upset = product(written.quat, conjugate(level))
    quat, velocity = product(upset, level), turn(upset, (zero + robot.wings.speed, zero, zero))
    return SpatialState(*written.position, *quat, *velocity, *written.rate).mapped(np.asarray)


class _Problem:
    """Accelerations of a craft as a function of α, roll, sideslip, deflections and throttle, all in one vector."""

    def __init__(self, robot: Robot, speed: float, height: float, ground: float) -> None:
        self._robot, self._speed, self._height = robot, speed, height
        self._dynamics = FlightDynamics(robot, turbulent=False)
        self._world = still_air(robot, 1, ground)
        self._inertia = inertia_of(tuple(self._world.inertia))
        actuators = robot.actuators
        self._surfaces = actuators.positions
        # Without a rudder the sideslip is free, with one it is 0.
        self._free_beta = "rudder" not in actuators.names
        lost = math.radians(robot.wings.lost_deg)
        tilt = [0.5] * (2 if self._free_beta else 1)
        most = list(actuators.scale[: self._surfaces])
        self.bounds = (
            np.array([-lost, *(-t for t in tilt), *(-m for m in most), 0.0]),
            np.array([lost, *tilt, *most, 1.0]),
        )
        self.start = np.array([0.03, *(0.0 for _ in tilt), *(0.0 for _ in most), 0.4])

    def _split(self, x: np.ndarray) -> tuple[float, float, float, np.ndarray]:
        alpha, roll = float(x[0]), float(x[1])
        beta = float(x[2]) if self._free_beta else 0.0
        rest = x[3:] if self._free_beta else x[2:]
        throttles = np.full(len(self._robot.actuators.names) - self._surfaces, rest[-1])
        return alpha, roll, beta, np.concatenate((rest[:-1], throttles))

    def state(self, x: np.ndarray) -> SpatialState:
        """Level flight along the world's x, shapes (1,)."""
        alpha, roll, beta, _ = self._split(x)
        # The path is level whatever the roll: attitude = heading to the wind, pitch for α, then roll about the path.
        path = from_euler(np.array([roll]), np.array([0.0]), np.array([0.0]))
        ca, sa, cb, sb = math.cos(alpha), math.sin(alpha), math.cos(beta), math.sin(beta)
        # Velocity in the body: ahead, left, up.
        inside = np.array([ca * cb, -sb, -sa * cb])
        x, y, z, w = _between(inside, np.array([1.0, 0.0, 0.0]))[:, None]
        quat = product(path, (x, y, z, w))
        zero = np.zeros(1)
        return SpatialState(
            zero, zero, zero + self._height, *quat, zero + self._speed, zero, zero, zero, zero, zero
        )

    def residual(self, x: np.ndarray) -> np.ndarray:
        """Linear [m/s²] and turn accelerations [rad/s²], shape (6,)."""
        state, command = self.state(x), self._split(x)[3]
        force, torque = self._dynamics.wrench(state, command[:, None], None, self._world, self._inertia)
        pull = turn(state.quat, force)
        turned = turn_acceleration(state.rate, torque, self._inertia)
        mass = float(self._world.mass[0])
        found = [*(float(part[0]) / mass for part in pull), *(float(part[0]) for part in turned)]
        found[2] -= GRAVITY
        return np.array(found)

    def shortfall(self, x: np.ndarray) -> str:
        """What is left over, in words."""
        left = self.residual(x)
        at_limit = [
            name
            for name, value, low, high in zip(
                self._robot.actuators.names,
                self._split(x)[3],
                self._robot.actuators.lowest,
                self._robot.actuators.scale,
                strict=True,
            )
            if value <= low + 1e-6 * (high - low) or value >= high - 1e-6 * (high - low)
        ]
        alpha = math.degrees(float(x[0]))
        limits = f", with {', '.join(at_limit)} at a limit" if at_limit else ""
        return (
            f"at best {abs(left[0]):.2g} m/s² ahead, {abs(left[2]):.2g} m/s² up and {abs(left[4]):.2g} rad/s² in pitch "
            f"remain, at an angle of attack of {alpha:.1f}°{limits}"
        )

    def trim(self, x: np.ndarray, height: float | None, altitude: float) -> Trim:
        """The solution."""
        alpha, _, _, command = self._split(x)
        command.setflags(write=False)
        state = self.state(x)
        thrust, _ = self._dynamics.propellers(
            command[self._surfaces :, None],
            np.array([self._speed]),
            self._dynamics.density(state, self._world),
        )
        return Trim(
            self._speed,
            height,
            altitude,
            alpha,
            state.mapped(lambda part: part[0]),
            command,
            float(thrust[0][0]),
        )


def _between(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Quaternion x, y, z, w of the shortest rotation from one unit vector to another, shape (4,)."""
    quat = np.array([*np.cross(start, end), 1.0 + float(start @ end)])
    return np.asarray(quat / np.linalg.norm(quat))
