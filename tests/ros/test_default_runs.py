"""`fulmar run ROBOT` really run, in lock step: it is what its line said, and it reaches the goal that its task asks."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from fulmar_bags.run_record import RunRecord, read_run
from fulmar_core.config.paths import config_names
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal_words import attitude_words, pose_words
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of

ASKED = [
    ("floating_platform", "--goal", "1,-0.5", "--seed", "3"),
    ("spacecraft_16", "--goal", "1,0,0.5,0,30,90"),
    ("spacecraft_16", "--goal", "1,0,90", "--task", "go_to_position_3d", "--controller", "policy"),
    ("cubesat_wheels", "--goal", "0,0,1.5708"),
    ("navion", "--height", "20"),
    ("leatherback", "--velocity", "0.3,0,5", "--controller", "classical"),
    ("turtlebot2", "--task", "go_through_positions", "--scenario", "one_dead"),
]


def is_as_said(stderr: str, record: RunRecord) -> None:
    """Compare the line that a run began with and its bag: what the controller was, what it was sent, where it began."""
    line = next(line for line in stderr.splitlines() if line.startswith("goal: "))
    info, task, robot = record.info, load_task(record.info["task"]), load_robot(record.info["robot"])
    form, first = robot.state_type, record.goals[0]
    goal = task.goal_of(first.targets)
    assert line.startswith(
        f"goal: {task.said(goal)}; robot {info['name']}; task {record.controller['task']}; start: "
    )
    words = attitude_words if not robot.kind.goes_anywhere else pose_words
    assert f"; start: {words(form, info['start'])}" in line
    began = record.truth.position[0][: form.AXES]
    assert np.asarray(began) == pytest.approx(np.asarray(info["start"])[: form.AXES], abs=0.05)
    controller = record.controller["controller"]
    assert (
        f"; controller {controller} at {record.controller['control_hz']:g} Hz on {info['backend']}; " in line
    )
    assert record.path.name.endswith(f"_{controller}")
    assert f"; scenario {info['scenario']}, seed {info['seed']}; in lock step; " in line
    lasted = record.truth.stamp_s[-1] - record.truth.stamp_s[0]
    assert float(re.findall(r"([\d.]+) s$", line)[0]) == pytest.approx(lasted, abs=0.1)


def run_and_read(ros_domain: RosDomain, tmp_path: Path, *words: str) -> tuple[dict, RunRecord]:
    """A run in lock step: its result, and its bag, which is as its line said."""
    done = fulmar("run", *words, "--lockstep", "--json", env=ros_domain.env, cwd=tmp_path, timeout_s=480.0)
    assert done.returncode in (0, 1), done.stderr
    summary = json_of(done.stdout)
    assert summary["failure"] is None, done.stderr
    record = read_run(tmp_path / summary["bag"])
    is_as_said(done.stderr, record)
    return summary, record


@pytest.mark.slow
@pytest.mark.parametrize("words", ASKED, ids=[" ".join(words) for words in ASKED])
def test_what_was_asked_is_what_the_line_said_and_what_the_bag_holds(ros_domain, tmp_path, words):
    run_and_read(ros_domain, tmp_path, *words, "--duration", "2")


@pytest.mark.slow
@pytest.mark.parametrize("robot", config_names("robots"))
def test_a_robot_alone_reaches_the_goal_of_its_usual_task(ros_domain, tmp_path, robot):
    summary, _ = run_and_read(ros_domain, tmp_path, robot)
    assert summary["success"]
