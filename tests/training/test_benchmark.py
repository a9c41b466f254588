"""The comparison of our PPO with the stock one: like with like, side by side."""

from __future__ import annotations

from dataclasses import replace

import pytest

from fulmar_core.config.errors import ConfigError
from training.benchmark import benchmark_jobs, compare
from training.jobs import Outcome
from training.settings import load_training_settings


@pytest.fixture
def jobs(tmp_path):
    return benchmark_jobs(
        "floating_platform", "go_to_pose", seeds=(1, 2), seconds=8.0, check_every_s=4.0, out=tmp_path
    )


def test_the_two_kinds_of_a_seed_differ_in_nothing_but_the_kind_and_run_side_by_side(jobs):
    assert [job.name for job in jobs] == ["stock 1", "fast 1", "stock 2", "fast 2"]
    for stock, fast in zip(jobs[::2], jobs[1::2], strict=True):
        assert stock.settings.algorithm == replace(fast.settings.algorithm, fast=False, precision="float32")
        assert replace(stock.settings, algorithm=fast.settings.algorithm) == fast.settings
        assert (stock.seed, stock.time_limit_s) == (fast.seed, fast.time_limit_s)


class RecordedExecutor:
    """Runs nothing: seed 2 of each kind learns less, and the stock one at half the speed."""

    def __init__(self, broken=()):
        self.broken = broken

    def run(self, jobs, watch):
        return [
            Outcome(job, None, "broke") if job.name in self.broken else self._outcome(job) for job in jobs
        ]

    def _outcome(self, job):
        fast, good = job.settings.algorithm.fast, job.seed == 1
        curve = [
            {"wall_s": 4.2, "success_rate": 0.5},
            {"wall_s": 8.1, "success_rate": 0.95 if good else 0.8},
        ]
        record = {"seed": job.seed, "steps_per_s": 200_000 if fast else 100_000, "curve": curve}
        return Outcome(job, record)


def test_speed_and_success_over_time_are_reported_for_both(jobs):
    result = compare(jobs, RecordedExecutor(), lambda *_: None)
    assert result["speed_ratio"] == 2.0
    assert (result["stock"]["steps_per_s"], result["fast"]["seeds"]) == (100_000, [1, 2])
    last = result["fast"]["curve"][-1]
    assert (last["wall_s"], last["lowest"], last["highest"]) == (8.0, 0.8, 0.95)
    assert last["success"] == pytest.approx(0.875)
    assert result["fast"]["time_to_0.9_s"] is None  # one of two never reached it


def test_a_failed_run_is_reported_and_leaves_the_others(jobs):
    result = compare(jobs, RecordedExecutor(broken=("fast 2", "stock 1", "stock 2")), lambda *_: None)
    assert result["failed"] == ["stock 1: broke", "stock 2: broke", "fast 2: broke"]
    assert "stock" not in result
    assert result["fast"]["time_to_0.9_s"] == 8.1
    assert "speed_ratio" not in result


def test_only_ppo_is_compared(tmp_path, monkeypatch):
    def off_policy(robot, task):
        return load_training_settings(robot, task, "sac")

    monkeypatch.setattr("training.benchmark.load_training_settings", off_policy)
    with pytest.raises(ConfigError, match="learn with sac"):
        benchmark_jobs("turtlebot2", "go_to_pose", seeds=(1,), seconds=8.0, check_every_s=4.0, out=tmp_path)
