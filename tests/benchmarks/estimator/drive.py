"""A robot that is driven about, and what its sensors report of it: the data that both estimators are given."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from fulmar_core.controllers.classical import load_classical
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.planar import to_body
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import Goal, goal_in_float64
from fulmar_core.worlds.scenario import load_scenario

TICK_S = 0.005  # of the physics and of the inertial unit: 200 Hz
GRAVITY = 9.81


@dataclass(frozen=True)
class Drive:
    """One robot over some time, at every tick; every array has the time first."""

    time_s: np.ndarray  # (n,)
    place: np.ndarray  # (n, 3) true x [m], y [m], yaw [rad]
    motion: np.ndarray  # (n, 3) true velocity in the world [m/s] and turn rate [rad/s]
    measured_place: np.ndarray  # (n, 3) as a motion capture would report it
    force: np.ndarray  # (n, 3) specific force in the body's frame, as measured [m/s²]
    turn_rate: np.ndarray  # (n,) as measured [rad/s]


def drives(robot: Robot, *, count: int, seconds: float, seed: int) -> list[Drive]:
    """Drive a robot from place to place in the core's own dynamics, with the classical law of its family.

    Args:
        robot: The robot; its YAML says how noisy its sensors are.
        count: How many drives.
        seconds: How long each is [s].
        seed: Of starts, goals and noise.
    """
    fine = dataclasses.replace(robot, timing=dataclasses.replace(robot.timing, physics_dt=TICK_S))
    task = load_task("go_to_pose")
    hold = round(1.0 / (robot.timing.control_hz * TICK_S))
    law = load_classical(robot, task, control_hz=robot.timing.control_hz)
    simulation = BatchSimulation(
        fine, task, load_scenario("ideal"), worlds=count, seed=seed, control_hz=1.0 / TICK_S
    )
    loop = ControlLoop(robot, task, law, robots=count)
    loop.begin(goal_in_float64(simulation.goal))
    states = []
    for tick in range(round(seconds / TICK_S)):
        if tick and tick % round(20.0 / TICK_S) == 0:  # goals are reached by then; what follows is new
            assert loop.goal is not None
            loop.begin(_turned_about(loop.goal))
        if tick % hold == 0:
            command = loop.step(simulation.measured, {}, round(1e9 * tick * TICK_S)).command
        simulation.move(command)
        t = simulation.truth
        states.append(np.stack((t.x, t.y, t.yaw, t.vx, t.vy, t.yaw_rate), axis=-1))
    rng = np.random.default_rng(seed)
    return [_measured(robot, drive, rng) for drive in np.moveaxis(np.array(states), 1, 0)]


def _turned_about(goal: Goal) -> Goal:
    """The goals on the other side of the origin."""
    return dataclasses.replace(goal, targets=-np.asarray(goal.targets))


def _measured(robot: Robot, states: np.ndarray, rng: np.random.Generator) -> Drive:
    place, motion = states[:, :3], states[:, 3:]
    odometry, imu = robot.sensors.odometry, robot.sensors.imu
    stds = odometry.position.std, odometry.position.std, odometry.heading.std
    acceleration = np.diff(motion[:, :2], axis=0, prepend=motion[:1, :2]) / TICK_S
    ahead, left = to_body(place[:, 2], acceleration[:, 0], acceleration[:, 1])
    force = np.stack((ahead, left, np.full(len(states), GRAVITY)), axis=-1)
    return Drive(
        time_s=TICK_S * np.arange(1, len(states) + 1),
        place=place,
        motion=motion,
        measured_place=place + np.array(stds) * rng.standard_normal(place.shape),
        force=force + imu.accelerometer.std * rng.standard_normal(force.shape),
        turn_rate=motion[:, 2] + imu.gyroscope.std * rng.standard_normal(len(states)),
    )
