"""Episodes under given conditions: in the core's batch, and in MuJoCo in several processes."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from fulmar_core.config.pool import ProcessPool
from fulmar_core.loop.rollout import batches, roll_out_in_backends
from fulmar_core.safety.certified_set import Axis
from fulmar_core.simulation.metrics import successes
from fulmar_evaluation.certify.conditions import Conditions, axes_of, scenario_of
from fulmar_evaluation.evaluation import Trial

Progress = Callable[[int], None]  # called with the number of episodes done since the last call
PART = 50  # episodes of one call of a process


@dataclass
class Episodes:
    """Runs episodes of a trial, each with a number of its own, so that none is ever used twice."""

    trial: Trial
    dead: int = 0  # actuators that do nothing
    progress: Progress = lambda episodes: None
    used: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        self.robot, self.task = self.trial.robot, self.trial.task
        self.axes: tuple[Axis, ...] = axes_of(self.robot, self.task)

    @functools.cached_property
    def _controller(self) -> object:
        return self.trial.controller()

    def run(self, shares: np.ndarray) -> np.ndarray:
        """Run one episode under each condition in the core's batch.

        Args:
            shares: Conditions as shares of the axes, shape (n, k).

        Returns:
            Which succeeded, shape (n,).
        """
        conditions = self._conditions(shares)
        runs = batches(
            self._controller,  # type: ignore[arg-type]
            self.robot,
            self.task,
            scenario_of(self.axes),
            episodes=len(shares),
            seed=self.trial.plan.seed,
            worlds=self.trial.worlds,
            first=conditions.first,
            alter=conditions,
        )
        found = []
        for run in runs:
            found.append(successes(run, self.task))
            self.progress(len(found[-1]))
        return np.concatenate(found)

    def run_in_mujoco(self, shares: np.ndarray) -> np.ndarray:
        """As `run`, in MuJoCo, an independent simulator.

        Raises:
            RunFailed: A process was ended from outside.
        """
        first = self._conditions(shares).first
        items = [
            (self.trial, shares[at : at + PART], first + at, self.dead) for at in range(0, len(shares), PART)
        ]
        found = np.zeros(len(shares), dtype=bool)

        def done(index: int, result: object) -> None:
            if isinstance(result, BaseException):
                raise result
            part = np.asarray(result)
            found[PART * index : PART * index + len(part)] = part
            self.progress(len(part))

        ProcessPool(self.trial.jobs).run(mujoco_part, items, on_done=done, watch=lambda counts: None)
        return found

    def _conditions(self, shares: np.ndarray) -> Conditions:
        first, self.used = self.used, self.used + len(shares)
        return Conditions(self.robot, self.axes, shares, first, self.trial.plan.seed, self.dead)


def mujoco_part(trial: Trial, shares: np.ndarray, first: int, dead: int) -> np.ndarray:
    """Run some episodes in MuJoCo, in a process of a pool.

    Args:
        trial: What runs.
        shares: Conditions, shape (n, k).
        first: Number of the first episode.
        dead: Actuators that do nothing.

    Returns:
        Which succeeded, shape (n,).
    """
    from sim_nodes.mujoco_backend import MujocoBackend

    robot, task = trial.robot, trial.task
    axes = axes_of(robot, task)
    scenario = scenario_of(axes)
    run = roll_out_in_backends(
        trial.controller(),
        lambda: MujocoBackend.of(robot, task, scenario),
        task,
        scenario,
        episodes=len(shares),
        seed=trial.plan.seed,
        first=first,
        alter=Conditions(robot, axes, shares, first, trial.plan.seed, dead),
    )
    return successes(run, task)
