"""What a trial runs."""

from __future__ import annotations

import pytest

from fulmar_bringup import evaluation
from fulmar_bringup.evaluation import Trial, runs_of
from fulmar_bringup.node_table import RunPlan
from fulmar_core.rollout import WORLDS
from policy_server.shipped import shipped_policy


@pytest.mark.parametrize(
    ("controller", "asked", "together"),
    [("planner", WORLDS, 32), ("planner", 8, 8), ("classical", WORLDS, WORLDS), ("classical", 64, 64)],
)
def test_controllers_whose_every_episode_takes_seconds_have_few_at_once_so_that_progress_shows(
    monkeypatch, controller, asked, together
):
    told = []
    monkeypatch.setattr(evaluation, "batches", lambda *given, **options: told.append(options) or [])
    policy = str(shipped_policy("kingfisher", "go_through_positions"))
    plan = RunPlan(
        "kingfisher", "go_through_positions", controller, "mujoco", 10.0, policy=policy, duration_s=60.0
    )
    assert list(runs_of(Trial(plan, "batch", 4096, worlds=asked))) == []
    assert told[0]["worlds"] == together
