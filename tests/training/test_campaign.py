"""Several runs at once: each in a process of its own, one that fails stops no other, the best is named."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.seeds import EVALUATION_SEED
from fulmar_core.robots.calibration import calibration_path
from tests.ray_cluster import two_nodes
from training.campaign import CAMPAIGN_FILE, run_campaign, summarised
from training.executors import LocalExecutor
from training.jobs import Job, Outcome, run_job
from training.ray_executor import RayExecutor
from training.run_folder import NETWORK_FILE, read_run_record


@pytest.fixture
def job(small_settings, tmp_path):
    """A run of two small updates."""
    return Job("one", "floating_platform", "go_to_pose", 1, small_settings, tmp_path / "one", updates=2)


def with_seed(job, seed):
    return replace(job, name=f"seed {seed}", seed=seed, out=job.out.parent / str(seed))


class Quiet:
    def begin(self): ...

    def advance(self, share, elapsed_s, steps): ...

    def evaluated(self, elapsed_s, success): ...

    def end(self): ...


@pytest.mark.slow
def test_a_campaign_runs_every_seed_reports_the_one_that_fails_and_names_the_best(job, tmp_path):
    watched = []
    jobs = [with_seed(job, seed) for seed in (1, EVALUATION_SEED, 2)]
    result = run_campaign(jobs, LocalExecutor(2), tmp_path, lambda *args: watched.append(args))
    assert json.loads((tmp_path / CAMPAIGN_FILE).read_text()) == result
    assert [line["seed"] for line in result["seeds"]] == [1, EVALUATION_SEED, 2]
    assert result["failed"] == 1
    assert "are reserved for evaluation" in result["seeds"][1]["error"]
    assert result["best_seed"] in (1, 2)
    assert read_run_record(Path(result["best_run"]))["updates"] == 2
    states = {number: state for number, state, _ in watched}
    assert states == {0: "done", 1: "failed", 2: "done"}


class Pretended:
    """A process that has ended when it is looked at for the second time."""

    looks = 0

    def poll(self):
        self.looks += 1
        return 0 if self.looks > 1 else None


def test_no_more_runs_than_cores_go_on_at_once(job, monkeypatch):
    begun, busy = [], []

    def start(_job):
        begun.append(Pretended())
        busy.append(sum(process.looks < 2 for process in begun))
        return begun[-1]

    monkeypatch.setattr("training.executors._start", start)
    monkeypatch.setattr("training.executors._outcome", lambda job, code: Outcome(job, {}))
    monkeypatch.setattr("training.executors.POLL_S", 0.0)
    assert len(LocalExecutor(2).run([job] * 5, lambda *_: None)) == 5
    assert busy == [1, 2, 1, 2, 1]


@pytest.mark.slow
def test_a_process_whose_parent_dies_finishes_its_run(job):
    waits = """
import pickle, subprocess, sys, time
from training.executors import _start
process = _start(pickle.load(sys.stdin.buffer))
print(process.pid, flush=True)
time.sleep(600)
"""
    long = replace(job, updates=10**9)
    import pickle

    parent = subprocess.Popen([sys.executable, "-c", waits], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    pickle.dump(long, parent.stdin)
    parent.stdin.flush()
    deadline = time.monotonic() + 60.0
    while not (long.out / "progress.json").is_file() and time.monotonic() < deadline:
        time.sleep(0.1)
    parent.kill()
    parent.wait()
    while not (long.out / "run.json").is_file() and time.monotonic() < deadline:
        time.sleep(0.1)
    assert read_run_record(long.out)["interrupted"] is True


def test_a_job_that_was_done_is_not_done_again(job):
    first = run_job(job, Quiet())
    stamp = (job.out / "network.pt").stat().st_mtime_ns
    assert run_job(job, Quiet()) == first
    assert (job.out / "network.pt").stat().st_mtime_ns == stamp


@pytest.mark.slow
def test_a_job_goes_on_where_it_was_interrupted_then_evaluates_and_exports(job, tmp_path):
    run_job(job, Quiet())
    record = read_run_record(job.out)
    (job.out / "run.json").write_text(json.dumps(record | {"interrupted": True}))
    more = replace(job, updates=3, episodes=2, bundle=tmp_path / "bundle", recipe="abc")
    done = run_job(more, Quiet())
    assert done["updates"] == 3
    assert done["mujoco"]["episodes"] == 2
    assert json.loads((tmp_path / "bundle" / "passport.json").read_text())["training"]["recipe"] == "abc"


def outcome(job, seed, *, held_out, mujoco=None, score=0.0):
    record = {"best": {"success_rate": held_out, "score": score}, "steps": 1, "wall_s": 1.0}
    if mujoco is not None:
        record["mujoco"] = {"success_rate": mujoco}
    return Outcome(with_seed(job, seed), record)


def test_the_best_run_is_the_one_that_does_best_in_mujoco_then_by_score(job):
    result = summarised(
        [
            outcome(job, 1, held_out=1.0, mujoco=0.9, score=2.0),
            outcome(job, 2, held_out=0.9, mujoco=1.0, score=1.0),
            outcome(job, 3, held_out=0.9, mujoco=1.0, score=1.5),
            Outcome(with_seed(job, 4), None, "broke"),
        ]
    )
    assert (result["best_seed"], result["failed"]) == (3, 1)
    assert result["success_mean"] == pytest.approx(2.9 / 3.0)
    assert result["seeds"][3] == {"seed": 4, "run": str(with_seed(job, 4).out), "error": "broke"}


def test_a_campaign_of_failures_has_no_best(job):
    result = summarised([Outcome(job, None, "broke")])
    assert (result["best_seed"], result["success_mean"], result["success_std"]) == (None, None, None)


class Elsewhere:
    """A pool that does its calls here, one after another."""

    def run(self, function, items, *, on_done, watch):
        for index, item in enumerate(items):
            watch({index: {"share": 0.5}})
            try:
                on_done(index, function(*item))
            except ConfigError as error:
                on_done(index, error)


def test_run_folder_bundle_and_calibration_go_to_another_machine_and_come_back(job, tmp_path, monkeypatch):
    seen = []

    def learned(moved, notes):
        seen.append((moved.out, (moved.out / "checkpoint").read_text(), calibration_path().read_text()))
        (moved.out / "deeper").mkdir()
        (moved.out / "deeper" / "curve").write_text("1")
        moved.bundle.mkdir()
        (moved.bundle / "passport.json").write_text("{}")
        return {"best": {"success_rate": 1.0}}

    monkeypatch.setattr("training.ray_executor.run_job", learned)
    calibration = tmp_path / "measured.yaml"
    calibration.write_text("mass")
    monkeypatch.setenv("FULMAR_CALIBRATION", str(calibration))
    job = replace(job, bundle=tmp_path / "bundle")
    job.out.mkdir()
    (job.out / "checkpoint").write_text("half done")
    watched = []
    (outcome,) = RayExecutor(pool=Elsewhere()).run([job], lambda *each: watched.append(each))
    (there, checkpoint, measured) = seen[0]
    assert there != job.out and not there.exists()
    assert (checkpoint, measured) == ("half done", "mass")
    assert outcome.record == {"best": {"success_rate": 1.0}}
    assert (job.out / "deeper" / "curve").read_text() == "1"
    assert (job.bundle / "passport.json").is_file()
    assert watched == [(0, "running", {"share": 0.5}), (0, "done", {})]
    assert calibration_path() == calibration


def test_a_job_that_fails_on_a_cluster_is_an_outcome_and_leaves_nothing(job):
    reserved = with_seed(job, EVALUATION_SEED)
    (outcome,) = RayExecutor(pool=Elsewhere()).run([reserved], lambda *_: None)
    assert outcome.record is None
    assert "are reserved for evaluation" in outcome.error
    assert not reserved.out.exists()


@pytest.mark.slow
@pytest.mark.timeout(300)
@pytest.mark.skipif(sys.version_info >= (3, 14), reason="Ray has no wheels for Python 3.14")
def test_a_campaign_on_two_nodes_of_a_ray_cluster_learns_the_same_weights(job, tmp_path):
    with two_nodes() as cluster:
        watched = []
        jobs = [with_seed(job, seed) for seed in (1, 2, EVALUATION_SEED)]
        result = run_campaign(
            jobs, RayExecutor(cluster.address), tmp_path, lambda *args: watched.append(args)
        )
    assert result["failed"] == 1
    assert "are reserved for evaluation" in result["seeds"][2]["error"]
    assert result["best_seed"] in (1, 2)
    for one in jobs[:2]:
        assert read_run_record(one.out)["updates"] == 2
    assert {number: state for number, state, _ in watched} == {0: "done", 1: "done", 2: "failed"}
    here = [replace(one, out=tmp_path / f"here {one.seed}") for one in jobs[:2]]
    LocalExecutor(2).run(here, lambda *_: None)
    for ours, theirs in zip(here, jobs, strict=False):
        assert (ours.out / NETWORK_FILE).read_bytes() == (theirs.out / NETWORK_FILE).read_bytes()
