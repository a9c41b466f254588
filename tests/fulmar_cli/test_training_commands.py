"""`fulmar train`, `fulmar policies` and `fulmar benchmark training`: what is asked for, and what is reported."""

from __future__ import annotations

import contextlib
import io
import json
import sys
from dataclasses import replace

import pytest
import typer
from rich.console import Console
from typer.testing import CliRunner

pytest.importorskip("stable_baselines3")

from fulmar_benchmarks.catalogue import rows
from fulmar_cli.commands.benchmark_row import command_of
from fulmar_cli.commands.policies import policies
from fulmar_cli.commands.train import train
from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.calibration import Calibration, Measured, calibration_path, save_calibration
from training.jobs import Outcome
from training.progress import LearningBar
from training.run_folder import learning_in, read_start, write_start
from training.settings import StopAtSuccess

training = command_of(rows()["training"])
PLATFORM = ("floating_platform", "go_to_pose")


@pytest.fixture
def asked(monkeypatch):
    """Jobs that commands wanted to run; nothing is run, and seed 2 fails."""
    jobs = []

    def run(self, some, watch):
        jobs.extend(some)
        return [_outcome(job) for job in some]

    monkeypatch.setattr("training.executors.LocalExecutor.run", run)
    return jobs


def _outcome(job):
    if job.seed == 2:
        return Outcome(job, None, "no memory left")
    record = {
        "seed": job.seed,
        "best": {"success_rate": 0.9, "score": 1.0},
        "mujoco": {"success_rate": 0.8 + job.seed / 100.0},
        "steps": 1000,
        "wall_s": 2.0,
        "steps_per_s": 500,
        "curve": [{"wall_s": 4.0, "success_rate": 0.95}],
    }
    return Outcome(job, record)


def call(command, *words):
    app = typer.Typer()
    app.command()(command)
    result = CliRunner().invoke(app, [str(word) for word in words])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout


def test_a_campaign_is_one_job_for_each_seed_and_the_best_is_named(asked, tmp_path):
    code, reported = call(
        train, *PLATFORM, "--seeds", 2, "--seed", 3, "--out", tmp_path / "c", "--updates", 7
    )
    assert code == 0
    assert [(job.seed, job.updates, job.episodes) for job in asked] == [(3, 7, 256), (4, 7, 256)]
    assert [job.out.name for job in asked] == ["seed_3", "seed_4"]
    assert "best: seed 4" in reported
    assert f"fulmar export {tmp_path / 'c' / 'seed_4'}".replace(" ", "") in "".join(reported.split())


def test_a_seed_that_fails_is_reported_and_the_command_fails(asked, tmp_path):
    code, reported = call(train, *PLATFORM, "--seeds", 3, "--out", tmp_path / "c")
    assert code == 1
    assert "2  failed: no memory left" in reported
    code, reported = call(train, *PLATFORM, "--seeds", 2, "--out", tmp_path / "d", "--json")
    assert code == 1
    assert json.loads(reported)["failed"] == 1


def test_one_task_after_another_prints_what_was_kept_and_what_to_do_next(monkeypatch, tmp_path):
    def learn(plan, watcher_of, advance):
        rates = {"go_to_pose": 0.75, "track_velocities": 1.0}
        stages = [
            {
                "task": task,
                "training": {"mujoco": 1.0},
                "episodes": plan.episodes,
                "mujoco": dict(list(rates.items())[: number + 1]),
            }
            for number, task in enumerate(plan.tasks)
        ]
        return replace(plan, stages=tuple(stages))

    monkeypatch.setattr("training.continual.learn_tasks", learn)
    words = (*PLATFORM, "--continue-with", "track_velocities", "--out", tmp_path / "c", "--episodes", 8)
    code, reported = call(train, *words)
    assert code == 0
    assert "track_velocities       0.750             1.000         8" in reported
    assert "fulmar train --resume" in reported
    code, reported = call(train, *words, "--json")
    assert json.loads(reported)["stages"][1]["mujoco"] == {"go_to_pose": 0.75, "track_velocities": 1.0}


def test_a_run_of_several_tasks_is_resumed_as_such(monkeypatch, tmp_path):
    plans = []
    monkeypatch.setattr("training.continual.learn_tasks", lambda plan, *_: plans.append(plan) or plan)
    call(train, *PLATFORM, "--continue-with", "track_velocities", "--out", tmp_path / "c", "--updates", 7)
    plans[0].write()
    call(train, "--resume", tmp_path / "c")
    assert (plans[1].tasks, plans[1].updates) == (("go_to_pose", "track_velocities"), 7)


@pytest.mark.parametrize(
    ("words", "reported"),
    [
        ((*PLATFORM, "--continue-with", "go_to_pose"), "'go_to_pose' is learned already"),
        ((*PLATFORM, "--continue-with", "go_to_positon"), "go_to_position"),
        ((), "ROBOT and TASK are needed, or --resume RUN"),
        (("floating_platform",), "ROBOT and TASK are needed"),
        ((*PLATFORM, "--executor", "slurm"), "--executor slurm: must be local or ray"),
        ((*PLATFORM, "--settings", "sac"), "sac needs actuators that move by degrees"),
        (("--resume", "/nowhere"), "/nowhere: no training run to resume"),
        ((*PLATFORM, "--resume", "/nowhere"), "goes on with what the run began with; leave ROBOT"),
        (("--resume", "/nowhere", "--seed", 9), "leave ROBOT, TASK, --seed"),
        (("--resume", "/nowhere", "--out", "/elsewhere"), "leave ROBOT, TASK, --seed"),
        ((*PLATFORM, "--executor", "ray"), "are for campaigns: give --seeds N"),
        ((*PLATFORM, "--executor", "ray", "--address", "nowhere:1"), "are for campaigns: give --seeds N"),
        ((*PLATFORM, "--seeds", "2", "--address", "nowhere:1"), "give --ray ADDRESS alone"),
        ((*PLATFORM, "--seeds", "2", "--ray", "a:1", "--address", "b:1"), "both name a cluster"),
        ((*PLATFORM, "--ray", "nowhere:1"), "are for campaigns: give --seeds N"),
        ((*PLATFORM, "--stop-at-success", 0), "must be greater than 0"),
        ((*PLATFORM, "--seeds", 3, "--seed", 2025), "seed 2026 must not be negative, nor"),
    ],
)
def test_what_cannot_be_trained_is_reported(words, reported):
    with pytest.raises(ConfigError, match=reported):
        call(train, *words)


@pytest.mark.skipif(sys.version_info >= (3, 14), reason="Ray has no wheels for Python 3.14")
@pytest.mark.parametrize("command", ["train", "policies", "benchmark training"])
def test_a_cluster_that_does_not_answer_is_refused_before_anything_is_made(command, fulmar, tmp_path):
    words = {
        "train": [*PLATFORM, "--seeds", 2, "--out", tmp_path / "out"],
        "policies": ["floating_platform_go_to_pose", "--out", tmp_path / "out"],
        "benchmark training": [*PLATFORM, "--out", tmp_path / "out"],
    }[command]
    code, _, said = fulmar(*command.split(), *words, "--ray", "127.0.0.1:1")
    assert code == 2
    assert "Ray address 127.0.0.1:1 does not answer" in said.splitlines()[-1]
    assert not (tmp_path / "out").exists()


@pytest.fixture
def learned(monkeypatch):
    """Jobs that were learned in this process; nothing is learned."""
    jobs = []

    def learn(job, watcher):
        jobs.append(job)
        return {"steps": 1000, "wall_s": 2.0}

    monkeypatch.setattr("training.jobs.learn", learn)
    monkeypatch.setattr(
        "training.evaluator.evaluate_in_mujoco", lambda run, episodes: {"success_rate": 0.875}
    )
    return jobs


def test_where_a_run_lies_is_said_once_when_it_begins(capsys, tmp_path):
    bar = LearningBar(tmp_path / "run")
    for _ in ("the fallback", "the rest"):
        bar.begin()
        bar.end()
    assert capsys.readouterr().err.count(f"run folder: {tmp_path / 'run'}\n") == 1


@pytest.mark.parametrize(
    ("left", "reported"),
    [
        ((), set()),
        (("checkpoint.pkl",), {"--resume"}),
        (("checkpoint.pkl", "run.json", "network.pt"), {"--resume", "export"}),
    ],
    ids=["at once", "before anything was checked", "in order"],
)
def test_a_run_that_is_broken_off_says_how_to_go_on_with_it(monkeypatch, tmp_path, left, reported):
    run, said = tmp_path / "run", io.StringIO()

    def broken_off(job, watcher):
        for name in left:
            (run / name).write_bytes(b"")
        raise KeyboardInterrupt

    monkeypatch.setattr("training.jobs.learn", broken_off)
    monkeypatch.setattr("fulmar_bringup.console.console", Console(file=said, width=500))
    assert call(train, *PLATFORM, "--out", run)[0] != 0
    offers = {"--resume": f"fulmar train --resume {run}", "export": f"fulmar export {run} --out"}
    assert {word for word, offer in offers.items() if offer in said.getvalue()} == reported


def test_a_single_run_is_learned_here_and_evaluated(learned, tmp_path):
    words = (*PLATFORM, "--time-limit", 30, "--stop-at-success", 0.99, "--out", tmp_path / "run")
    code, reported = call(train, *words, "--episodes", 16)
    assert code == 0
    (job,) = learned
    assert (job.time_limit_s, job.settings.stop_at_success) == (30.0, StopAtSuccess(0.99))
    assert "success 0.875 of 16 episodes in MuJoCo" in reported


@pytest.mark.parametrize(
    ("more", "line"),
    [
        ((), "to end it once the task is learned: --stop-at-success 0.99"),
        (("--stop-at-success", 0.9), "ends early after 2 checks in a row with success 0.9 or more"),
    ],
    ids=["offered", "asked for"],
)
def test_training_says_when_it_ends_early(learned, monkeypatch, tmp_path, more, line):
    printed = io.StringIO()
    monkeypatch.setattr("fulmar_bringup.console.console", Console(file=printed, width=500))
    assert call(train, *PLATFORM, *more, "--out", tmp_path / "run")[0] == 0
    assert line in printed.getvalue()


def test_the_rate_of_the_commands_may_be_another_than_the_robot_s(learned, tmp_path):
    from fulmar_core.robots.robot_file import load_robot

    assert call(train, *PLATFORM, "--control-hz", 50, "--out", tmp_path / "run")[0] == 0
    (job,) = learned
    assert job.settings.learner_of(load_robot(job.robot)).timing.control_hz == 50.0
    with pytest.raises(ConfigError, match="must divide the physics rate"):
        call(train, *PLATFORM, "--control-hz", 7, "--out", tmp_path / "other")
    with pytest.raises(ConfigError, match="--resume"):
        call(train, "--resume", tmp_path / "run", "--control-hz", 50)


def test_a_run_is_resumed_with_the_settings_and_limits_it_began_with(learned, tmp_path):
    from fulmar_core.robots.robot_file import load_robot
    from fulmar_core.tasks import load_task
    from training.settings import load_training_settings, write_training_settings

    settings = load_training_settings(load_robot("turtlebot2"), load_task("go_to_pose"), "td3")
    write_training_settings(settings, tmp_path / "settings.yaml")
    start = {"robot": "turtlebot2", "task": "go_to_pose", "seed": 5, "time_limit_s": 90.0, "updates": None}
    write_start(tmp_path, start)
    assert call(train, "--resume", tmp_path)[0] == 0
    assert call(train, "--resume", tmp_path, "--updates", 9)[0] == 0
    same, longer = learned
    assert (same.robot, same.seed, same.settings, same.out) == ("turtlebot2", 5, settings, tmp_path)
    assert (same.time_limit_s, same.updates) == (90.0, None)
    assert (longer.time_limit_s, longer.updates) == (None, 9)
    assert read_start(tmp_path) == start | {
        "time_limit_s": None,
        "updates": 9,
    }  # for who resumes it once more


def test_two_trainings_do_not_learn_in_one_folder(learned, tmp_path):
    test_a_run_is_resumed_with_the_settings_and_limits_it_began_with(learned, tmp_path)
    runs, files = len(learned), set(tmp_path.iterdir())
    with (
        learning_in(tmp_path),
        pytest.raises(ConfigError, match="another `fulmar train` is learning there"),
    ):
        call(train, "--resume", tmp_path)
    assert len(learned) == runs
    assert set(tmp_path.iterdir()) == files


def test_who_comes_second_to_a_folder_does_not_go_on_with_what_the_first_began(
    learned, tmp_path, monkeypatch
):
    from training import run_folder

    @contextlib.contextmanager
    def late(run):
        run.mkdir()
        (run / "start.json").write_text("{}")
        yield

    monkeypatch.setattr(run_folder, "learning_in", late)
    with pytest.raises(ConfigError, match="another training began there"):
        call(train, *PLATFORM, "--out", tmp_path / "run")
    assert not learned


def test_a_run_is_resumed_with_the_calibration_it_began_with_and_no_other(learned, tmp_path, monkeypatch):
    monkeypatch.setenv("FULMAR_CALIBRATION", "")
    kept = tmp_path / "calibration.yaml"
    save_calibration(Calibration("turtlebot2", lag=Measured(0.2, 0.1, 0.3)), kept)
    test_a_run_is_resumed_with_the_settings_and_limits_it_began_with(learned, tmp_path)
    assert calibration_path() == kept
    with pytest.raises(ConfigError, match="leave --calibration out"):
        call(train, "--resume", tmp_path, "--calibration", kept)


def test_a_run_cannot_be_resumed_as_a_campaign(tmp_path, learned):
    test_a_run_is_resumed_with_the_settings_and_limits_it_began_with(learned, tmp_path)
    before = read_start(tmp_path)
    with pytest.raises(ConfigError, match="exclude one another"):
        call(train, "--resume", tmp_path, "--seeds", 2, "--updates", 5)
    assert read_start(tmp_path) == before


def test_a_refused_request_leaves_the_run_that_it_would_resume_as_it_was(tmp_path, learned):
    test_a_run_is_resumed_with_the_settings_and_limits_it_began_with(learned, tmp_path)
    before = read_start(tmp_path)
    with pytest.raises(ConfigError, match="--episodes"):
        call(train, "--resume", tmp_path, "--updates", 5, "--episodes", 10_000_001)
    assert read_start(tmp_path) == before


@pytest.fixture
def passports(monkeypatch):
    """Every bundle says that it succeeded in 0.96 of its episodes."""
    from types import SimpleNamespace

    reported = SimpleNamespace(
        training={"mujoco": {"success_rate": 0.96}, "wall_s": 2.0, "steps": 1000, "recipe": ""}
    )
    monkeypatch.setattr("training.policies.read_passport", lambda folder: reported)


def test_policies_that_reach_less_than_they_have_to_are_reported_and_the_command_fails(
    asked, passports, tmp_path
):
    code, reported = call(policies, "turtlebot2_go_to_position", "kingfisher_go_to_pose", "--out", tmp_path)
    assert code == 1
    assert {job.bundle for job in asked} == {
        tmp_path / "kingfisher_go_to_pose",
        tmp_path / "turtlebot2_go_to_position",
    }
    lines = sorted(reported.splitlines()[1:3])
    assert lines[0].split() == ["kingfisher_go_to_pose", "0.960", "0.90"]
    assert lines[1].split() == ["turtlebot2_go_to_position", "0.960", "0.99", "too", "low"]


def test_policies_can_be_made_one_by_one_and_reported_as_json(asked, passports, tmp_path):
    code, reported = call(policies, "kingfisher_go_to_pose", "--out", tmp_path, "--json")
    assert code == 0
    (line,) = json.loads(reported)["policies"]
    assert (line["policy"], line["made"], line["good"]) == ("kingfisher_go_to_pose", True, True)


def test_anew_puts_the_asked_bundle_aside_and_leaves_the_others(asked, passports, tmp_path):
    bundles, runs = tmp_path / "bundles", tmp_path / "runs"
    for name in ("kingfisher_go_to_pose", "turtlebot2_go_to_pose"):
        (bundles / name).mkdir(parents=True)
        (bundles / name / "policy.onnx").write_text(name)
    code, _ = call(policies, "kingfisher_go_to_pose", "--anew", "--out", bundles, "--runs", runs)
    assert code == 0
    (kept,) = runs.glob("*/bundle/policy.onnx")
    assert kept.read_text() == "kingfisher_go_to_pose"
    assert [folder.name for folder in bundles.iterdir()] == ["turtlebot2_go_to_pose"]


def test_an_unknown_policy_is_reported():
    with pytest.raises(ConfigError, match="has no policy 'kingfisher_go_to_post'"):
        call(policies, "kingfisher_go_to_post")


def test_the_comparison_with_stock_ppo_prints_both_and_fails_if_a_run_does(asked, tmp_path):
    code, reported = call(training, "--seeds", 1, "--seconds", 8, "--out", tmp_path)
    assert code == 0
    assert "fast is 1.0 times as fast as stock" in reported
    assert reported.count("0.950 – 0.950 – 0.950") == 4  # two kinds, two times
    code, reported = call(training, "--seeds", 2, "--seconds", 8, "--out", tmp_path / "again", "--json")
    assert code == 1
    assert json.loads(reported)["failed"] == ["stock 2: no memory left", "fast 2: no memory left"]


def test_runs_that_ended_are_kept_and_those_that_failed_run_again(asked, tmp_path):
    for more in ((), ("--resume",), ("--resume",)):
        call(training, "--seeds", 2, "--seconds", 8, "--out", tmp_path, *more)
    assert [job.seed for job in asked] == [1, 1, 2, 2, 2, 2, 2, 2]


def test_a_training_is_refused_where_its_evaluation_could_not_load_mujoco(monkeypatch, tmp_path):
    monkeypatch.setenv("MUJOCO_GL", "elg")
    with pytest.raises(ConfigError, match="MUJOCO_GL = 'elg'"):
        call(train, *PLATFORM, "--out", tmp_path / "run")
    assert not (tmp_path / "run").exists()
