"""What a training says at its end: what is usual, how to go on, and an export only of what has learned."""

from __future__ import annotations

from pathlib import Path

import pytest

from fulmar_core.config.errors import BundleError
from training import advice
from training.advice import usual_training

RUN = Path("runs/mine")
SLOW = {"robot": "spacecraft_16", "task": "go_to_pose_3d", "steps": 300_000, "wall_s": 120.0}


def test_a_failed_training_says_what_is_usual_and_how_to_go_on():
    said = advice.advice(RUN, SLOW, 0.0)
    assert said[0] == "the task is not learned yet: 0.000 of the episodes succeed, 0.850 or more are expected"
    assert "the shipped policy took 360 updates (5,898,240 steps; 84 s" in said[1]
    assert "this run had 300,000 steps in 120 s" in said[1]
    # The shipped policy's steps at this run's pace, and a quarter more.
    assert said[2] == "to go on: fulmar train --resume runs/mine --time-limit 2950"
    assert not any(line.startswith("next:") for line in said)


def test_a_training_that_has_learned_is_to_be_exported():
    assert advice.advice(RUN, SLOW, 0.95) == ["next: fulmar export runs/mine --out DIR"]


@pytest.mark.parametrize(
    ("robot", "task", "like"),
    [
        ("int_ball2", "go_to_pose_3d", ("int_ball2", "go_to_pose_3d")),
        ("leatherback", "go_to_pose", ("turtlebot2", "go_to_pose")),
        ("navion", "fly_path", ("airship_v7", "fly_b")),
    ],
)
def test_what_is_usual_is_that_of_the_pair_or_of_its_kind(robot, task, like):
    usual = usual_training(robot, task)
    assert (usual["robot"], usual["task"]) == like


def test_a_kind_without_a_policy_says_so():
    said = advice.advice(RUN, SLOW | {"robot": "cubesat_wheels", "task": "slew"}, 0.1)
    assert "usual: no policy is shipped for satellites that only turn to compare with" in said


def test_a_damaged_shipped_bundle_spoils_no_training(monkeypatch):
    def damaged(folder):
        raise BundleError(f"{folder}: damaged")

    monkeypatch.setattr(advice, "read_passport", damaged)
    assert usual_training("spacecraft_16", "go_to_pose_3d") is None


def test_what_ppo_needed_is_not_asked_of_another_algorithm():
    said = advice.advice(RUN, SLOW | {"algorithm": "dreamer"}, 0.1)
    assert not any(line.startswith("usual:") for line in said)
    assert "to go on: fulmar train --resume runs/mine --time-limit 240" in said
