"""How aircraft move in a batch: air and propellers push a rigid body, by Runge and Kutta's method of fourth order."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.dynamics.actuators.actuation import ActuationState
from fulmar_core.dynamics.actuators.flight_actuation import FlightActuation
from fulmar_core.dynamics.batch_dynamics import Push, SpatialDynamics, Steps
from fulmar_core.dynamics.rigid_body import Inertia, inertia_of, turn_acceleration
from fulmar_core.robots.actuators.control_surfaces import ControlSurfaces
from fulmar_core.robots.airframe.airframe import Flow, alpha_rate, flow_past
from fulmar_core.robots.airframe.atmosphere import air_density
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.air_data import NAME as AIR
from fulmar_core.robots.sensors.air_data import AirData, AirDataSpec
from fulmar_core.states.arrays import array_namespace, is_number
from fulmar_core.states.attitude import (
    Vector,
    cross,
    dot,
    minus,
    normalised,
    plus,
    product,
    scaled,
    turn,
    turn_back,
)
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.rotation import Array
from fulmar_core.states.spatial import SpatialState
from fulmar_core.worlds.scenario import Scenario
from fulmar_core.worlds.spatial_world import SpatialWorld, draw_spatial_world, push_in_world
from fulmar_core.worlds.turbulence import Gust

FASTEST_TUMBLE = 20.0  # of an aircraft [rad/s]
KEYS = 2**24  # gusts hang on two whole numbers below this, which float32 holds exactly


@dataclass(frozen=True, slots=True)
class FlightWorld(SpatialWorld):
    """As `SpatialWorld`, with the air."""

    wind: Array  # (3, ...) how the air moves, in the world [m/s]
    turbulence: Array  # wind at 20 ft that turbulence comes from; 0: none [m/s]
    gust_keys: Array  # (2, ...) whole numbers that the gusts hang on
    altitude: Array  # of the ground or the water above mean sea level [m]


class FlightDynamics(SpatialDynamics):
    """Aircraft in moving air, over ground or water at z = 0 of the world."""

    def __init__(self, robot: Robot, *, turbulent: bool = True) -> None:
        """Prepare; `turbulent`: some world may have turbulence."""
        super().__init__(robot, orbits=False)
        self._craft, self.airframe = robot.actuated_by(ControlSurfaces), robot.wings
        self._turbulent = turbulent

    def draw_world(self, scenario: Scenario, draws: Draws) -> FlightWorld:
        """See `Dynamics.draw_world`."""
        body = draw_spatial_world(self.robot, scenario, draws)
        xp, air = array_namespace(body.mass), scenario.air
        speed, bearing = draws.uniform(*air.wind), draws.uniform(-xp.pi, xp.pi)
        keys = xp.floor(draws.uniform(0.0, KEYS, 2)).T
        zero = xp.zeros_like(body.mass)
        wind = xp.stack((speed * xp.cos(bearing), speed * xp.sin(bearing), zero))
        if air.least_turbulence < 1.0:
            turbulence = draws.uniform(air.least_turbulence * air.turbulence, air.turbulence)
        else:
            turbulence = zero + air.turbulence
        around = {"wind": wind, "turbulence": turbulence, "gust_keys": keys}
        own = dict(zip(SpatialWorld.names(), body.parts(), strict=True))
        return FlightWorld(**own, **around, altitude=zero + air.altitude)

    def outside(
        self, state: SpatialState, world: SpatialWorld, time_s: Array, control_dt: float
    ) -> tuple[Array, ...]:
        """Force of kicks along the world's axes [N]; see `Dynamics.outside`."""
        return push_in_world(world, time_s, control_dt)

    def push_is_constant(self, world: SpatialWorld) -> bool:
        """See `Dynamics.push_is_constant`."""
        return not world.kick.any()

    def move(
        self, state: SpatialState, actuation: ActuationState, world: SpatialWorld, outside: Push, steps: Steps
    ) -> SpatialState:
        """See `Dynamics.move`; a file's centre of mass is the body's origin.

        State and world of one craft without turbulence may be plain numbers.
        """
        assert isinstance(world, FlightWorld)
        dt = self.robot.timing.physics_dt
        inertia = inertia_of(tuple(world.inertia)[: 6 if self._full else 3])
        push: Vector = (outside[0], outside[1], outside[2])
        for _ in range(steps.count):
            applied = actuation.advance(dt, latest_s=steps.latest_s) * actuation.gain
            if is_number(state.x):
                applied = applied[:, 0].tolist()
            gust = self.gust(state, actuation, world, dt)
            state = self.where_it_flies(state, self._step(state, applied, gust, world, inertia, push, dt))
        return state

    def where_it_flies(self, before: SpatialState, after: SpatialState) -> SpatialState:
        """The state after a step, or, of a craft that flies no longer, where it was, at rest."""
        xp, flying = array_namespace(after.x), self.is_aloft(after)
        if is_number(after.x):
            return after if flying else before.stopped()
        stopped = before.stopped()
        columns = zip(after.columns(), stopped.columns(), strict=True)
        return SpatialState(*(xp.where(flying, new, old) for new, old in columns))

    def is_aloft(self, state: SpatialState) -> Array:
        """Whether the hull is above the ground, and tumbles no faster than models of the air hold for, shape (...,)."""
        return (state.z + self.robot.hull_span[0] > 0.0) & (dot(state.rate, state.rate) < FASTEST_TUMBLE**2)

    def gust(
        self, state: SpatialState, actuation: ActuationState, world: FlightWorld, dt: float
    ) -> Gust | None:
        """The gust of a time step, which the actuation remembers; None where no world has turbulence."""
        assert isinstance(actuation, FlightActuation)
        if not self._turbulent:
            return None
        velocity = minus(state.velocity, (world.wind[0], world.wind[1], world.wind[2]))
        speed = array_namespace(state.x).sqrt(sum(part * part for part in velocity))
        return actuation.blow(
            world.gust_keys, world.turbulence, airspeed=speed, height=state.z, span=self.airframe.span, dt=dt
        )

    def wrench(
        self, state: SpatialState, applied: Array, gust: Gust | None, world: FlightWorld, inertia: Inertia
    ) -> tuple[Vector, Vector]:
        """Force [N] and torque [N·m] of air and propellers about the centre of mass, in the body's frame.

        Args:
            state: Of the centre of mass, shapes (...,).
            applied: Deflections [rad] and thrust levels, shape (n, ...).
            gust: Of the air; None: none.
            world: Body and air.
            inertia: Of the body.
        """
        craft, velocity = self._craft, self.through_the_air(state, gust, world)
        rate = flipped(state.rate)
        turning = rate if gust is None else minus(rate, gust[3:])
        air = flow_past(velocity, turning, surfaces_of(craft, applied), self.airframe)
        density = self.density(state, world)
        coefficients = self.airframe.coefficients(air, state.z)
        thrust, torque = self.propellers(applied[craft.positions :], air.speed, density)
        if self.airframe.slow_terms:
            force, _ = self.airframe.loads(coefficients, air, density)
            self._add_slow_terms(
                coefficients, air, density, velocity, rate, state, plus(force, flipped(thrust)), world
            )
        force, moment = self.airframe.loads(coefficients, air, density)
        return plus(flipped(force), thrust), plus(flipped(moment), torque)

    @staticmethod
    def through_the_air(state: SpatialState, gust: Gust | None, world: FlightWorld) -> Vector:
        """Velocity of an aircraft relative to the air, x ahead, y right, z down [m/s]."""
        through = minus(state.velocity, (world.wind[0], world.wind[1], world.wind[2]))
        velocity = flipped(turn_back(state.quat, through))
        return velocity if gust is None else minus(velocity, gust[:3])

    def truths(
        self, state: SpatialState, actuation: ActuationState, world: SpatialWorld, gust: Gust | None = None
    ) -> dict[str, Any]:
        """With what air probes measure; see `Dynamics.truths`."""
        assert isinstance(world, FlightWorld)
        return {AIR: self.air_data(state, gust, world), **actuation.truths()}

    def air_data(self, state: SpatialState, gust: Gust | None, world: FlightWorld) -> AirData:
        """What air probes without errors measure, of a batch of one or in plain numbers."""
        parts = *self.through_the_air(state, gust, world), state.z
        u, v, w, height = (part if is_number(part) else float(part[0]) for part in parts)
        speed = math.sqrt(u * u + v * v + w * w)
        side = math.asin(v / speed) if speed else 0.0
        return AirData(AirDataSpec.NAMES, np.array([speed, math.atan2(w, u), side, height]))

    @staticmethod
    def density(state: SpatialState, world: FlightWorld) -> Array:
        """Of the air where an aircraft is, shape (...,) [kg/m³]."""
        return air_density(world.altitude + state.z)

    def propellers(self, levels: Array, speed: Array, density: Array) -> tuple[Vector, Vector]:
        """Thrust and torque in the body's frame; the air turns a propeller's body against its rotation."""
        zero = 0.0 * speed
        total, torque = zero, (zero, zero, zero)
        for level, motor in zip(levels, self._craft.motors, strict=True):
            push = motor.engine.thrust_at(level, speed, density)
            _, left, up = motor.position
            reaction = -float(motor.rotation) * motor.engine.torque_at(level)
            total, torque = total + push, plus(torque, (reaction, up * push, -left * push))
        return (total, zero, zero), torque

    def _add_slow_terms(
        self,
        coefficients: dict[str, Array],
        air: Flow,
        density: Array,
        velocity: Vector,
        rate: Vector,
        state: SpatialState,
        force: Vector,
        world: FlightWorld,
    ) -> None:
        """Add what hangs on the change of the angle of attack, which follows from the forces without it."""
        frame, zero = self.airframe, 0.0 * state.x
        weight = flipped(turn_back(state.quat, (zero, zero, zero - GRAVITY)))
        falling = minus(plus(scaled(1.0 / world.mass, force), weight), cross(rate, velocity))
        hat = (0.5 * frame.chord) * alpha_rate(velocity, falling) / air.speed
        lift = frame.slow_terms.get("CL", 0.0)
        if lift:
            hat = hat / (1.0 + 0.25 * lift * frame.chord * frame.area * density / world.mass)
        for name, number in frame.slow_terms.items():
            coefficients[name] = coefficients[name] + number * hat

    def _step(
        self,
        state: SpatialState,
        applied: Array,
        gust: Gust | None,
        world: FlightWorld,
        inertia: Inertia,
        push: Vector,
        dt: float,
    ) -> SpatialState:
        def slopes(now: SpatialState) -> tuple[Array, ...]:
            force, torque = self.wrench(now, applied, gust, world, inertia)
            steady: Vector = (world.torque[0], world.torque[1], world.torque[2])
            x, y, z = scaled(1.0 / world.mass, plus(turn(now.quat, force), push))
            ax, ay, az = turn_acceleration(now.rate, plus(torque, steady), inertia)
            zero = 0.0 * now.wx
            qx, qy, qz, qw = product(now.quat, (0.5 * now.wx, 0.5 * now.wy, 0.5 * now.wz, zero))
            return (*now.velocity, qx, qy, qz, qw, x, y, z - GRAVITY, ax, ay, az)

        k1 = slopes(state)
        k2 = slopes(_along(state, 0.5 * dt, k1))
        k3 = slopes(_along(state, 0.5 * dt, k2))
        k4 = slopes(_along(state, dt, k3))
        sixth = dt / 6.0
        columns = [
            value + sixth * (a + 2.0 * (b + c) + d)
            for value, a, b, c, d in zip(state.columns(), k1, k2, k3, k4, strict=True)
        ]
        quat = normalised((columns[3], columns[4], columns[5], columns[6]))
        columns[3:7] = quat
        return SpatialState(*columns)


def _along(state: SpatialState, dt: float, slopes: tuple[Array, ...]) -> SpatialState:
    return SpatialState(*(value + dt * slope for value, slope in zip(state.columns(), slopes, strict=True)))


def flipped(vector: Vector) -> Vector:
    """A vector of flight mechanics (x ahead, y right, z down) in the body's frame (y left, z up), or back."""
    return vector[0], -vector[1], -vector[2]


def surfaces_of(craft: ControlSurfaces, applied: Array) -> Mapping[str, Array]:
    """Deflections by the names of the surfaces, of what is applied, shape (n, ...) [rad]."""
    return {surface.name: applied[i] for i, surface in enumerate(craft.surfaces)}
