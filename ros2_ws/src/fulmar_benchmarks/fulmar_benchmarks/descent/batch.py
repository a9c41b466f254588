"""The same flights in the core's batch, without ROS: each with a guard of its own whose clock is that of the batch."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np

from fulmar_benchmarks.descent.flights import Descent, DescentLog, Flights
from fulmar_core.controllers.controller import Controller
from fulmar_core.controllers.flight_refuge import refuge_of
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.safety.watchdog import Watchdog
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.wires.silence import default_timeout
from policy_server.controllers import Choice, load_controller


def fly_in_batch(flights: Flights) -> list[Descent]:
    """Fly all of them, and let each controller fall silent at its time.

    Raises:
        FulmarError: There is no such controller for the task.
    """
    robot, task = flights.craft, flights.task.fitted(flights.craft)
    controller = load_controller(flights.controller, robot, task, Choice(flights.control_hz, flights.policy))
    simulation: BatchSimulation[Any] = BatchSimulation(
        robot,
        task,
        flights.conditions,
        worlds=flights.count,
        seed=flights.seed,
        control_hz=1.0 / robot.timing.physics_dt,
    )
    return _Batch(flights, controller, simulation).flown()


class _Batch:
    def __init__(self, flights: Flights, controller: Controller, simulation: BatchSimulation[Any]) -> None:
        robot, count = flights.craft, flights.count
        self._flights, self._robot, self._simulation = flights, robot, simulation
        self._loop = ControlLoop(robot, simulation.task, controller, robots=count)
        self._loop.reset()
        self._loop.begin(goal_in_float64(simulation.goal))
        self._period = round(self._loop.dt / simulation.control_dt)  # ticks of the batch between two commands
        refuge = refuge_of(robot, 1.0 / simulation.control_dt)
        timeout_ns = round(1e9 * default_timeout(self._loop.dt))
        self._guards = [
            ActuatorGuard(
                robot.actuators, Watchdog(timeout_ns), control_dt=self._loop.dt, refuge=copy.deepcopy(refuge)
            )
            for _ in range(count)
        ]
        self._killed = np.array([round(flights.killed_s(i) / simulation.control_dt) for i in range(count)])
        self._logs = [DescentLog(robot, number) for number in range(count)]

    def flown(self) -> list[Descent]:
        """All flights, until each is down or its time is over."""
        dt = self._simulation.control_dt
        most = int(self._killed.max()) + round(self._flights.longest_s / dt)
        for tick in range(most):
            applied = self._applied(tick)
            self._simulation.move(applied)
            for log, killed, number in zip(self._logs, self._killed, range(len(self._logs)), strict=True):
                if tick + 1 >= killed and not log.down:
                    log.add(self._simulation.truth[number], dt * (tick + 1 - killed))
            if all(log.down for log in self._logs):
                break
        return [log.descent() for log in self._logs]

    def _applied(self, tick: int) -> np.ndarray:
        """What each guard lets through, shape (worlds, n)."""
        now_ns = round(1e9 * tick * self._simulation.control_dt)
        if tick % self._period == 0 and tick < self._killed.max():
            command = self._loop.step(self._simulation.measured, {}, now_ns).command
            for guard, own, killed in zip(self._guards, command, self._killed, strict=True):
                if tick < killed:
                    guard.offer(self._robot.actuators.names, own.tolist(), now_ns, stamp_ns=now_ns)
        measured = self._simulation.measured
        return np.stack(
            [
                self._robot.actuators.safe_command
                if log.down
                else guard.output(now_ns, measured[number].to_rigid(), plant_ns=now_ns)
                for number, (guard, log) in enumerate(zip(self._guards, self._logs, strict=True))
            ]
        )
