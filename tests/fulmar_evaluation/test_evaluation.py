"""What a trial runs."""

from __future__ import annotations

from fulmar_bringup.run_plan import RunPlan
from fulmar_evaluation import evaluation
from fulmar_evaluation.evaluation import Trial, runs_of


def test_a_batch_has_as_many_worlds_at_once_as_are_asked_for(monkeypatch):
    calls = []
    monkeypatch.setattr(evaluation, "batches", lambda *given, **options: calls.append(options) or [])
    plan = RunPlan("kingfisher", "go_to_pose", "classical", "mujoco", 10.0, duration_s=60.0)
    assert list(runs_of(Trial(plan, "batch", 4096, worlds=64))) == []
    assert (calls[0]["episodes"], calls[0]["worlds"]) == (4096, 64)
