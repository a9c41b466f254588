"""One draw of a scenario for each world of a body in space, and the push that follows from it.

Of a scenario's parts a wave, a tether and a slope belong to robots on the floor, and mean nothing here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.spatial_odometer import SENSED
from fulmar_core.states.arrays import array_namespace
from fulmar_core.states.attitude import (
    Tensor,
    Vector,
    cross,
    exponential,
    length,
    product,
    scaled,
    times,
    turn_back,
    uniform_direction,
)
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.rotation import Array
from fulmar_core.states.spatial import SpatialState
from fulmar_core.worlds.scenario import Scenario, around, check_delays, survivors
from fulmar_core.worlds.stuck import draw_changes
from fulmar_core.worlds.world import Drawn

DIPOLE = (
    0.0,
    0.5,
    -(0.75**0.5),
)  # axis of the magnetic field in the world: 30° out of the orbit's plane, our value


@dataclass(frozen=True, slots=True)
class SpatialWorld(Drawn):
    """Body, actuators, surroundings and sensors of episodes in space.

    Arrays have the shape (...,), vectors (3, ...), those of actuators (n, ...), those of measured columns (12, ...).
    """

    mass: Array  # [kg]
    inertia: Array  # (6, ...) xx, yy, zz, xy, xz, yz about the centre of mass [kg·m²]
    com: Array  # (3, ...) centre of mass in the body's frame [m]
    gain: Array  # (n, ...) factor on what each actuator does [-]
    alive: Array  # (n, ...) 1, or 0 for an actuator that stays closed or still [-]
    action_noise: Array  # largest error of an actuator, of full command, anew at each control step [-]
    action_delay: Array  # until a command acts, beyond the actuators' own [s]
    opening_delay: Array  # until a valve that was closed is open, beyond that; it closes without it [s]
    force: Array  # (3, ...) constant, in the world [N]
    torque: Array  # (3, ...) constant, in the body's frame, as of a leak [N·m]
    kick: Array  # (3, ...) force of a kick that lasts one control step, in the world [N]
    kick_period: Array  # from kick to kick [s]
    orbit_rate: Array  # mean motion of the orbit whose gravity gradient turns the body; 0: none [rad/s]
    solar_force: Array  # of the pressure of sunlight, along the world's −x [N]
    solar_arm: Array  # of its centre from that of mass, along the body's z [m]
    growth: Array  # (5, ...) of the inertia; see `grown`
    noise: Array  # factor on the sensors' noise [-]
    velocity_noise: Array  # largest error of each measured velocity, anew with each measurement [m/s]
    rate_noise: Array  # same for each turn rate [rad/s]
    sensor_bias: Array  # (12, ...) in the sensors' own standard deviations of bias [-]
    sensor_scale: Array  # (12, ...) in the sensors' own standard deviations of scale [-]
    sensor_delay: Array  # beyond the sensors' own [s]
    dropout: Array  # chance that a measurement is lost [-]
    stuck_part: Array  # number of the part that sticks within the episode; -1: none
    stuck_at: Array  # where it sticks, as a share of its largest value [-]
    stuck_from: Array  # from when on; out of reach where none sticks [s]
    supply_left: Array  # share of the supply that is left in the end; 1: it does not fall [-]
    supply_from: Array  # when it begins to fall [s]
    supply_over: Array  # how long it falls [s]
    tank_fill: Array  # pressure of the tank at the start, by that of the full one [-]

    def pushed(self, actuators: Any, applied: Array, gain: Array) -> tuple[Vector, Vector]:
        """Force and torque by the actuators; arguments and result as in `Pushing.spatial_wrench`."""
        found: tuple[Vector, Vector] = actuators.spatial_wrench(applied, gain)
        return found

    @property
    def effects(self) -> Array | None:
        """Wrench of each thruster that is fully open, shape (n, 6, ...) [N, N·m]; None: as the robot's file says."""
        return None


def push_in_world(world: SpatialWorld, time_s: Array, control_dt: float) -> Vector:
    """Force of the surroundings, held over a control step, along the world's axes [N].

    Args:
        world: What surrounds the body.
        time_s: Time in each episode, shape (...,) [s].
        control_dt: Length of a kick [s].
    """
    xp = array_namespace(world.mass)
    since = time_s - world.kick_period * xp.floor(time_s / world.kick_period)
    kicking = (since < control_dt) & (time_s >= world.kick_period)
    share = xp.where(kicking, xp.ones_like(world.mass), xp.zeros_like(world.mass))
    x, y, z = (world.force[i] + share * world.kick[i] for i in range(3))
    return x, y, z


def half_a_step_on(state: SpatialState, control_dt: float) -> SpatialState:
    """A state with the attitude that it has in the middle of a control step [s], where it goes on turning as it does.

    A torque that is held over the step is right there to second order; that of its beginning would lag by half a step.
    """
    turned = product(state.quat, exponential(scaled(0.5 * control_dt, state.rate)))
    return replace(state, **dict(zip(("qx", "qy", "qz", "qw"), turned, strict=True)))


def orbit_torque(state: SpatialState, world: SpatialWorld, time_s: Array) -> Vector:
    """Torque of the gravity gradient about the body's axes [N·m].

    It is 3 n² u × J u, with n = √(μ/r³) the mean motion, u the way from the planet and J the inertia; see
    `gravity_gradient_torque`.

    Args:
        state: Of the body, shapes (...,).
        world: Inertia and orbit.
        time_s: Time in each episode, shape (...,) [s].
    """
    tensor = tuple(world.inertia[i] for i in range(6))
    return gravity_gradient_torque(state, tensor, world.orbit_rate, zenith(world.orbit_rate, time_s))


def gravity_gradient_torque(
    state: SpatialState, tensor: Tensor, orbit_rate: Array | float, zenith: Vector | None = None
) -> Vector:
    """Torque of a planet's gravity, in the body's frame [N·m].

    3 n² e × J e with e the unit vector from the planet (Wertz, Spacecraft Attitude Determination and Control, 1978,
    eq. 17-34, circular orbit).

    Args:
        state: Of the centre of mass.
        tensor: Inertia of the body about the centre of mass [kg·m²].
        orbit_rate: n = √(μ/r³) [rad/s].
        zenith: e in the world; along its z by default.
    """
    zero = 0.0 * state.x
    e = turn_back(state.quat, zenith or (zero, zero, zero + 1.0))
    return scaled(3.0 * orbit_rate**2, cross(e, times(tensor, e)))


def zenith(orbit_rate: Array, time_s: Array) -> Vector:
    """Way from the planet, a unit vector in the world: along z when an episode begins, turning about the world's y.

    Args:
        orbit_rate: Mean motion of the orbit, shape (...,) [rad/s].
        time_s: Time in each episode, same shape [s].
    """
    xp, angle = array_namespace(orbit_rate), orbit_rate * time_s
    return xp.sin(angle), 0.0 * angle, xp.cos(angle)


def magnetic_field(orbit_rate: Array, time_s: Array) -> Vector:
    """Direction of the planet's magnetic field in the world, a unit vector; arguments as in `zenith`.

    That of a dipole whose axis is inclined to the orbit's plane (Wertz, Spacecraft Attitude Determination and Control,
    1978, app. H): 3 (m·u) u − m.
    """
    x, y, z = zenith(orbit_rate, time_s)
    m = DIPOLE
    along = 3.0 * (m[0] * x + m[1] * y + m[2] * z)
    field = along * x - m[0], along * y - m[1], along * z - m[2]
    return scaled(1.0 / length(field), field)


def solar_torque(state: SpatialState, world: SpatialWorld) -> Vector:
    """Torque of the pressure of sunlight about the body's axes [N·m]."""
    zero = 0.0 * world.solar_force
    force = turn_back(state.quat, (-world.solar_force, zero, zero))
    return cross((zero, zero, world.solar_arm), force)


def grown(world: SpatialWorld, time_s: Array) -> Array:
    """Factor on the inertia at a time in each episode, shape (...,) [-].

    1 + a step from a time on + a drift per second + a swing of an amplitude and a frequency (arXiv 2510.16738). The
    turn rate goes on through a step, as if what comes or goes turned with the body.
    """
    xp, (step, at_s, drift, swing, hz) = array_namespace(world.mass), world.growth
    stepped = xp.where(time_s >= at_s, step, xp.zeros_like(step))
    return 1.0 + stepped + drift * time_s + swing * xp.sin(2.0 * math.pi * hz * time_s)


def draw_spatial_world(robot: Robot, scenario: Scenario, draws: Draws) -> SpatialWorld:
    """Draw the worlds of some episodes, as `worlds.scenario.draw_world` does in the plane.

    The same numbers are drawn whatever the scenario. Directions are uniform over the sphere; the whole inertia tensor
    grows with the `yaw_inertia` of the robot's `uncertainty` over its own.

    Raises:
        ConfigError: The robot cannot have this scenario; see `check_delays`.
    """
    check_delays(robot, scenario)
    count, spans, sensing = len(robot.actuators.names), robot.uncertainty, scenario.sensing
    uncertain = 1.0 if scenario.body == "uncertain" else 0.0
    faults, push, kick = scenario.actuation, scenario.push, scenario.kick
    mass = around(robot.body.mass, spans.mass, uncertain, draws)
    izz = robot.body.inertia[2]
    growth = around(izz, spans.yaw_inertia, uncertain, draws) / izz
    offset = uncertain * draws.uniform(0.0, spans.center_of_mass)
    aside = _direction(draws)
    force = robot.performance.force * push.force * draws.uniform(push.least, 1.0)
    towards = _direction(draws)
    torque = robot.performance.torque * push.torque * draws.uniform(push.least, 1.0)
    about = _direction(draws)
    kick_size = robot.performance.force * kick.force * draws.uniform(0.0, 1.0)
    kick_period, kick_towards = draws.uniform(*kick.every_s), _direction(draws)
    low, high = faults.gain
    gain = low + (high - low) * draws.uniform(0.0, 1.0, count)
    lottery, chances = draws.uniform(0.0, 1.0, count), draws.uniform(0.0, 1.0, count)
    delay, noise = draws.uniform(faults.least_delay, 1.0), draws.uniform(faults.least_noise, 1.0)
    opening = draws.uniform(*faults.opening_delay_s)
    bias, scale = draws.normal(1.0, SENSED), draws.normal(1.0, SENSED)
    sensor_delay, dropout = draws.uniform(sensing.least_delay, 1.0), draws.uniform(0.0, 1.0)
    velocity_noise, rate_noise = (
        draws.uniform(*sensing.velocity_noise),
        draws.uniform(*sensing.yaw_rate_noise),
    )
    xp = array_namespace(mass)
    if robot.actuators.response.gain:
        gain = gain * xp.asarray(robot.actuators.response.gain, dtype=gain.dtype)
    own = 1.0 if scenario.sensor_noise else 0.0  # what the robot's YAML says of its sensors
    zero = xp.zeros_like(mass)
    return SpatialWorld(
        mass=mass,
        inertia=xp.stack([growth * entry for entry in robot.body.tensor]),
        com=xp.stack([nominal + offset * part for nominal, part in zip(robot.body.com, aside, strict=True)]),
        gain=gain.T,
        alive=survivors(lottery, chances, faults, ()),
        action_noise=zero + faults.noise * noise,
        action_delay=faults.delay_s * delay,
        opening_delay=(1.0 if robot.actuators.binary else 0.0) * opening,
        force=xp.stack([force * part for part in towards]),
        torque=xp.stack([torque * part for part in about]),
        kick=xp.stack([kick_size * part for part in kick_towards]),
        kick_period=kick_period,
        orbit_rate=zero + scenario.orbit_rate,
        solar_force=zero + scenario.solar.force,
        solar_arm=zero + scenario.solar.arm,
        growth=xp.stack([zero + number for number in scenario.inertia.numbers]),
        noise=zero + own * sensing.noise,
        velocity_noise=velocity_noise,
        rate_noise=rate_noise,
        sensor_bias=(own * sensing.bias * bias).T,
        sensor_scale=(own * sensing.bias * scale).T,
        sensor_delay=sensing.delay_s * sensor_delay,
        dropout=sensing.dropout * dropout,
        **draw_changes(robot, faults, draws),
    )


def _direction(draws: Draws) -> Vector:
    return uniform_direction(draws.uniform(0.0, 1.0), draws.uniform(0.0, 1.0))
