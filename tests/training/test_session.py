"""A run between two updates: it resumes exactly, stops when it should, and leaves a finished folder."""

from __future__ import annotations

import errno
import itertools
import os
import signal
from dataclasses import replace

import numpy as np
import pytest
import torch

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from training.checkpoint import load_checkpoint
from training.fast_ppo import FastPPO
from training.run_folder import CHECKPOINT_FILE, SETTINGS_FILE, TENSORBOARD_FOLDER, read_run_record
from training.settings import Annealing, StopAtSuccess, load_training_settings
from training.train import train
from training.vec_env import BatchVecEnv

TURTLEBOT, TASK = load_robot("turtlebot2"), load_task("go_to_pose")


def small(name):
    """Settings of an algorithm, cut to what takes a moment."""
    settings = load_training_settings(TURTLEBOT, TASK, name)
    algorithm = settings.algorithm
    if hasattr(algorithm, "epochs"):
        algorithm = replace(algorithm, steps=8, minibatch=64, epochs=2, hidden=(8,))
    else:
        algorithm = replace(
            algorithm, buffer=2000, minibatch=32, first_steps=64, gradient_steps=2, hidden=(8,)
        )
    if hasattr(algorithm, "memory"):
        algorithm = replace(algorithm, memory=4)
    return replace(settings, algorithm=algorithm, worlds=16, evaluate_every_s=1e6)


def weights(folder, settings):
    """Every number of the learner that a run has left."""
    worlds = BatchVecEnv(TURTLEBOT, TASK, _scenario(settings), worlds=settings.worlds, seed=1)
    learner, _ = load_checkpoint(folder / CHECKPOINT_FILE, settings.algorithm, worlds)
    return learner.policy.state_dict(), learner.get_vec_normalize_env().obs_rms


def _scenario(settings):
    from fulmar_core.worlds.scenario import load_scenario

    return load_scenario(settings.scenario)


@pytest.fixture
def quick_evaluator(monkeypatch):
    """Evaluator without episodes; the success rates come from this list, the last one again and again."""
    rates = [0.5]

    def evaluator_of(*_):
        left = iter(rates)
        last = [rates[0]]

        def evaluate(network):
            last[0] = next(left, last[0])
            return last[0], last[0]

        return evaluate

    monkeypatch.setattr("training.train.held_out_evaluator", evaluator_of)
    return rates


@pytest.mark.parametrize("name", ["differential_drive", "recurrent_ppo", "sac", "td3"])
def test_a_resumed_run_ends_with_the_weights_of_an_uninterrupted_one(tmp_path, quick_evaluator, name):
    settings = small(name)
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    train(TURTLEBOT, TASK, settings, seed=1, out=whole, updates=6)
    first = train(TURTLEBOT, TASK, settings, seed=1, out=parts, updates=3)
    torch.manual_seed(99)
    np.random.seed(99)
    record = train(TURTLEBOT, TASK, settings, seed=1, out=parts, updates=6, resume=True)
    assert record["updates"] == 6
    assert record["cpu_s"] >= first["cpu_s"] > 0.0, "of both parts"
    (expected, statistics), (found, others) = weights(whole, settings), weights(parts, settings)
    for key, value in expected.items():
        assert torch.equal(value, found[key]), key
    np.testing.assert_array_equal(statistics.mean, others.mean)
    assert statistics.count == others.count


def test_another_seed_gives_other_weights(tmp_path, quick_evaluator):
    settings = small("differential_drive")
    for seed in (1, 2):
        train(TURTLEBOT, TASK, settings, seed=seed, out=tmp_path / str(seed), updates=2)
    one, other = (weights(tmp_path / str(seed), settings)[0] for seed in (1, 2))
    assert not all(torch.equal(one[key], other[key]) for key in one)


@pytest.mark.parametrize("second_s", [1e-6, 1e3])
def test_how_fast_the_machine_is_does_not_change_when_a_run_of_updates_is_checked(
    tmp_path, quick_evaluator, monkeypatch, second_s
):
    now = itertools.count()
    monkeypatch.setattr("training.session.time.monotonic", lambda: second_s * next(now))
    settings = replace(small("differential_drive"), evaluate_every_s=3.0, time_limit_s=10.0)
    record = train(TURTLEBOT, TASK, settings, seed=1, out=tmp_path, updates=10)
    assert [check["steps"] for check in record["curve"]] == [3 * 128, 6 * 128, 9 * 128, 10 * 128]


def test_a_resumed_run_is_checked_when_the_uninterrupted_one_is(tmp_path, quick_evaluator):
    settings = replace(small("differential_drive"), evaluate_every_s=4.0, time_limit_s=10.0)
    train(TURTLEBOT, TASK, settings, seed=1, out=tmp_path, updates=5)
    record = train(TURTLEBOT, TASK, settings, seed=1, out=tmp_path, updates=10, resume=True)
    assert [check["steps"] // 128 for check in record["curve"]] == [2, 4, 5, 8, 10]


def test_a_number_of_updates_is_kept(tmp_path, quick_evaluator):
    record = train(TURTLEBOT, TASK, small("differential_drive"), seed=1, out=tmp_path, updates=3)
    assert record["updates"] == 3
    assert record["steps"] == 3 * 8 * 16


def test_a_run_stops_early_once_several_checks_in_a_row_are_good_enough(tmp_path, quick_evaluator):
    quick_evaluator[:] = [0.995, 0.9, 1.0, 0.996, 1.0]
    settings = replace(
        small("differential_drive"), evaluate_every_s=1e-6, stop_at_success=StopAtSuccess(0.995, checks=2)
    )
    record = train(TURTLEBOT, TASK, settings, seed=1, out=tmp_path, updates=50)
    assert [check["success_rate"] for check in record["curve"]] == [0.995, 0.9, 1.0, 0.996]
    assert record["interrupted"] is False


class Impatient:
    """A person who presses Ctrl-C after the second update."""

    def begin(self): ...

    def advance(self, share, elapsed_s, steps):
        if steps == 2 * 8 * 16:
            os.kill(os.getpid(), signal.SIGINT)

    def evaluated(self, elapsed_s, success): ...

    def end(self): ...


def test_ctrl_c_leaves_a_finished_run_that_can_be_resumed(tmp_path, quick_evaluator):
    settings, before = small("differential_drive"), signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        train(TURTLEBOT, TASK, settings, seed=1, out=tmp_path, updates=50, watcher=Impatient())
    assert signal.getsignal(signal.SIGINT) is before
    record = read_run_record(tmp_path)
    assert record["interrupted"] is True
    assert record["updates"] == 2
    again = train(TURTLEBOT, TASK, settings, seed=1, out=tmp_path, updates=4, resume=True)
    assert (again["updates"], again["interrupted"]) == (4, False)


def test_an_interrupted_run_continues_as_an_uninterrupted_one(tmp_path, monkeypatch):
    """What it is worth when it is broken off is looked at, and must not count later."""

    def evaluator_of(*_):
        scores = itertools.count(1.0, -0.1)  # so that the first check of a part is its best one

        def evaluate(network):
            score = next(scores)
            return 0.5, score

        return evaluate

    monkeypatch.setattr("training.train.held_out_evaluator", evaluator_of)
    settings = replace(small("differential_drive"), evaluate_every_s=4.0, time_limit_s=10.0)
    settings = replace(settings, stop_at_success=StopAtSuccess(0.5, checks=2))
    with pytest.raises(KeyboardInterrupt):
        broken = replace(settings, evaluate_every_s=3.9)  # not yet due after two updates
        train(TURTLEBOT, TASK, broken, seed=1, out=tmp_path, updates=10, watcher=Impatient())
    assert [check["steps"] // 128 for check in read_run_record(tmp_path)["curve"]] == [2]
    record = train(TURTLEBOT, TASK, broken, seed=1, out=tmp_path, updates=10, resume=True)
    assert [check["steps"] // 128 for check in record["curve"]] == [4, 8]
    assert record["best"]["steps"] // 128 == 4


@pytest.mark.parametrize("left", ["nothing", "a check"])
def test_a_disk_that_has_no_room_for_a_checkpoint_costs_not_the_network(
    tmp_path, quick_evaluator, monkeypatch, left
):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device", "checkpoint.pkl")

    monkeypatch.setattr("training.session.save_checkpoint", full)
    settings = small("differential_drive")
    if left == "nothing":
        settings = replace(settings, checkpoint_every_s=1e-9)
    with pytest.raises(OSError, match="No space left"):
        train(TURTLEBOT, TASK, settings, seed=1, out=tmp_path, updates=3)
    assert (tmp_path / "network.pt").is_file() is (left == "a check")
    if left == "a check":
        record = read_run_record(tmp_path)
        assert (record["updates"], record["interrupted"]) == (3, True)


def test_annealing_reaches_worlds_and_learner(tmp_path, quick_evaluator, monkeypatch):
    dearer, less, smaller = [], [], []
    monkeypatch.setattr(BatchVecEnv, "set_effort", lambda self, factor: dearer.append(factor))
    monkeypatch.setattr(
        FastPPO,
        "train",
        lambda self: (less.append(self.ent_coef), smaller.append(self.learning_rate.target)),
    )
    annealing = Annealing(0.0, 1.0, 5.0, -0.004, target_kl=0.2)
    settings = replace(small("differential_drive"), annealing=annealing)
    before, target = settings.algorithm.entropy, settings.algorithm.target_kl
    train(TURTLEBOT, TASK, settings, seed=1, out=tmp_path, updates=4)
    assert dearer == pytest.approx([1.0, 2.0, 3.0, 4.0, 5.0])
    assert less == pytest.approx([before + share * (-0.004 - before) for share in (0.0, 0.25, 0.5, 0.75)])
    assert smaller == pytest.approx([target * share for share in (1.0, 0.8, 0.6, 0.4)])


def test_an_annealed_run_keeps_its_last_network(tmp_path, quick_evaluator):
    quick_evaluator[:] = [0.9, 1.0, 0.8, 0.7]
    settings = replace(small("differential_drive"), evaluate_every_s=1e-6)
    kept = [
        train(TURTLEBOT, TASK, each, seed=1, out=tmp_path / name, updates=3)["best"]["success_rate"]
        for name, each in (
            ("plain", settings),
            ("annealed", replace(settings, annealing=Annealing(0.0, 1.0, 1.0, 0.0))),
        )
    ]
    assert kept[0] == 1.0
    assert kept[1] < 0.9


def test_a_run_folder_holds_settings_curves_and_a_checkpoint(tmp_path, quick_evaluator):
    settings = small("differential_drive")
    train(TURTLEBOT, TASK, settings, seed=1, out=tmp_path, updates=2)
    assert load_training_settings(TURTLEBOT, TASK, str(tmp_path / SETTINGS_FILE)) == settings
    assert list((tmp_path / TENSORBOARD_FOLDER).glob("events*"))
    assert (tmp_path / CHECKPOINT_FILE).is_file()


def test_a_checkpoint_of_another_version_is_refused_in_words(tmp_path, quick_evaluator, monkeypatch):
    settings = small("differential_drive")
    train(TURTLEBOT, TASK, settings, seed=1, out=tmp_path, updates=1)
    monkeypatch.setattr(BatchVecEnv, "set_state", lambda self, state: state["something newer"])
    with pytest.raises(ConfigError, match=r"written by another version of Fulmar.*something newer"):
        train(TURTLEBOT, TASK, settings, seed=1, out=tmp_path, updates=2, resume=True)


@pytest.mark.parametrize("content", [None, b"nothing of ours"])
def test_there_must_be_a_checkpoint_to_resume_from(tmp_path, content):
    if content is not None:
        (tmp_path / CHECKPOINT_FILE).write_bytes(content)
    with pytest.raises(ConfigError, match="checkpoint"):
        train(TURTLEBOT, TASK, small("differential_drive"), seed=1, out=tmp_path, updates=2, resume=True)
