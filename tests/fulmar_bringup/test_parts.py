"""A trial in parts, by several processes, gives what one process does."""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import sys
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import psutil
import pytest

from fulmar_bringup import parts
from fulmar_bringup.evaluation import Trial, runs_of, runs_of_part
from fulmar_bringup.node_table import RunPlan
from fulmar_bringup.parts import runs_by_parts
from fulmar_core.errors import RunFailed
from fulmar_core.metrics import join

PLAN = RunPlan(
    robot="kingfisher",
    task="go_through_positions",
    controller="classical",
    backend="mujoco",
    control_hz=10.0,
    policy="",
    scenario="nominal",
    seed=5,
    duration_s=6.0,
    lockstep=True,
)


@pytest.mark.parametrize("through", ["batch", "mujoco"])
def test_parts_make_the_whole_and_progress_comes_to_its_end(through):
    trial, told = Trial(PLAN, through, 5, jobs=2), []
    whole = join(list(runs_of(replace(trial, jobs=1))))
    in_parts = list(runs_by_parts(trial, 2, told.append))
    assert [len(run.x) for run in in_parts] == [2, 2, 1]
    np.testing.assert_array_equal(join(in_parts).x, whole.x)
    assert told[-1] == whole.x.size
    assert not multiprocessing.active_children()


def test_a_part_begins_at_its_own_number():
    trial = Trial(PLAN, "batch", 4)
    whole = join(list(runs_of(trial)))
    (last,) = runs_of_part(trial, trial.controller(), 3, 1)
    np.testing.assert_array_equal(last.x[0], whole.x[3])


def test_what_is_kept_of_a_trial_that_was_broken_off_is_not_done_again(tmp_path):
    trial = Trial(PLAN, "batch", 5, jobs=2)

    def driven():
        told = []
        run = join(list(runs_by_parts(trial, 2, told.append, tmp_path)))
        assert told[-1] == run.x.size
        return run

    whole = driven()
    files = sorted(tmp_path.iterdir())
    assert len(files) == 3
    again = driven()
    for each in fields(whole):
        np.testing.assert_array_equal(getattr(again, each.name), getattr(whole, each.name))
    assert isinstance(again.control_dt, float)

    cut, moved, gone = files
    cut.write_bytes(cut.read_bytes()[:1000])
    with np.load(moved) as file:
        arrays = dict(file)
    np.savez(moved, **{**arrays, "x": arrays["x"] + 1.0})
    gone.unlink()
    third = driven()
    kept = slice(2, 4)
    np.testing.assert_array_equal(third.x[kept], whole.x[kept] + 1.0)
    np.testing.assert_array_equal(np.delete(third.x, [2, 3], axis=0), np.delete(whole.x, [2, 3], axis=0))


def test_a_process_that_is_ended_from_outside_is_told_and_leaves_none_behind():
    trial = Trial(replace(PLAN, duration_s=600.0), "mujoco", 4, jobs=2)
    ended = []

    def progress(steps):
        if not ended:
            victim = multiprocessing.active_children()[0]
            ended.append(victim.pid)
            victim.kill()

    with pytest.raises(RunFailed, match="ended from outside"):
        list(runs_by_parts(trial, 1, progress))
    assert ended
    assert not multiprocessing.active_children()


ENDLESS = """
import multiprocessing, sys
from dataclasses import replace
from fulmar_bringup.evaluation import Trial
from fulmar_bringup.parts import runs_by_parts
from tests.fulmar_bringup.test_parts import PLAN

def progress(steps):
    print(*(worker.pid for worker in multiprocessing.active_children()), flush=True)

if __name__ == "__main__":
    list(runs_by_parts(Trial(replace(PLAN, duration_s=6000.0), "mujoco", 4, jobs=2), 1, progress))
"""


def test_no_process_outlives_the_one_whose_work_it_does(tmp_path):
    root = Path(__file__).parents[2]
    (tmp_path / "endless.py").write_text(ENDLESS)
    ours = subprocess.Popen(
        [sys.executable, tmp_path / "endless.py"],
        cwd=root,
        env=os.environ | {"PYTHONPATH": os.pathsep.join((str(root), os.environ.get("PYTHONPATH", "")))},
        stdout=subprocess.PIPE,
        text=True,
    )
    assert ours.stdout is not None
    workers = [psutil.Process(int(pid)) for pid in ours.stdout.readline().split()]
    assert len(workers) == 2
    ours.kill()
    ours.wait()
    _, left = psutil.wait_procs(workers, timeout=20.0)
    for worker in left:
        worker.kill()
    assert not left


def test_only_controllers_that_take_few_episodes_at_once_are_judged_in_parts(monkeypatch):
    asked = []
    monkeypatch.setattr(parts, "runs_by_parts", lambda *told: asked.append(told) or iter(()))
    list(runs_of(Trial(PLAN, "batch", 2, jobs=2)))
    assert not asked
    planner = replace(PLAN, controller="planner")
    list(runs_of(Trial(planner, "batch", 2, jobs=2)))
    assert [told[1] for told in asked] == [32]
