"""The Python examples of the documentation: short, on README's first screen, and each runs as a user runs it."""

from __future__ import annotations

import importlib
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import RosDomain
from tests.docs.command_lines import ROOT
from tests.fulmar_cli.bag_commands import LQR
from tests.ros.cli import start_fulmar

EXAMPLES = ROOT / "docs/examples"
NAMES = sorted(path.stem for path in EXAMPLES.glob("*.py"))
LONGEST, FIRST = 40, 12  # lines
SCREEN = 30  # lines of README that a reader sees first
real_time = pytest.mark.real_time


@pytest.fixture
def here(tmp_path, monkeypatch):
    """Work in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def text_of(name: str) -> str:
    return (EXAMPLES / f"{name}.py").read_text(encoding="utf-8")


def ran(name: str, *words: str, cwd: Path, env: dict[str, str] | None = None) -> str:
    """What an example prints, run in a process of its own."""
    done = subprocess.run(
        [sys.executable, EXAMPLES / f"{name}.py", *words],
        cwd=cwd, env=env, capture_output=True, text=True, timeout=100, check=False, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def run_here(name: str, *budgets: tuple[str, str], run_name: str = "__main__") -> None:
    """Run an example in this process, with parts of its text replaced by smaller ones."""
    text = text_of(name)
    for part, smaller in budgets:
        assert part in text
        text = text.replace(part, smaller)
    copy = Path(f"{name}.py")
    copy.write_text(text, encoding="utf-8")
    runpy.run_path(str(copy), run_name=run_name)


@pytest.mark.parametrize("name", NAMES)
def test_an_example_is_short_and_all_that_it_imports_exists(name):
    text = text_of(name)
    assert len(text.splitlines()) <= LONGEST
    compile(text, name, "exec")
    for module, names in re.findall(
        r"^from ((?:fulmar|policy_server|sim_nodes)\S*) import (.*)$", text, re.MULTILINE
    ):
        found = importlib.import_module(module)
        assert all(hasattr(found, each.strip()) for each in names.split(",")), module


def test_the_first_example_is_on_the_first_screen_of_readme_as_its_file_has_it():
    lines = text_of("evaluate").splitlines()
    assert len(lines) <= FIRST
    first_screen = "\n".join((ROOT / "README.md").read_text(encoding="utf-8").splitlines()[:SCREEN])
    (shown,) = re.findall(r"^```python\n(.*?)^```$", first_screen, re.MULTILINE | re.DOTALL)
    assert shown == text_of("evaluate")


def test_the_first_example_compares_two_controllers(here, capsys):
    run_here("evaluate")
    assert re.fullmatch(r"lqr: 100% reach .*\npolicy: \d+% reach .*\n", capsys.readouterr().out)


def test_four_lines_of_numpy_steer_a_thousand_robots(here, capsys):
    run_here("simulate")
    assert capsys.readouterr().out.startswith("100% are within 0.1 m")


def test_a_bag_is_arrays(here, capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["read_a_bag.py", str(LQR)])
    run_here("read_a_bag")
    assert capsys.readouterr().out.startswith("floating_platform, go_to_pose, lqr: ")


def test_a_controller_of_a_users_own_reaches_its_goals_in_the_batch(here, capsys, monkeypatch):
    monkeypatch.syspath_prepend(here)
    run_here("own_controller", ('("batch", "mujoco")', '("batch",)'), ("episodes=16", "episodes=4"))
    assert capsys.readouterr().out == "batch: 100% reach the position\n"


def test_an_episode_of_gymnasium_ends(here, capsys):
    pytest.importorskip("gymnasium")
    run_here("gymnasium_episode")
    assert "12 observations, 2 actions" in capsys.readouterr().out


def test_the_plan_of_the_run_from_python_is_a_whole_one(here, capsys, monkeypatch):
    plans = []

    class Outcome:
        summary = {"success": True}  # noqa: RUF012

    monkeypatch.setattr(
        "fulmar_evaluation.run_outcome.run_and_evaluate", lambda plan: plans.append(plan) or Outcome
    )
    run_here("run_over_ros")
    assert (plans[0].backend, plans[0].lockstep, plans[0].record) == ("mujoco", True, "runs/from_python")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("evaluate", ("policy: ",)),
        ("own_controller", ("batch: 100%", "mujoco: 100%")),
        ("simulate", ("100% are within",)),
    ],
)
def test_an_example_runs_as_it_stands(name, words, tmp_path):
    shown = ran(name, cwd=tmp_path)
    assert all(each in shown for each in words)


@pytest.mark.slow
def test_the_run_from_python_meets_its_goal_and_leaves_a_bag(ros_domain: RosDomain, tmp_path):
    assert "goal met: True" in ran("run_over_ros", cwd=tmp_path, env=ros_domain.env)
    assert ran("read_a_bag", "runs/from_python", cwd=tmp_path).startswith("turtlebot2, go_to_pose, policy")


@real_time
@pytest.mark.slow
def test_a_plain_node_sends_a_goal_that_the_robot_reaches(ros_domain: RosDomain, tmp_path):
    up = start_fulmar("up", "--robot", "turtlebot2", env=ros_domain.env, cwd=tmp_path)
    try:
        assert ran("send_a_goal", cwd=tmp_path, env=ros_domain.env).endswith("arrived\n")
    finally:
        up.terminate()
        up.wait(20.0)


@pytest.mark.slow
def test_a_policy_is_learned_exported_and_evaluated_in_mujoco(here, capsys):
    pytest.importorskip("torch")
    run_here("train_and_export", ("time_limit_s=30.0", "time_limit_s=5.0"), ("episodes=32", "episodes=4"))
    assert "runs/bundles/mine: " in capsys.readouterr().out
    assert (here / "runs/bundles/mine/policy.onnx").is_file()
