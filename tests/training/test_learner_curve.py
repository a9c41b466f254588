"""Budgets of a comparison of learners, and what a policy is worth."""

from __future__ import annotations

import time

import numpy as np
import pytest

from fulmar_core.config.seeds import HELD_OUT_SEED
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from tests.training.dreamer_runs import drawn_network
from training import learner_curve
from training.gym_env import TaskVectorEnv
from training.learner_curve import Budget, ClosedValves, Curve, mean_return
from training.learner_runs import learner_settings, run_learner

ROBOT, TASK, NOMINAL = load_robot("turtlebot2"), load_task("go_to_position"), load_scenario("nominal")


def test_a_return_is_the_sum_of_the_rewards_of_a_gymnasium_environment():
    worlds = TaskVectorEnv(ROBOT, TASK, NOMINAL, num_envs=3, seed=HELD_OUT_SEED, training=False)
    worlds.reset()
    total, alive = np.zeros(3), np.ones(3, dtype=bool)
    while alive.any():
        _, reward, terminated, truncated, _ = worlds.step(np.zeros((3, 2)))
        total += np.where(alive, reward, 0.0)
        alive &= ~(terminated | truncated)
    found = mean_return(ClosedValves(ROBOT), ROBOT, TASK, NOMINAL, episodes=3)
    assert found == pytest.approx(total.mean(), rel=1e-5)


def test_a_curve_ends_when_both_budgets_are_used_up_and_checks_cost_nothing(monkeypatch):
    clock = iter(np.arange(0.0, 100.0, 0.5))
    monkeypatch.setattr(time, "process_time", lambda: float(next(clock)))
    monkeypatch.setattr(learner_curve, "worth", lambda *_, **__: (1.0, 0.5))
    curve = Curve(ROBOT, TASK, NOMINAL, Budget(samples=40, cpu_s=1.0, points=2, episodes=2))
    looks = [curve.look(10 * number, number, lambda: drawn_network(ROBOT, TASK)) for number in range(12)]
    ended = looks.index(True)
    assert not any(looks[:ended])
    assert [point["samples"] for point in curve.points][-1] >= 40
    assert curve.points[-1]["cpu_s"] <= 2.0, "checks of 0.5 s each are not in it"
    assert {point["returns"] for point in curve.points} == {1.0}


@pytest.mark.slow
@pytest.mark.parametrize("learner", ["td3", "ppo"])
def test_a_learner_leaves_points_up_to_its_budget(learner, tmp_path):
    budget = Budget(samples=64, cpu_s=0.05, points=1, episodes=2)
    points = run_learner(learner, "turtlebot2", "go_to_position", seed=1, budget=budget, out=tmp_path)
    assert points[-1]["samples"] >= 64
    assert points[-1]["cpu_s"] >= 0.05
    assert np.isfinite(points[-1]["returns"])


def test_learners_have_one_scenario_and_the_robot_s_own_rate():
    for learner in ("ppo", "td3", "sac", "dreamer"):
        settings = learner_settings(learner, ROBOT, TASK)
        assert (settings.scenario, settings.control_hz) == ("nominal", None)
