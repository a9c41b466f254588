"""DreamerV3's process, played by a shell script: what it is asked, what it says, and how it may fail."""

from __future__ import annotations

import json
import threading
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
import torch

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from tests.training.dreamer_runs import drawn_network
from training import dreamer_process, dreamer_training
from training.dreamer_learning import Session, load_checkpoint
from training.dreamer_process import DreamerError, Learner, dreamer_python
from training.dreamer_request import Request
from training.jobs import Job, run_job
from training.learner_curve import Budget
from training.network import save_network
from training.request import TrainingRequest, job_of
from training.run_folder import CHECKPOINT_FILE, NETWORK_FILE, read_run_record, read_start
from training.settings import load_training_settings

ROBOT, TASK = load_robot("turtlebot2"), load_task("go_to_position")
DONE = {"kind": "done", "steps": 80, "updates": 3, "wall_s": 2.0, "steps_per_s": 40, "interrupted": False,
        "best": {"success_rate": 0.5, "score": 0.5}, "curve": [], "versions": {"sheeprl": "0.8.4"}}  # fmt: skip
ADVANCE = {"kind": "advance", "share": 0.5, "elapsed_s": 1.0, "steps": 40}
EVALUATED = {"kind": "evaluated", "elapsed_s": 1.0, "success": 0.25}


def interpreter(folder: Path, *, sheeprl: str = "0.8.4", says: str = "", code: int = 0) -> Path:
    """A Python of `.venv-dreamer` that does what is asked for here."""
    python = folder / ".venv-dreamer" / "bin" / "python"
    python.parent.mkdir(parents=True, exist_ok=True)
    python.write_text(
        "#!/usr/bin/env bash\n"
        f'if [ "$1" = -c ]; then echo {sheeprl}; exit {0 if sheeprl else 1}; fi\n'
        f'echo "$3" > asked.json\n{says}\nexit {code}\n'
    )
    python.chmod(0o755)
    return python


def says(*reports: dict) -> str:
    return "\n".join(f"echo '{json.dumps(report)}' >&$4" for report in reports)


@pytest.fixture(autouse=True)
def away_from_the_checkout(tmp_path, monkeypatch):
    """The environment of this checkout, if there is one, is not looked at."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(dreamer_process, "CHECKOUT", tmp_path)


@pytest.fixture
def job(tmp_path):
    settings = load_training_settings(ROBOT, TASK, "dreamer")
    run = tmp_path / "run"
    run.mkdir()
    save_network(drawn_network(ROBOT, TASK), run / NETWORK_FILE)  # as the process does
    return Job("mine", "turtlebot2", "go_to_position", 3, settings, run, updates=3, command="fulmar train")


class Seen:
    """A watcher that remembers."""

    def __init__(self) -> None:
        self.said: list[tuple] = []

    def begin(self) -> None:
        self.said.append(("begin",))

    def advance(self, *values: float) -> None:
        self.said.append(("advance", *values))

    def evaluated(self, *values: float) -> None:
        self.said.append(("evaluated", *values))

    def end(self) -> None:
        self.said.append(("end",))


def request(**changes) -> TrainingRequest:
    values = SimpleNamespace(
        robot="turtlebot2", task="go_to_position", seed=1, seeds=1, time_limit_s=None, updates=3,
        stop_at_success=None, settings="dreamer", control_hz=None, out=None, episodes=8, calibration=None,
        resume=None, executor="local", address=None, wandb=False, command="",
    )  # fmt: skip
    return TrainingRequest(**vars(values) | changes)


def test_a_training_leaves_the_record_that_every_other_leaves(job, tmp_path):
    interpreter(tmp_path, says=says(ADVANCE, EVALUATED, DONE))
    seen = Seen()
    record = run_job(job, seen)
    assert record == read_run_record(job.out)
    assert (record["steps"], record["updates"], record["seed"]) == (80, 3, 3)
    assert record["settings"]["algorithm"]["kind"] == "dreamer"
    assert seen.said == [("begin",), ("advance", 0.5, 1.0, 40), ("evaluated", 1.0, 0.25), ("end",)]
    asked = Request.from_json((tmp_path / "asked.json").read_text())
    assert (asked.robot, asked.seed, asked.updates, asked.resume) == ("turtlebot2", 3, 3, False)
    assert read_start(job.out)["updates"] == 3


def test_a_run_with_a_checkpoint_goes_on(job, tmp_path):
    (job.out / CHECKPOINT_FILE).write_bytes(b"content")
    interpreter(tmp_path, says=says(DONE))
    run_job(job, Seen())
    assert Request.from_json((tmp_path / "asked.json").read_text()).resume


def test_an_interrupted_training_is_finished_and_says_so(job, tmp_path):
    interpreter(tmp_path, says=says({**DONE, "interrupted": True}))
    with pytest.raises(KeyboardInterrupt):
        run_job(job, Seen())
    assert read_run_record(job.out)["interrupted"]


def test_a_process_is_asked_to_stop_by_the_end_of_its_input(tmp_path):
    python = interpreter(tmp_path, says=f"{says(ADVANCE)}\ncat > /dev/null\n{says(DONE)}")
    asked = threading.Event()
    with Learner(Request("r", "t", 1, "s", str(tmp_path / "out")), python) as learner:
        done = learner.listen(lambda _: asked.set(), asked.is_set)
    assert done["kind"] == "done"


def test_a_missing_environment_is_named_with_the_command_that_makes_it(tmp_path):
    words = r"\.venv-dreamer/bin/python is missing\. Run: make dreamer"
    with pytest.raises(ConfigError, match=words):
        dreamer_python()
    with pytest.raises(ConfigError, match=words):
        job_of(request(out=tmp_path / "out"))
    assert not (tmp_path / "out").exists(), "nothing began"


@pytest.mark.parametrize(
    ("sheeprl", "words"),
    [("0.8.3", r"has sheeprl 0\.8\.3, 0\.8\.4 is needed"), ("", "has no sheeprl")],
)
def test_another_version_of_sheeprl_is_refused(tmp_path, sheeprl, words):
    interpreter(tmp_path, sheeprl=sheeprl)
    with pytest.raises(ConfigError, match=words + r"\. Run: make dreamer"):
        dreamer_python()


def test_what_fails_gives_the_last_words_of_its_log(job, tmp_path):
    interpreter(tmp_path, says="echo 'RuntimeError: no more memory' >&2", code=1)
    with pytest.raises(DreamerError, match=r"failed: RuntimeError: no more memory\. See .*dreamer\.log"):
        run_job(job, Seen())


def test_what_the_process_refuses_is_the_user_s_mistake(job, tmp_path):
    interpreter(tmp_path, says=says({"kind": "refused", "error": "checkpoint.pkl: is none."}), code=2)
    with pytest.raises(ConfigError, match="is none"):
        run_job(job, Seen())


@pytest.mark.parametrize(
    ("changes", "words"),
    [({"wandb": True}, "--wandb does not take"), ({"executor": "ray", "seeds": 2}, "--ray does not run")],
)
def test_options_that_dreamer_has_no_use_for_are_refused(tmp_path, changes, words):
    interpreter(tmp_path)
    with pytest.raises(ConfigError, match=words):
        job_of(request(out=tmp_path / "out", **changes))


@pytest.mark.parametrize("content", [b"", b"no checkpoint", None, {"fulmar": {"odd": 1}}, {}])
def test_a_broken_checkpoint_is_refused(tmp_path, content):
    path = tmp_path / CHECKPOINT_FILE
    if isinstance(content, dict):
        torch.save(content, path)
    elif content is not None:
        path.write_bytes(content)
    with pytest.raises(
        ConfigError, match=r"checkpoint\.pkl: (is no checkpoint of DreamerV3|no checkpoint to)"
    ):
        load_checkpoint(path)


def test_dreamer_is_for_actuators_that_move_by_degrees_and_for_plain_worlds():
    with pytest.raises(ConfigError, match="dreamer needs actuators that move by degrees"):
        load_training_settings(load_robot("floating_platform"), load_task("go_to_pose"), "dreamer")
    settings = load_training_settings(ROBOT, TASK, "dreamer")
    with pytest.raises(ValueError, match="are not for dreamer"):
        replace(settings, compiled=True)


def test_a_request_is_the_same_after_it_was_sent():
    sent = Request("r", "t", 1, "s", "o", updates=4, budget=Budget(100, 2.0))
    assert Request.from_json(sent.as_json()) == sent


def test_the_process_finds_this_checkout_s_modules_and_none_of_the_folder_it_stands_in():
    variables = dreamer_process._environment()
    assert str(Path(dreamer_training.__file__).parents[1]) in variables["PYTHONPATH"].split(":")
    assert variables["PYTHONSAFEPATH"] == "1"


def test_a_run_that_a_budget_ends_has_no_share_of_limits():
    request = Request("cubesat_8", "follow_pose_3d", 1, "settings.yaml", "out", budget=Budget(10, 1.0, 2, 2))
    assert Session._progress(SimpleNamespace(request=request, elapsed_s=5.0)) == 0.0
