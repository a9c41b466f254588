"""Satellites under excitation, and what a gyroscope and tachometers report of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fulmar_core.dynamics.gyrostat import Flywheels, gyrostat_step
from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.attitude import Vector, cross, plus, turn_back
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks.torque_profiles import gain_of, profile_of
from fulmar_core.worlds.spatial_world import gravity_gradient_torque

SAMPLE_S, PHYSICS_S, LASTS_S = 0.1, 0.05, 300.0
ORBIT_RATE, SOLAR_FORCE, SOLAR_ARM = 1e-3, 1e-6, 0.01  # rad/s, N, m: arXiv 2510.16738
WHEEL_STD = 0.01  # of a measured speed [rad/s]
LEVELS = {
    "fine": (1e-6, 1e-7),
    "low_cost": (1e-4, 1e-5),
}  # gyroscope: noise [rad/s], walk of the bias [rad/s/√s]

GROWTHS: dict[str, Callable[[float], float]] = {
    "static": lambda t: 1.0,
    "step": lambda t: 1.1 if t >= 0.5 * LASTS_S else 1.0,
    "drift": lambda t: 1.0 + 0.05 * t / LASTS_S,
    "periodic": lambda t: 1.0 + 0.03 * np.sin(2.0 * np.pi * 0.02 * t),
}


@dataclass(frozen=True)
class Run:
    """What is true of one satellite under one profile, sampled evenly."""

    times: np.ndarray  # shape (k,) [s]
    rate: np.ndarray  # shape (k, 3) [rad/s]
    speeds: np.ndarray  # of the wheels, shape (k, 3) [rad/s]
    growth: np.ndarray  # factor on the inertia, shape (k,) [-]
    saturated: float  # share of the time in which a wheel ran at its top speed [-]


def simulate(
    satellite: str, profiles: Sequence[str], *, change: str = "static", seed: int = 0
) -> dict[str, Run]:
    """Runs of a satellite from rest, each under a profile with the amplitudes of the study.

    Gravity gradient and sunlight turn it, too.

    Args:
        satellite: Name of the robot.
        profiles: Names of `tasks.torque_profiles.PROFILES`.
        change: How its inertia changes, one of `GROWTHS`.
        seed: Of the pseudorandom binary sequence.
    """
    robot = load_robot(satellite)
    wheels = wheels_of(robot)
    gain, flywheels = gain_of(satellite, wheels), Flywheels(wheels.axes, wheels.spin_inertia)
    played = [profile_of(name, wheels, gain=gain, seed=seed, saturate=True) for name in profiles]
    zero = np.zeros(len(played))
    state = SpatialState(*((zero,) * 6), zero + 1.0, *((zero,) * 6))
    speeds: tuple[np.ndarray, ...] = (zero,) * wheels.count
    steps = round(LASTS_S / SAMPLE_S)
    times, growth = SAMPLE_S * np.arange(steps + 1), GROWTHS[change]
    rates, spins = (np.zeros((steps + 1, len(played), 3)) for _ in range(2))
    full = np.zeros(len(played))
    for k in range(steps):
        tensor = tuple(zero + growth(float(times[k])) * moment for moment in robot.body.inertia)
        asked = np.array([each.torque(float(times[k])) for each in played]).T
        wanted = np.clip(asked, -wheels.torque, wheels.torque)
        torque = _outside(state, tensor)
        for _ in range(round(SAMPLE_S / PHYSICS_S)):
            motors = _Motors(tuple(wheels.motor_torque(wanted, np.array(speeds), PHYSICS_S)))
            state, speeds = gyrostat_step(
                state, speeds, torque, None, motors, flywheels, zero + robot.body.mass, tensor, PHYSICS_S
            )
        rates[k + 1], spins[k + 1] = np.array(state.rate).T, np.array(speeds).T
        full += (np.abs(spins[k + 1]) >= 0.999 * wheels.top_speed).any(axis=1)
    grown = np.array([growth(float(t)) for t in times])
    return {
        name: Run(times, rates[:, i], spins[:, i], grown, float(full[i] / steps))
        for i, name in enumerate(profiles)
    }


def wheels_of(robot: Robot) -> ReactionWheels:
    """The wheels of a satellite."""
    assert isinstance(robot.actuators, ReactionWheels)
    return robot.actuators


@dataclass(frozen=True)
class _Motors:
    """Torques that do not depend on the speeds of the wheels."""

    torques: tuple[np.ndarray, ...]

    def __call__(self, _speeds: tuple[np.ndarray, ...]) -> tuple[np.ndarray, ...]:
        return self.torques


def _outside(state: SpatialState, tensor: tuple[np.ndarray, ...]) -> Vector:
    zero = 0.0 * state.x
    light = cross((zero, zero, zero + SOLAR_ARM), turn_back(state.quat, (zero - SOLAR_FORCE, zero, zero)))
    return plus(gravity_gradient_torque(state, tensor, ORBIT_RATE), light)


def measured(run: Run, level: str, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Turn rates [rad/s] and speeds of wheels [rad/s] as sensors of a level report them, shapes (k, 3)."""
    std, walk = LEVELS[level]
    bias = np.cumsum(walk * np.sqrt(SAMPLE_S) * rng.standard_normal(run.rate.shape), axis=0)
    rate = run.rate + bias + std * rng.standard_normal(run.rate.shape)
    return rate, run.speeds + WHEEL_STD * rng.standard_normal(run.speeds.shape)
