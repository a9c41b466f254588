"""The parts of the benchmark: the thesis' figures, what is required, what is kept, and who drives."""

from __future__ import annotations

import dataclasses
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fulmar_benchmarks import outcomes as kept
from fulmar_benchmarks import pool, results
from fulmar_benchmarks import unit as units
from fulmar_benchmarks.campaign import measured
from fulmar_benchmarks.outcomes import code_hash, keys_of
from fulmar_benchmarks.pairs import cells_of, find_pair
from fulmar_benchmarks.results import QUANTILES, PairResult, outcome_of
from fulmar_benchmarks.roboran.campaign import document_of
from fulmar_benchmarks.roboran.targets import LEAST, ROBOTS, TABLE, TASKS, checks_of, main_figure, thesis_row
from fulmar_evaluation import bounds
from fulmar_evaluation.success_interval import wilson
from policy_server.controllers import policies_directory

GOOD = {"batch": 0.995, "mujoco": 0.992}


def unit_of(
    folder, *, controller="classical", robot="floating_platform", task="go_to_pose", way="batch", episodes=3
):
    pair = find_pair(robot, task, controller)
    (cell,) = cells_of(pair, {way: episodes}, seed=7, scenario="nominal", bounds=folder, worlds=64)
    return cell


def key_of(cell):
    (key,) = keys_of([cell]).values()
    return key


def test_the_thesis_times_are_control_steps_and_ours_are_seconds():
    times = [row.time_to_target_s for row in TABLE.values() if row.time_to_target_s is not None]
    assert len(times) == 9
    assert 5.0 < min(times) < max(times) < 20.0, "episodes last 60 s at most"
    assert thesis_row("leatherback", "go_to_pose").success is None


def test_something_is_required_of_every_pair_of_the_benchmark():
    assert all(0.7 < LEAST[task][robot] < 1.0 for task in TASKS for robot in ROBOTS)
    assert main_figure("go_through_positions") == "share_of_bound"
    assert main_figure("go_to_pose") == "success_rate"


@pytest.mark.parametrize(
    ("changed", "unmet"),
    [
        ({}, set()),
        ({"batch": 0.985, "mujoco": 0.985}, {"batch", "mujoco"}),
        ({"batch": 1.0, "mujoco": 0.979}, {"mujoco", "batch_minus_mujoco"}),
    ],
)
def test_a_pair_is_compared_with_every_requirement(changed, unmet):
    found = checks_of("floating_platform", "go_to_pose", GOOD | changed, same=True, training_s=59.0)
    assert {one.name for one in found if one.met is False} == unmet
    assert {one.name for one in found} == {
        "batch", "mujoco", "batch_minus_mujoco", "same_at_64_worlds", "training_s",
    }  # fmt: skip


def test_platform_poses_train_within_a_minute_and_other_pairs_within_five():
    for robot, seconds, met in (
        ("floating_platform", 61.0, False),
        ("kingfisher", 61.0, True),
        ("kingfisher", 301.0, False),
    ):
        found = checks_of(robot, "go_to_pose", GOOD, same=True, training_s=seconds)
        assert found[-1].met is met


def test_what_was_not_measured_is_neither_met_nor_unmet():
    found = checks_of("kingfisher", "go_to_pose", {"batch": 0.95}, same=None, training_s=None)
    assert {one.name: one.met for one in found} == {
        "batch": True,
        "mujoco": None,
        "batch_minus_mujoco": None,
        "same_at_64_worlds": None,
    }
    assert checks_of("jetbot", "go_to_pose", GOOD, same=True, training_s=1.0) == []


def test_the_interval_of_a_share_holds_it_and_shrinks_with_episodes():
    low, high = wilson(0.95, 256)
    assert low < 0.95 < high
    assert wilson(0.95, 4096)[0] > low
    assert wilson(1.0, 4096) == (pytest.approx(0.99906, abs=1e-5), 1.0)


def test_an_outcome_is_read_as_it_was_written(tmp_path):
    unit = unit_of(tmp_path)
    reported = []
    outcome = unit.result(reported.append)
    again = outcome_of(kept.keep(tmp_path / "one.npz", "key", dict(vars(outcome))))
    for field in dataclasses.fields(PairResult):
        value, other = getattr(outcome, field.name), getattr(again, field.name)
        if field.name == "figures":
            assert list(value) == list(other)
            for name in value:
                np.testing.assert_array_equal(value[name], other[name])
        elif field.name == "about":
            assert value == other
        else:
            np.testing.assert_array_equal(value, other)
    assert outcome.over_time.shape == (len(QUANTILES), 300)
    assert outcome.paths.shape == (3, 300, 3)
    assert reported[-1] == unit.cost == 3 * 300
    assert outcome.about["same_at_64_worlds"] is True


def test_an_outcome_counts_only_for_what_it_was_made_of(tmp_path, monkeypatch):
    unit = unit_of(tmp_path)
    assert key_of(unit) == key_of(unit)
    assert key_of(replace(unit, trial=replace(unit.trial, episodes=4))) != key_of(unit)
    assert key_of(replace(unit, defines="another controller")) != key_of(unit)


def test_what_was_evaluated_before_is_taken_from_its_file_unless_it_is_asked_anew(tmp_path, monkeypatch):
    monkeypatch.setattr("fulmar_benchmarks.pool.POOL", "")
    known = []
    for fresh in (False, False, True):
        given = {"folder": tmp_path, "jobs": 1, "fresh": fresh}
        measured([unit_of(tmp_path)], **given, on_done=lambda cell, figures, before: known.append(before))
    assert known == [False, True, False]


def test_an_outcome_does_not_depend_on_where_the_policy_lies(tmp_path):
    unit = unit_of(tmp_path)
    elsewhere = replace(unit, trial=replace(unit.trial, plan=replace(unit.trial.plan, policy="/else/where")))
    assert key_of(elsewhere) == key_of(unit)


def test_small_batches_give_the_same_numbers(tmp_path):
    unit = unit_of(tmp_path, robot="turtlebot2", episodes=units.FEW_WORLDS + 6)
    outcome = unit.result()
    assert outcome.about["same_at_64_worlds"] is True
    assert outcome.about["compared_episodes"] == units.FEW_WORLDS + 6


def test_waypoints_are_counted_over_an_episode_over_a_thousand_steps_and_over_as_long_as_the_thesis(tmp_path):
    unit = unit_of(tmp_path, task="go_through_positions", episodes=2)
    outcome = unit.result()
    figures = outcome.figures
    assert outcome.over_time.shape[1] == 1000
    assert outcome.paths.shape[1] == 300, "60 s at 5 Hz"
    assert np.all(figures["goals_reached"] <= figures["goals_in_100_s"])
    assert np.all(figures["goals_in_100_s"] <= figures["goals_in_1000_steps"])
    np.testing.assert_allclose(figures["share_of_bound"], figures["goals_reached"] / figures["goals_bound"])
    assert np.all(figures["share_of_bound"] <= 1.0)
    assert outcome.about["thousand_steps_s"] == 200.0


@pytest.mark.slow
def test_a_bound_is_computed_once_and_kept(tmp_path, monkeypatch):
    trial = unit_of(tmp_path, robot="turtlebot2", task="go_through_positions").trial
    drawn = trial.drawn(np.arange(2))
    first = results.cached_bound(trial, drawn, 5.0, tmp_path)
    monkeypatch.setattr(results, "waypoint_bound", lambda *_: pytest.fail("computed again"))
    again = results.cached_bound(trial, drawn, 5.0, tmp_path)
    np.testing.assert_array_equal(again.goals, first.goals)
    np.testing.assert_array_equal(again.goals_at_top_speed, first.goals_at_top_speed)
    assert (again.name, again.rule) == (first.name, first.rule)
    with pytest.raises(pytest.fail.Exception):
        results.cached_bound(trial, drawn, 6.0, tmp_path)


def test_the_hash_of_the_code_knows_the_simulator_only_where_it_is_used():
    assert code_hash("batch") == code_hash("batch")
    assert code_hash("batch") != code_hash("mujoco")


@pytest.mark.parametrize("library", ["numpy", "onnxruntime", "mujoco"])
def test_the_hash_of_the_code_knows_which_libraries_computed(library, monkeypatch):
    before, version = code_hash("mujoco"), kept.version
    monkeypatch.setattr(kept, "version", lambda name: "another" if name == library else version(name))
    assert code_hash("mujoco") != before


def test_a_pair_without_anybody_says_why(tmp_path):
    assert find_pair("jetbot", "push_block", "policy", tmp_path).reason == "no policy is shipped"
    assert "no classical law does 'push_block'" in find_pair("jetbot", "push_block", "classical").reason


@pytest.mark.parametrize(("met", "counted"), [(True, (1, 1, 0)), (None, (1, 0, 1)), (False, (1, 0, 0))])
def test_only_what_a_policy_drives_counts_as_asked(met, counted):
    policy = {"robot": "kingfisher", "task": "go_to_pose", "kind": "policy", "status": "judged", "met": met}
    entries = [policy, {**policy, "kind": "classical", "met": None}]
    document = document_of(entries, episodes={"batch": 1}, seed=1, scenario="nominal")
    assert (document["asked"], document["met"], document["open"]) == counted


def test_a_damaged_bundle_is_missing_with_its_reason(tmp_path):
    name = "floating_platform_go_to_pose"
    shutil.copytree(policies_directory() / name, tmp_path / name)
    assert not find_pair("floating_platform", "go_to_pose", "policy", tmp_path).missing
    (tmp_path / name / "policy.onnx").write_bytes(b"")
    pair = find_pair("floating_platform", "go_to_pose", "policy", tmp_path)
    assert pair.missing
    assert "not the one that was exported" in pair.reason


def test_the_fault_of_one_cell_is_a_sentence_and_costs_no_other(tmp_path, monkeypatch):
    def broken(unit, progress, pool=None):
        raise RuntimeError("it broke")

    unit = unit_of(tmp_path, way="ros", episodes=1)
    monkeypatch.setattr(units.TrialCell, "measure", broken)
    seen = []
    pool.measure_all(
        [unit], jobs=1, progress=lambda done: None, on_done=lambda *reported: seen.append(reported)
    )
    assert seen == [(unit, "RuntimeError: it broke")]


def test_the_hash_of_the_code_knows_the_bounds_that_figures_are_shares_of(monkeypatch):
    bound = Path(str(bounds.__file__)).parent / "time_optimal.py"
    before, read = code_hash("batch"), Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", lambda path: read(path) + (b"#" if path == bound else b""))
    assert code_hash("batch") != before
