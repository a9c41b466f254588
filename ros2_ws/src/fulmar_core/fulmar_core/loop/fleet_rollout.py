"""Fleets in the core's own dynamics, many seeds at once: `swap_places` with and without the guard that keeps apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fulmar_core.controllers.controller import Controller
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.keep_apart import Other
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.planar import PlanarState, wrapped
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal import Goal, goal_in_float64, no_obstacles
from fulmar_core.tasks.swap_places import swap_places
from fulmar_core.wires.neighbours import NEIGHBOURS
from fulmar_core.worlds.scenario import Scenario


@dataclass(frozen=True)
class FleetRun:
    """What happened to a fleet of equal robots, for each seed.

    Attributes:
        arrived: Which robots were within the tolerance for the whole end of the run, shape (seeds, n).
        least_m: Least distance between any two hulls; below 0 they overlapped, shape (seeds,) [m].
        held_share: Share of control steps in which the guard held a robot back.
    """

    arrived: np.ndarray
    least_m: np.ndarray
    held_share: float

    @property
    def all_arrived(self) -> np.ndarray:
        """Seeds in which every robot arrived, shape (seeds,)."""
        return np.asarray(self.arrived.all(axis=1))


def roll_out_swap(
    controller: Controller,
    robot: Robot,
    task: Task,
    scenario: Scenario,
    *,
    robots: int,
    seeds: Sequence[int],
    keep_apart: bool,
    duration_s: float = 60.0,
) -> FleetRun:
    """Let fleets of one robot exchange places, a fleet for each seed; they do not touch each other here.

    Args:
        controller: Of every robot.
        robot: Of every place.
        task: A task of poses in the plane.
        scenario: What the worlds are drawn from.
        robots: Of a fleet, >= 2.
        seeds: Of the places.
        keep_apart: Whether the guard acts.
        duration_s: Length of the run [s].

    Raises:
        ConfigError: As in `swap_places` and `KeepApartGuard`.
    """
    places = [swap_places(seed, [robot.body.radius] * robots) for seed in seeds]
    starts, goals = (np.concatenate([pair[i] for pair in places]) for i in range(2))
    count = len(starts)
    simulation = BatchSimulation(
        robot, task, scenario, worlds=count, seed=0, control_hz=controller.control_hz, dtype=np.float64
    )
    zero, command = np.zeros(count), np.tile(robot.actuators.safe_command, (count, 1))
    goal = Goal(goals[:, None], zero, no_obstacles(count))
    x, y, yaw = starts.T
    simulation.put(PlanarState(x, y, yaw, zero, zero, zero), goal, command)
    others = [Other(str(i), robot, guarded=True) for i in range(robots - 1)] if keep_apart else []
    loop = ControlLoop(robot, task, controller, robots=count, others=others)
    loop.reset()
    loop.begin(goal_in_float64(goal))
    steps, last = round(duration_s / loop.dt), round((duration_s - task.tolerance.hold_s) / loop.dt)
    least, arrived, held = np.full(len(seeds), np.inf), np.ones(count, dtype=bool), 0.0
    for number in range(steps):
        readings = {NEIGHBOURS: _others(simulation.measured, robots)} if keep_apart else {}
        step = loop.step(simulation.measured, readings, round(1e9 * number * loop.dt))
        held += float(loop.keep_apart.holds.mean()) if loop.keep_apart else 0.0
        simulation.move(step.command)
        least = np.minimum(least, _least(simulation.truth, robots))
        if number >= last:
            arrived &= _within(simulation.truth, goals, task)
    return FleetRun(arrived.reshape(len(seeds), robots), least - 2.0 * robot.body.radius, held / steps)


def _others(measured: PlanarState, robots: int) -> np.ndarray:
    """Places and velocities of the others of each robot's fleet, shape (n, 4 (robots - 1))."""
    motion = np.stack((measured.x, measured.y, measured.vx, measured.vy), axis=-1).reshape(-1, robots, 4)
    which = np.array([[i for i in range(robots) if i != own] for own in range(robots)])
    return motion[:, which].reshape(-1, 4 * (robots - 1))


def _least(truth: PlanarState, robots: int) -> np.ndarray:
    """Least distance between the centres of any two robots of each fleet, shape (fleets,) [m]."""
    place = np.stack((truth.x, truth.y), axis=-1).reshape(-1, robots, 2)
    first, second = np.triu_indices(robots, 1)
    return np.asarray(np.linalg.norm(place[:, first] - place[:, second], axis=-1).min(axis=1))


def _within(truth: PlanarState, goals: np.ndarray, task: Task) -> np.ndarray:
    """Which robots are within the task's tolerance of their goals, shape (n,)."""
    far = np.hypot(truth.x - goals[:, 0], truth.y - goals[:, 1])
    turned = np.abs(wrapped(truth.yaw - goals[:, 2]))
    return np.asarray((far <= task.tolerance.position) & (turned <= np.deg2rad(task.tolerance.heading_deg)))
