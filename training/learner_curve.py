"""Returns of a learner over samples and processor time, for a comparison of learners."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from fulmar_core.config.seeds import HELD_OUT_SEED
from fulmar_core.controllers.controller import Controller, Inputs, StateObserver
from fulmar_core.estimators.actuator_health.filters import HealthSettings
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.loop.rollout import roll_out_in_batch
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.episode import episode_steps
from fulmar_core.simulation.learning_step import observed_step
from fulmar_core.simulation.metrics import summary
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.worlds.scenario import Scenario
from training.network import NetworkController
from training.policy_network import PolicyNetwork


@dataclass(frozen=True)
class Budget:
    """What each learner gets: it goes on until it has had both."""

    samples: int  # control steps of all worlds
    cpu_s: float  # processor time of learning, checks apart [s]
    points: int = 8  # checks, at equal shares of the processor time
    episodes: int = 64  # of each check


@dataclass(frozen=True)
class Point:
    """A learner at one moment: what its policy is worth on held-out episodes, and what it has had so far."""

    returns: float  # mean sum of rewards of an episode
    success_rate: float
    samples: int
    gradient_steps: int
    cpu_s: float


class Curve:
    """Checks at equal shares of the processor time, and where each budget is used up.

    Attributes:
        points: In order of time, as dictionaries of `Point`.
    """

    def __init__(self, robot: Robot, task: Task, scenario: Scenario, budget: Budget) -> None:
        """Begin to count with the first look."""
        self._for, self._budget = (robot, task, scenario), budget
        self._marks = [budget.cpu_s * (number + 1) / budget.points for number in range(budget.points)]
        self._sampled = False
        self._began: float | None = None
        self.points: list[dict[str, Any]] = []

    def look(self, samples: int, gradient_steps: int, network: Callable[[], PolicyNetwork]) -> bool:
        """Check if a mark is reached; returns whether both budgets are used up.

        Args:
            samples: Control steps of all worlds so far.
            gradient_steps: So far.
            network: Gives the policy as it is now.
        """
        now = time.process_time()
        if self._began is None:
            self._began = now
        spent = now - self._began
        sampled, due = samples >= self._budget.samples, bool(self._marks) and spent >= self._marks[0]
        if due or (sampled and not self._sampled):
            while self._marks and spent >= self._marks[0]:
                del self._marks[0]
            self._sampled = sampled
            robot, task, scenario = self._for
            controller = NetworkController(network(), robot, task, robot.timing.control_hz)
            figures = worth(controller, robot, task, scenario, episodes=self._budget.episodes)
            self.points.append(asdict(Point(*figures, samples, gradient_steps, spent)))
            self._began += time.process_time() - now  # a check is no learning
        return sampled and not self._marks


def worth(
    controller: Controller, robot: Robot, task: Task, scenario: Scenario, *, episodes: int
) -> tuple[float, float]:
    """Mean return and success rate of a controller on held-out episodes of the batch, as in training but the start."""
    done = roll_out_in_batch(controller, robot, task, scenario, episodes=episodes, seed=HELD_OUT_SEED)
    return mean_return(controller, robot, task, scenario, episodes=episodes), float(
        summary(done, task)["success_rate"]
    )


def mean_return(
    controller: Controller, robot: Robot, task: Task, scenario: Scenario, *, episodes: int
) -> float:
    """Mean over held-out episodes of the rewards' sum, until each ends."""
    simulation = BatchSimulation(robot, task, scenario, worlds=episodes, seed=HELD_OUT_SEED)
    loop = ControlLoop(robot, task, controller, robots=episodes)
    loop.reset()
    loop.begin(goal_in_float64(simulation.goal))
    total, alive = np.zeros(episodes), np.ones(episodes, dtype=bool)
    for number in range(episode_steps(task, simulation.control_dt)):
        inputs = loop.inputs(simulation.measured, {}, round(1e9 * number * loop.dt))
        reward, over, _ = observed_step(simulation, loop.act(inputs).command, effort=robot.costs.effort)
        total += np.where(alive, np.asarray(reward), 0.0)
        alive &= ~np.asarray(over)
        if not alive.any():
            break
    return float(total.mean())


class ClosedValves:
    """Commands nothing: what a learner that has learned nothing may still be worth."""

    name = "closed_valves"
    estimator: HealthSettings | None = None
    observer: StateObserver[Any] | None = None
    readings: tuple[str, ...] = ()

    def __init__(self, robot: Robot) -> None:
        self.control_hz = robot.timing.control_hz
        self._count = len(robot.actuators.names)

    def reset(self) -> None:
        """Nothing to forget."""

    def act(self, inputs: Inputs) -> np.ndarray:
        """See `Controller.act`."""
        return np.zeros((len(inputs.observation), self._count))

    def metadata(self) -> dict[str, Any]:
        """Its name."""
        return {"controller": self.name}
