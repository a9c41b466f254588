"""How a controller drives the nominal boat in still water, in the core's own dynamics: what plans begin from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.controllers.controller import Controller
from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.goal import Goal, no_obstacles
from fulmar_core.planar import PlanarState
from fulmar_core.robot import Robot
from fulmar_core.simulation import BatchSimulation
from fulmar_core.tasks import Task
from policy_server.planning.boat import MOTION


@dataclass(frozen=True)
class Rehearsed:
    """What happened, from the start on, a sample each control step."""

    states: np.ndarray  # (rows, steps + 1, size), as of `boat`; the yaw goes on beyond a turn
    done: np.ndarray  # (rows, steps + 1) waypoints passed


class Nominal:
    """Boats in still water, in the core's own dynamics."""

    def __init__(self, robot: Robot, task: Task, *, rows: int, control_hz: float) -> None:
        """Some boats at rest."""
        self._simulation = BatchSimulation(
            robot,
            task,
            load_scenario("ideal"),
            worlds=rows,
            seed=0,
            control_hz=control_hz,
            dtype=np.float64,
        )

    def put(self, states: np.ndarray, places: np.ndarray | None = None) -> None:
        """Put them somewhere, shape (rows, size) as of `boat`, and give them courses, shape (rows, k, 2) [m]."""
        x, y, yaw, u, v, r = states[:, :MOTION].T
        c, s = np.cos(yaw), np.sin(yaw)
        goal, rows = self._simulation.goal, len(states)
        if places is not None:
            targets = np.concatenate((places, np.zeros((*places.shape[:2], 1))), axis=-1)
            goal = Goal(targets, np.zeros(rows), no_obstacles(rows), np.zeros((rows, 2)))
        self._simulation.put(
            PlanarState(x, y, yaw, c * u - s * v, s * u + c * v, r), goal, states[:, MOTION:]
        )

    def step(self, commands: np.ndarray) -> None:
        """One control period with commands, shape (rows, n)."""
        self._simulation.step(commands)

    def observe(self) -> np.ndarray:
        """As of the task, shape (rows, terms)."""
        return np.asarray(self._simulation.observe())

    @property
    def states(self) -> np.ndarray:
        """Shape (rows, size), as of `boat`; the yaw goes on beyond a turn."""
        truth = self._simulation.truth
        ahead, left = truth.velocity_in_body
        motion = (truth.x, truth.y, truth.yaw, ahead, left, truth.yaw_rate)
        return np.column_stack((*motion, self._simulation.command))

    @property
    def done(self) -> np.ndarray:
        """Waypoints passed, shape (rows,)."""
        return np.asarray(self._simulation.goal.done, dtype=int)


class Rehearsal:
    """Drives of one controller."""

    def __init__(self, robot: Robot, task: Task, controller: Controller) -> None:
        """Whose drives they are.

        Args:
            robot: The boat.
            task: Whose observations the controller takes.
            controller: Nobody else's, as it is reset.
        """
        self._robot, self._task, self._controller = robot, task, controller

    def drive(
        self,
        states: np.ndarray,
        places: np.ndarray,
        *,
        steps: int,
        until: np.ndarray | None = None,
        held: np.ndarray | None = None,
        commands: np.ndarray | None = None,
    ) -> Rehearsed:
        """Drive some boats, each along a course of its own.

        Args:
            states: Where they begin, shape (rows, size), as of `boat`.
            places: Of the waypoints from the next one on, shape (rows, k, 2) [m]; after the last the first comes again.
            steps: Control steps at most.
            until: For as many groups of boats as it has numbers, how many waypoints half of the group shall pass; ends
                when every group has. By default only `steps` end a drive.
            held: For how many steps each boat holds commands before the controller drives, shape (rows,).
            commands: Which ones, shape (rows, n).

        Returns:
            The drives.
        """
        rows = len(states)
        boats = Nominal(self._robot, self._task, rows=rows, control_hz=self._controller.control_hz)
        boats.put(states, places)
        self._controller.reset()
        trace, done = [boats.states], [np.zeros(rows, dtype=int)]
        for step in range(steps):
            command = np.asarray(self._controller.act(boats.observe()))
            if held is not None and commands is not None:
                command = np.where((step < held)[:, None], commands, command)
            boats.step(command)
            trace.append(boats.states)
            done.append(boats.done)
            if (
                until is not None
                and ((done[-1].reshape(len(until), -1) >= until[:, None]).mean(axis=1) >= 0.5).all()
            ):
                break
        return Rehearsed(np.stack(trace, axis=1), np.stack(done, axis=1))
