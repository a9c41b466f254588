"""Closed loops without ROS: what they need, and what they leave behind."""

from __future__ import annotations

import json
import sys
from dataclasses import replace

import pytest
from typer.testing import CliRunner

from fulmar_core.controllers.lqr import load_lqr
from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.errors import ConfigError
from fulmar_core.robot import load_robot
from fulmar_core.rollout import roll_out_in_backends, roll_out_in_batch
from fulmar_core.tasks import load_task
from sim_nodes.mock_backend import MockBackend

ROBOT, TASK, NOMINAL = load_robot("floating_platform"), load_task("go_to_pose"), load_scenario("nominal")


class Counted(MockBackend):
    """A mock that knows how many of its kind are open, and fails when told to."""

    open = 0
    fail_at_step = fail_at_number = 10**9

    def __init__(self) -> None:
        if Counted.open >= Counted.fail_at_number:
            raise RuntimeError("no more of them")
        super().__init__(ROBOT)
        Counted.open += 1
        self._steps = 0

    def step(self, command, ticks=1):
        self._steps += 1
        if self._steps >= Counted.fail_at_step:
            raise RuntimeError("it broke")
        return super().step(command, ticks)

    def close(self):
        Counted.open -= 1
        super().close()


@pytest.mark.parametrize("way_to_fail", [{}, {"fail_at_step": 3}, {"fail_at_number": 2}], ids=str)
def test_every_backend_is_closed_whatever_happens(monkeypatch, way_to_fail):
    monkeypatch.setattr(Counted, "open", 0)
    for name, value in way_to_fail.items():
        monkeypatch.setattr(Counted, name, value)
    task = replace(TASK, episode_s=1.0)

    def run():
        roll_out_in_backends(load_lqr(ROBOT, task), Counted, task, NOMINAL, episodes=4, seed=1)

    if way_to_fail:
        with pytest.raises(RuntimeError):
            run()
    else:
        run()
    assert Counted.open == 0


def test_an_episode_shorter_than_a_control_step_is_refused_by_name():
    task = replace(TASK, episode_s=0.05)
    lqr, words = (
        load_lqr(ROBOT, task),
        r"an episode of task 'go_to_pose' lasts 0\.05 s, less than one control",
    )
    with pytest.raises(ConfigError, match=words):
        roll_out_in_batch(lqr, ROBOT, task, NOMINAL, episodes=2, seed=1)
    with pytest.raises(ConfigError, match=words):
        roll_out_in_backends(lqr, lambda: MockBackend(ROBOT), task, NOMINAL, episodes=2, seed=1)


def test_judging_works_where_training_is_not_installed(monkeypatch):
    from fulmar_bringup.cli import app

    for name in [name for name in sys.modules if name.split(".")[0] == "training"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "training", None)
    arguments = "evaluate floating_platform go_to_pose --controller lqr --through batch --episodes 2 --json"
    result = CliRunner().invoke(app, arguments.split())
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["episodes"] == 2
