"""The training of a twin: by the recipe of the shipped policy, resumed where it was broken off, exported."""

from __future__ import annotations

from dataclasses import replace

import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.loop.policy_bundle import read_passport

pytest.importorskip("stable_baselines3")

from fulmar_evaluation.twin.training import train_bundle, training_job
from training import advice, evaluator, jobs
from training.policies import load_policy_table

ROBOT, TASK = "floating_platform", "go_to_pose"


def job(tmp_path, robot=ROBOT, task=TASK, updates=None):
    return training_job(
        robot,
        task,
        updates=updates,
        runs=tmp_path / "training",
        bundles=tmp_path / "bundles",
        command="fulmar",
    )


@pytest.fixture
def small(tmp_path, monkeypatch):
    """The job of two updates, with settings and checks that take a second."""
    monkeypatch.setattr(evaluator, "EPISODES", 8)
    made = job(tmp_path, updates=2)
    ppo = replace(made.settings.algorithm, steps=16, minibatch=128, epochs=2, hidden=(16, 16))
    return replace(made, settings=replace(made.settings, algorithm=ppo, worlds=32))


def test_settings_seed_and_updates_are_those_of_the_shipped_policy(tmp_path):
    shipped = job(tmp_path)
    row = next(each for each in load_policy_table().policies if (each.robot, each.task) == (ROBOT, TASK))
    assert (shipped.updates, shipped.seed, shipped.episodes) == (row.updates, row.seed, 0)
    assert shipped.settings.scenario == "uncertain"
    assert shipped.bundle == tmp_path / "bundles" / f"{ROBOT}_{TASK}"
    assert job(tmp_path, updates=20).updates == 20
    assert job(tmp_path, updates=20).out != shipped.out


def test_without_a_shipped_policy_the_updates_are_those_of_one_like_it(tmp_path):
    assert job(tmp_path, "modular_freeflyer", "go_to_pose").updates > 0


def test_a_kind_without_any_policy_asks_for_the_updates(tmp_path, monkeypatch):
    monkeypatch.setattr(advice, "usual_training", lambda robot, task: None)
    with pytest.raises(ConfigError, match="Give --updates N"):
        job(tmp_path, "modular_freeflyer", "go_to_pose")


@pytest.mark.slow
def test_it_ends_with_a_bundle_and_is_not_done_twice(small):
    found = train_bundle(small)
    assert found["sha256"] == read_passport(small.bundle).sha256
    assert (found["updates"], found["steps"]) == (2, 2 * 16 * 32)
    assert train_bundle(small) == found


def test_a_training_that_the_user_stops_stops_the_twin(small, monkeypatch):
    monkeypatch.setattr(jobs, "run_job", lambda job, watcher: {"interrupted": True})
    with pytest.raises(KeyboardInterrupt):
        train_bundle(small)
