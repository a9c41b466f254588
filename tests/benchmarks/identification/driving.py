"""Robots drawn at random around the nominal ones, driven by random commands in MuJoCo, each run into a bag."""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_core.controllers.excite import Excite
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.robots.actuators.differential_drive import DifferentialDrive
from fulmar_core.robots.actuators.thrusters import Thrusters
from fulmar_core.robots.calibration import DRAGS
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.topics import ACTUATORS_STATE, ODOMETRY
from fulmar_core.simulation.episode import Episode, draw_episode
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.planar import PlanarState, at_rest
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import stack_goals
from fulmar_core.worlds.scenario import load_scenario
from fulmar_core.worlds.world import World
from sim_nodes.mujoco_backend import MujocoBackend
from tests.synthetic_run import NS, RunMessages

WEIGHED_TO = 0.004  # half a 95 % interval of a kitchen scale's reading [kg]
LEAST_DRAG = 1.0  # drags are spread around no less than this [N per m/s, ...]


@dataclass(frozen=True)
class Leg:
    """One run of a machine."""

    name: str
    mass: float  # with what is aboard [kg]
    yaw_inertia: float  # [kg·m²]
    center_of_mass: tuple[float, float]  # [m]
    ballast: tuple[float, float] | None = None  # reading of the scale, and half of its 95 % interval [kg]


@dataclass(frozen=True)
class Machine:
    """One machine, its runs, and what a good estimator finds."""

    robot: Robot  # the true one: thrust, drag
    legs: tuple[Leg, ...]
    truth: dict[str, float]  # by name of the estimate
    delay_s: float
    gain: tuple[float, ...]  # of each actuator
    opening_delay_s: float = 0.0
    slope: float = 0.0  # of the floor [rad]
    slope_direction: float = 0.0  # [rad]

    def push(self, leg: Leg) -> tuple[float, float]:
        """Force of the sloping floor along the world's axes [N]."""
        size = leg.mass * GRAVITY * math.sin(self.slope)
        return size * math.cos(self.slope_direction), size * math.sin(self.slope_direction)


def draw_machine(nominal: Robot, seed: int, number: int) -> Machine:
    """One machine.

    Delays are whole ticks of the simulator, which knows no others.

    Args:
        nominal: What the estimator believes.
        seed: Seed of all machines.
        number: Number of this one.
    """
    rng = np.random.default_rng((seed, number, len(nominal.name)))
    tick = nominal.timing.physics_dt
    delay = tick * int(rng.integers(0, 5))
    if isinstance(nominal.actuators, DifferentialDrive):
        return _wheels(nominal, rng, delay)
    if isinstance(nominal.actuators, Thrusters):
        return _platform(nominal, rng, delay, tick * int(rng.integers(0, 2)))
    return _boat(nominal, rng, delay)


def _platform(nominal: Robot, rng: np.random.Generator, delay: float, opening: float) -> Machine:
    assert isinstance(nominal.actuators, Thrusters)
    mass = nominal.body.mass * rng.uniform(0.8, 1.25)
    inertia = nominal.body.inertia[2] * rng.uniform(0.5, 1.5)
    thrust = nominal.actuators.thrust * rng.uniform(0.7, 1.3)
    cx, cy = _in_disc(rng, 0.02)
    bare = Leg("bare", mass, inertia, (cx, cy))
    heavy, weight = _with_ballast(bare, rng)
    return Machine(
        robot=replace(nominal, actuators=replace(nominal.actuators, thrust=thrust)),
        legs=(bare, heavy),
        truth={
            "mass": mass,
            "yaw_inertia": inertia,
            "thrust": thrust,
            "delay": delay,
            "opening_delay": opening,
            "center_of_mass_x": cx,
            "center_of_mass_y": cy,
            "yaw_inertia_with_ballast_1": heavy.yaw_inertia,
            "ballast_1": weight,
        },
        delay_s=delay,
        opening_delay_s=opening,
        gain=(1.0,) * len(nominal.actuators.names),
        slope=1e-3 * rng.uniform(0.0, 1.0),
        slope_direction=rng.uniform(-math.pi, math.pi),
    )


def _with_ballast(bare: Leg, rng: np.random.Generator) -> tuple[Leg, float]:
    """The same body with a disc of some 2 kg lying somewhere on it, and the true mass of the disc."""
    weight, radius = rng.uniform(1.9, 2.1), 0.06
    bx, by = _in_disc(rng, 0.15)
    total = bare.mass + weight
    (cx, cy), share = bare.center_of_mass, weight / total
    center = cx + share * (bx - cx), cy + share * (by - cy)
    apart = (bx - cx) ** 2 + (by - cy) ** 2
    inertia = bare.yaw_inertia + 0.5 * weight * radius**2 + bare.mass * share * apart  # parallel axes
    reading = weight + rng.normal(0.0, WEIGHED_TO / 1.96)
    return Leg("heavy", total, inertia, center, (reading, WEIGHED_TO)), weight


def _boat(nominal: Robot, rng: np.random.Generator, delay: float) -> Machine:
    water = nominal.hydrodynamics
    assert water is not None
    mass = nominal.body.mass * rng.uniform(0.9, 1.1)
    inertia = nominal.body.inertia[2] * rng.uniform(0.9, 1.04)
    truth = {"mass": mass, "yaw_inertia": inertia, "delay": delay}
    dampings = []
    for kind in ("linear", "quadratic"):
        values = list(getattr(water, f"{kind}_damping"))
        for axis, i in DRAGS:
            # A surge without any linear part gets some.
            values[i] = max(values[i], LEAST_DRAG) * rng.uniform(0.7, 1.3)
            truth[f"{axis}_{kind}_drag"] = values[i]
        dampings.append(tuple(values))
    return Machine(
        robot=replace(
            nominal, hydrodynamics=replace(water, linear_damping=dampings[0], quadratic_damping=dampings[1])
        ),
        legs=(Leg("driven", mass, inertia, (0.0, 0.0)),),
        truth=truth,
        delay_s=delay,
        gain=(1.0,) * len(nominal.actuators.names),
    )


def _wheels(nominal: Robot, rng: np.random.Generator, delay: float) -> Machine:
    """Wheels a few per cent larger or smaller than the base believes, and a wheel base likewise."""
    scale, base = rng.uniform(0.95, 1.05, 2)
    return Machine(
        robot=nominal,
        legs=(Leg("driven", nominal.body.mass, nominal.body.inertia[2], (0.0, 0.0)),),
        truth={"wheel_scale": scale, "turn_scale": scale / base, "delay": delay},
        delay_s=delay,
        gain=(scale, scale / base),
    )


def _in_disc(rng: np.random.Generator, radius: float) -> tuple[float, float]:
    distance, bearing = radius * math.sqrt(rng.uniform()), rng.uniform(-math.pi, math.pi)
    return distance * math.cos(bearing), distance * math.sin(bearing)


TASK = "go_to_position"
SETTLED_S = 4.0  # of no more change: dozens of time constants


def drive(machine: Machine, leg: Leg, nominal: Robot, folder: Path, *, seed: int, duration_s: float) -> Path:
    """Drive one run in real time's rhythm: a measurement each tick, a command each control step.

    Args:
        machine: What is driven.
        leg: With what aboard.
        nominal: What the driver believes.
        folder: Of the bag.
        seed: Of the sensors' noise.
        duration_s: Length [s].
    """
    task = load_task(TASK)
    controller = Excite(nominal, task)
    backend = MujocoBackend(machine.robot)
    episode = draw_episode(nominal, task, load_scenario("nominal"), seed=seed, number=0)
    zero = np.asarray(0.0)
    goal = replace(episode.goal, targets=np.zeros_like(episode.goal.targets))
    sample = backend.reset(
        Episode(at_rest(zero, zero, zero), goal, _world(machine, leg, episode.world)), seed=seed
    )
    loop = ControlLoop(nominal, task, controller)
    loop.begin(stack_goals([goal]))
    dt, substeps = nominal.timing.physics_dt, nominal.timing.substeps(controller.control_hz)
    bag = RunMessages(folder, nominal, {"robot": nominal.name}, (ODOMETRY, ACTUATORS_STATE))

    def measured(state: RigidBodyState, time_s: float) -> None:
        bag.odometry(ODOMETRY.name, state, time_s, _log_ns(time_s))

    with contextlib.closing(bag.writer):
        measured(sample.measured, 0.0)
        for tick in range(round(duration_s / dt)):
            if tick % substeps == 0:
                state = PlanarState.stack([PlanarState.from_rigid(sample.measured)])
                command = loop.step(state, {}, round(1e9 * tick * dt)).command[0]
                bag.joints(ACTUATORS_STATE.name, command, tick * dt, _log_ns(tick * dt))
            sample = backend.step(command)
            measured(sample.measured, (tick + 1) * dt)
    backend.close()
    return folder


def _log_ns(time_s: float) -> int:
    """As the stamps of `RunMessages`: a second after the epoch, since a stamp of 0 means none."""
    return round((time_s + 1.0) * NS)


def speeds_of_wheels(machine: Machine) -> dict[str, float]:
    """Speed over commanded speed, straight ahead and on the spot, when it changes no more.

    Not quite the factors that the machine was made with: wheels creep a little where they push.

    Returns:
        `wheel_scale` and `turn_scale`.
    """
    drive = machine.robot.actuators
    assert isinstance(drive, DifferentialDrive)
    speeds = np.array([0.5 * drive.max_speed, 0.0]), np.array([0.0, 0.5 * drive.max_yaw_rate])
    ahead, turning = (_settled(machine, command) for command in speeds)
    return {
        "wheel_scale": float(np.hypot(ahead.vx, ahead.vy) / speeds[0][0]),
        "turn_scale": float(turning.yaw_rate / speeds[1][1]),
    }


def _settled(machine: Machine, command: np.ndarray) -> PlanarState:
    """The true state some seconds after a command was first given."""
    backend = MujocoBackend(machine.robot)
    episode = draw_episode(machine.robot, load_task(TASK), load_scenario("nominal"), seed=0, number=0)
    zero = np.asarray(0.0)
    world = _world(machine, machine.legs[0], episode.world)
    sample = backend.reset(Episode(at_rest(zero, zero, zero), episode.goal, world), seed=0)
    for _ in range(round(SETTLED_S / machine.robot.timing.physics_dt)):
        sample = backend.step(command)
    backend.close()
    assert sample.truth is not None
    return PlanarState.from_rigid(sample.truth)


def _world(machine: Machine, leg: Leg, nominal: World) -> World:
    force_x, force_y = machine.push(leg)
    values = {
        "mass": leg.mass,
        "yaw_inertia": leg.yaw_inertia,
        "com_x": leg.center_of_mass[0],
        "com_y": leg.center_of_mass[1],
        "action_delay": machine.delay_s,
        "opening_delay": machine.opening_delay_s,
        "gain": machine.gain,
        "force_x": force_x,
        "force_y": force_y,
    }
    changed: dict[str, Any] = {name: np.asarray(value, dtype=float) for name, value in values.items()}
    return replace(nominal, **changed)
