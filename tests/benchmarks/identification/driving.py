"""Machines driven by random commands in MuJoCo, with the noise of their sensors, each run into a bag."""

from __future__ import annotations

import contextlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_core.actuators.differential_drive import DifferentialDrive
from fulmar_core.control_loop import ControlLoop
from fulmar_core.controllers.excite import Excite
from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.disturbances.world import World
from fulmar_core.episode import Episode, draw_episode
from fulmar_core.goal import stack_goals
from fulmar_core.planar import PlanarState, at_rest, planar_of, stack_planar
from fulmar_core.robot import Robot
from fulmar_core.state import RigidBodyState
from fulmar_core.tasks import load_task
from fulmar_core.topics import ACTUATORS_STATE, ODOMETRY
from sim_nodes.mujoco_backend import MujocoBackend
from tests.benchmarks.identification.machines import Leg, Machine
from tests.synthetic_run import NS, RunMessages

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
                state = stack_planar([planar_of(sample.measured)])
                command = loop.step(state, round(1e9 * tick * dt)).command[0]
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
    return planar_of(sample.truth)


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
