"""A boat whose controller stamps no command reaches its goals at any rate of the simulation."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.controllers.classical import load_classical
from fulmar_core.loop.rollout import roll_out_in_backends
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.safety.watchdog import Watchdog
from fulmar_core.simulation.backend import Sample
from fulmar_core.simulation.episode import Episode
from fulmar_core.simulation.metrics import successes
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes.mock_backend import MockBackend

BOAT, TASK = load_robot("kingfisher"), load_task("go_to_position")
HZ, GOALS = BOAT.timing.control_hz, 6


class Guarded(MockBackend):
    """A plant: the guard takes each command, at a time of the steady clock that goes with the rate."""

    def __init__(self, rate: float, *, stamped: bool) -> None:
        super().__init__(BOAT)
        self._rate, self._stamped = rate, stamped

    def reset(self, episode: Episode, *, seed: int, number: int = 0) -> Sample:
        self._guard = ActuatorGuard(BOAT.actuators, Watchdog(400_000_000), control_dt=1.0 / HZ)
        self._plant_ns = 1_000_000_000
        return super().reset(episode, seed=seed, number=number)

    def step(self, command: np.ndarray, ticks: int = 1) -> Sample:
        now_ns = round(self._plant_ns / self._rate)
        stamp_ns = self._plant_ns if self._stamped else None
        names = BOAT.actuators.names
        assert self._guard.offer(names, command, now_ns, stamp_ns=stamp_ns, plant_ns=self._plant_ns)
        self._plant_ns += round(1e9 * ticks * BOAT.timing.physics_dt)
        return super().step(self._guard.output(now_ns), ticks)


def goals_met(rate: float, *, stamped: bool) -> int:
    run = roll_out_in_backends(
        load_classical(BOAT, TASK, control_hz=HZ),
        lambda: Guarded(rate, stamped=stamped),
        TASK,
        load_scenario("nominal"),
        episodes=GOALS,
        seed=0,
    )
    return int(np.count_nonzero(successes(run, TASK.fitted(BOAT))))


@pytest.mark.slow
@pytest.mark.parametrize("rate", [1.0, 2.0, 4.0])
def test_a_boat_meets_as_many_goals_without_stamps_as_with_them(rate: float) -> None:
    assert goals_met(rate, stamped=False) == goals_met(rate, stamped=True) == GOALS
