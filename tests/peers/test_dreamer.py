"""DreamerV3 of sheeprl itself: its agent beside our network, and a training, a resumption and an export of one."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
import torch

from fulmar_core.loop.policy_bundle import read_passport
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from policy_server.policy import Policy
from tests.peers.environment import DREAMER, run_peer
from tests.training.dreamer_runs import small_plan
from training.dreamer_network import DreamerNetwork
from training.export import export
from training.jobs import Job, run_job
from training.settings import Dreamer, load_training_settings

ROBOT, TASK = load_robot("turtlebot2"), load_task("go_to_position")
SCRIPT = Path(__file__).with_name("step_dreamer.py")
REPOSITORY = Path(__file__).resolve().parents[2]
STEPS, WORLDS = 500, 3


@pytest.mark.slow
def test_our_network_steps_as_the_agent_of_sheeprl_does(tmp_path):
    plan = small_plan(ROBOT, TASK)
    seen = 2.0 * np.random.default_rng(1).normal(size=(STEPS, WORLDS, plan.inputs)).astype(np.float32)
    (tmp_path / "sizes.json").write_text(json.dumps(asdict(plan) | {"actuators": len(plan.command_scale)}))
    np.save(tmp_path / "observations.npy", seen)
    run_peer(REPOSITORY, SCRIPT, tmp_path, home=tmp_path, environment=DREAMER)
    weights = torch.load(tmp_path / "weights.pt", weights_only=True)
    network = DreamerNetwork(plan)
    network.take(weights["world_model"], weights["actor"])
    memory, shares = np.zeros((WORLDS, plan.memory), np.float32), []
    for row in seen:
        command, _, memory = network.infer(row, memory)
        shares.append(command / np.asarray(plan.command_scale, np.float32))
    expected = np.load(tmp_path / "shares.npy")
    np.testing.assert_allclose(np.array(shares), expected, atol=1e-5)
    assert expected.std() > 0.1, "it does something"


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_a_training_is_resumed_and_its_policy_is_exported(tmp_path):
    settings = load_training_settings(ROBOT, TASK, "dreamer")
    assert isinstance(settings.algorithm, Dreamer)
    small = replace(
        settings.algorithm, recurrent=16, groups=4, classes=4, dense=16, minibatch=4, sequence=8, horizon=4,
        first_steps=64, replay_ratio=0.25,
    )  # fmt: skip
    settings = replace(settings, algorithm=small, worlds=4, evaluate_every_s=900.0)
    job = Job("mine", "turtlebot2", "go_to_position", 3, settings, tmp_path / "run", updates=4)
    first = run_job(job)
    (tmp_path / "run" / "run.json").unlink()
    record = run_job(replace(job, updates=8))
    assert 4 <= first["updates"] < 8 <= record["updates"]
    assert record["steps"] > first["steps"]
    assert len(record["curve"]) > len(first["curve"]) >= 1
    assert record["versions"]["sheeprl"] == "0.8.4"
    export(tmp_path / "run", tmp_path / "bundle")
    assert read_passport(tmp_path / "bundle").memory == 16 + 16 + 2
    assert Policy(tmp_path / "bundle", ROBOT, TASK).passport.remembers_command
