"""Curves go to Weights & Biases when somebody asks for it, also without a network."""

from __future__ import annotations

import math
import subprocess
import sys
import types

import pytest

from training.jobs import Job, learn
from training.progress import WandbCurves


class Quiet:
    def begin(self): ...

    def advance(self, share, elapsed_s, steps): ...

    def evaluated(self, elapsed_s, success): ...

    def end(self): ...


@pytest.fixture
def job(small_settings, tmp_path):
    return Job("mine", "floating_platform", "go_to_pose", 1, small_settings, tmp_path / "run", updates=2)


@pytest.fixture
def recorded(monkeypatch):
    """A stand-in for the package that records its calls."""
    calls = {"logged": [], "finished": 0}

    def finish(**_):
        calls["finished"] += 1

    run = types.SimpleNamespace(
        log=lambda numbers, step: calls["logged"].append((step, numbers)), finish=finish
    )

    def init(**settings):
        calls["settings"] = settings
        return run

    monkeypatch.setitem(sys.modules, "wandb", types.SimpleNamespace(init=init))
    return calls


def test_every_number_that_is_logged_is_sent_and_the_run_is_ended(recorded, job):
    from dataclasses import replace

    learn(replace(job, wandb="fulmar"), Quiet())
    settings = recorded["settings"]
    assert (settings["project"], settings["name"], settings["dir"]) == ("fulmar", "mine", str(job.out))
    assert settings["config"]["worlds"] == job.settings.worlds
    names = {name for _, numbers in recorded["logged"] for name in numbers}
    assert {"train/approx_kl", "train/value_loss", "time/fps"} <= names
    assert all(math.isfinite(value) for _, numbers in recorded["logged"] for value in numbers.values())
    steps = [step for step, _ in recorded["logged"]]
    assert steps == sorted(steps)
    assert recorded["finished"] == 1


@pytest.mark.slow
def test_nobody_who_does_not_ask_imports_it():
    code = "import sys, training.train, training.jobs; sys.exit('wandb' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False, timeout=100).returncode == 0


@pytest.mark.slow
def test_without_a_network_the_curves_stay_in_the_run_folder(tmp_path, monkeypatch):
    for name, value in {"WANDB_MODE": "offline", "WANDB_SILENT": "true", "WANDB_DIR": str(tmp_path)}.items():
        monkeypatch.setenv(name, value)
    curves = WandbCurves(tmp_path / "run", project="fulmar", name="mine", settings={"worlds": 1})
    curves.write({"train/loss": 0.5, "text": "left out"}, {}, step=3)
    curves.close()
    assert list((tmp_path / "run" / "wandb").glob("offline-run-*/*.wandb"))
