"""A task of the user's own, from a folder outside the checkout: in runs, evaluations, re-runs and reports."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from fulmar_bags.run_record import read_run
from fulmar_cli.main import app
from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from tests.conftest import RosDomain
from tests.own_files import own_folder
from tests.ros.cli import fulmar, json_of

PAGE = Path(__file__).resolve().parents[2] / "docs" / "own-task.md"
TASK, CONTROLLER = ("--task", "my_task:Circle"), ("--controller", "my_orbit:Orbit")
LATE = """
from my_task import Circle
class Observes(Circle):
    def observe(self, state, goal):
        assert not (state.x.shape == (1,) and state.speed[0] > 0.25), "too fast"
        return super().observe(state, goal)
class Measures(Circle):
    def distance_from_goal(self, state, goal):
        return state.x / (0.0 if state.x.shape == (1,) and state.speed[0] > 0.25 else 1.0)
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The files of the page, in the current folder."""
    task, controller, gate, *in_space = re.findall(
        r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL
    )
    (tmp_path / "my_task.py").write_text(task + gate)
    (tmp_path / "my_orbit.py").write_text(controller)
    for name, text in zip(("my_inspection.py", "my_look.py"), in_space, strict=True):
        (tmp_path / name).write_text(text)
    with own_folder(tmp_path, monkeypatch):
        yield tmp_path


@pytest.mark.slow
def test_the_task_of_the_page_is_done_in_run_evaluation_and_rerun(
    ros_domain: RosDomain, folder: Path
) -> None:
    def ask(*words: str) -> str:
        done = CliRunner().invoke(app, words, catch_exceptions=False)
        assert done.exit_code == 0, done.output
        return done.stdout

    run = ("--goal", "1,0.5", "--lockstep", "--duration", "15", "--record", "bag", "--json")
    done = fulmar("run", "turtlebot2", *TASK, *CONTROLLER, *run, env=ros_domain.env, cwd=folder)
    assert done.returncode == 0, done.stderr
    found = json_of(done.stdout)
    assert (found["task"], found["success"]) == ("my_task:Circle", True)
    for command in (("bag", "rerun", "bag", *CONTROLLER), ("report", "bag")):
        with pytest.raises(
            ConfigError, match="the task is 'my_task:Circle', a class that only this bag names"
        ):
            ask(*command)
    assert "my_task" not in sys.modules
    found = json_of(ask("bag", "rerun", "bag", *TASK, *CONTROLLER, "--from", "odometry", "--json"))
    assert (found["task"], found["same"]) == ("my_task:Circle", True)
    evaluated = ask(
        "evaluate", "turtlebot2", TASK[1], *CONTROLLER, "--through", "mujoco", "--episodes", "4", "--json"
    )
    found = json_of(evaluated)
    assert (found["task"], found["success_rate"]) == ("my_task:Circle", 1.0)
    ask("report", "bag", *TASK)
    assert "Reached" in (folder / "bag" / "report.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_thing_of_its_own_comes_over_the_wires_into_observation_bag_rerun_and_report(
    ros_domain: RosDomain, folder: Path
) -> None:
    gated = ("--task", "my_task:ThroughGate")
    run = ("run", "turtlebot2", *gated, *CONTROLLER, "--lockstep", "--duration", "6", "--record", "bag")
    done = fulmar(*run, "--json", env=ros_domain.env, cwd=folder)
    assert done.returncode in (0, 1), done.stderr
    assert not json_of(done.stdout)["failure"]
    load_task(gated[1])  # a user asked for it
    record = read_run(folder / "bag")
    (gate,) = record.things.values()
    drawn = draw_episode(
        load_robot("turtlebot2"), load_task(gated[1]), load_scenario("nominal"), seed=0, number=0
    )
    np.testing.assert_allclose(gate.pose, np.tile(drawn.goal.things["gate"], (len(gate), 1)), atol=1e-9)
    assert len(gate) == len(record.odom)
    for through in ("direct", "node"):
        words = [
            "bag",
            "rerun",
            "bag",
            *gated,
            *CONTROLLER,
            "--from",
            "odometry",
            "--through",
            through,
            "--json",
        ]
        again = fulmar(*words, env=ros_domain.env, cwd=folder)
        assert json_of(again.stdout)["same"], again.stdout
    assert CliRunner().invoke(app, ["report", "bag", *gated], catch_exceptions=False).exit_code == 0
    assert "the way of the gate" in (folder / "bag" / "report.html").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("late:Observes", "task 'late:Observes': observe raised AssertionError: too fast"),
        (
            "late:Measures",
            "task 'late:Measures': distance_from_goal returned the result that is not finite.",
        ),
    ],
)
def test_a_task_that_fails_on_the_way_ends_its_run_with_one_line_and_a_robot_that_stands(
    name: str, words: str, ros_domain: RosDomain, folder: Path
) -> None:
    (folder / "late.py").write_text(LATE)
    run = ("run", "turtlebot2", "--task", name, *CONTROLLER, "--lockstep", "--duration", "8", "--json")
    done = fulmar(*run, "--record", "bag", env=ros_domain.env, cwd=folder)
    assert done.returncode == 1, done.stderr
    assert words in json_of(done.stdout)["failure"]
    assert "Traceback" not in done.stderr
    commanded = read_run(folder / "bag").commanded.effort
    assert commanded.any()
    assert not commanded[-1].any()


@pytest.mark.slow
def test_the_task_in_space_of_the_page_is_done_by_a_controller_and_learned(
    ros_domain: RosDomain, folder: Path
) -> None:
    asked = ("evaluate", "spacecraft_16", "my_inspection:Inspect", "--episodes", "8", "--seed", "3", "--json")
    found = {}
    for through in ("batch", "mujoco"):
        words = (*asked, "--controller", "my_look:Look", "--through", through)
        done = CliRunner().invoke(app, words, catch_exceptions=False)
        assert done.exit_code == 0, done.output
        found[through] = json_of(done.stdout)
    assert found["mujoco"]["task"] == "my_inspection:Inspect"
    assert found["mujoco"]["success_rate"] >= 0.75
    assert found["batch"]["success_rate"] >= 0.75
    train = ("train", "spacecraft_16", "my_inspection:Inspect", "--time-limit", "5", "--out", "trained")
    for words in (train, ("export", "trained", "--out", "bundle")):
        done = fulmar(*words, env=ros_domain.env, cwd=folder)
        assert done.returncode == 0, done.stderr
    learned = (*asked, "--policy", "bundle", "--through", "batch")
    done = CliRunner().invoke(app, learned, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    assert json_of(done.stdout)["controller"] == "policy"
    run = (
        "run",
        "spacecraft_16",
        "--task",
        "my_inspection:Inspect",
        "--policy",
        "bundle",
        "--goal",
        "1,0,0.5",
    )
    done = fulmar(*run, "--lockstep", "--duration", "3", "--json", env=ros_domain.env, cwd=folder)
    assert json_of(done.stdout)["failure"] is None, done.stderr
