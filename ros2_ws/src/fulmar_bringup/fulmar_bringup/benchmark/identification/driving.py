"""Machines driven by random commands in MuJoCo, with the noise of their sensors, each run into a bag."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from fulmar_bringup.benchmark.identification.machines import Leg, Machine
from fulmar_bringup.benchmark.sample_bag import SampleBag
from fulmar_core.controllers.excite import Excite
from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.disturbances.world import World
from fulmar_core.episode import Episode, draw_episode
from fulmar_core.goal import stack_goals
from fulmar_core.observation import Observer
from fulmar_core.planar import at_rest, planar_of, stack_planar
from fulmar_core.robot import Robot
from fulmar_core.tasks import load_task
from sim_nodes.mujoco_backend import MujocoBackend

TASK = "go_to_position"


def drive(machine: Machine, leg: Leg, nominal: Robot, folder: Path, *, seed: int, duration_s: float) -> Path:
    """Drive one run in real time's rhythm: a measurement each tick, a command each control step.

    Args:
        machine: What is driven.
        leg: With what aboard.
        nominal: What the driver believes.
        folder: Of the bag.
        seed: Of the sensors' noise.
        duration_s: Length [s].

    Returns:
        The folder.
    """
    task = load_task(TASK)
    controller = Excite(nominal, task)
    observer = Observer(nominal, task)
    backend = MujocoBackend(machine.robot)
    episode = draw_episode(nominal, task, load_scenario("nominal"), seed=seed, number=0)
    zero = np.asarray(0.0)
    goal = replace(episode.goal, targets=np.zeros_like(episode.goal.targets))
    sample = backend.reset(
        Episode(at_rest(zero, zero, zero), goal, _world(machine, leg, episode.world)), seed=seed
    )
    goals, command = stack_goals([goal]), nominal.actuators.safe_command
    dt, substeps = nominal.timing.physics_dt, nominal.timing.substeps(controller.control_hz)
    with SampleBag(folder, nominal) as bag:
        bag.odometry(sample.odometry, 0.0)
        for tick in range(round(duration_s / dt)):
            if tick % substeps == 0:
                seen = observer(stack_planar([planar_of(sample.odometry)]), goals, command[None])
                command = np.asarray(controller.act(np.asarray(seen)))[0]
                bag.applied(command, tick * dt)
            sample = backend.step(command)
            bag.odometry(sample.odometry, (tick + 1) * dt)
    backend.close()
    return folder


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
    return replace(nominal, **{name: np.asarray(value, dtype=float) for name, value in values.items()})
