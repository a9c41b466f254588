"""A spacecraft through the nodes: a run in lock step, its bytes again, its re-run, and many episodes."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of
from tests.ros.wires import wires_of

CONTROLLER = '''
"""Opens the valves that push and turn towards the goal."""
import numpy as np


class Hold:
    def __init__(self, robot, task, settings):
        self.wrench = robot.actuators.wrench_per_newton  # (16, 6) [N, N·m]
        self.names = task.observation_names

    def reset(self):
        pass

    def act(self, inputs):
        terms = dict(zip(self.names, np.moveaxis(inputs.observation, -1, 0), strict=True))

        def vector(name):
            return np.stack([terms[name.format(axis)] for axis in "xyz"], axis=-1)

        force = 0.2 * vector("goal_{}_in_body") - 1.5 * vector("velocity_{}_in_body")
        torque = 0.05 * vector("attitude_error_{}") - 0.2 * vector("turn_rate_{}")
        scores = force @ self.wrench[:, :3].T + 3.0 * torque @ self.wrench[:, 3:].T
        return (scores > 0.01).astype(float)
'''
OWN = ("--controller", "by_hand:Hold")
GOAL = ("--goal", "0.5,0.2,-0.3,0,20,30", "--start", "0,0,0,-20,0,10")
RUN = ("run", "spacecraft_16", *OWN, *GOAL, "--lockstep", "--seed", "3", "--duration", "40", "--json")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The current folder of every command, with the controller in it."""
    (tmp_path / "by_hand.py").write_text(CONTROLLER, encoding="utf-8")
    return tmp_path


@pytest.mark.slow
def test_two_runs_of_one_seed_have_the_same_bytes_come_near_the_goal_and_answer_the_same_again(
    ros_domain: RosDomain, folder: Path
) -> None:
    for bag in ("one", "two"):
        done = fulmar(*RUN, "--record", bag, env=ros_domain.env, cwd=folder)
        summary = json_of(done.stdout)
        assert summary["failure"] is None, done.stderr
    assert summary["task"] == "go_to_pose_3d"  # as six numbers ask for
    assert summary["steps"] == 200
    assert summary["final_position_error_m"] < 0.05
    assert 0.0 < summary["final_attitude_error_deg"] < 10.0
    assert summary["final_heading_error_deg"] is None
    one, two = wires_of(folder / "one"), wires_of(folder / "two")
    assert len(one["/spacecraft_16/odom"]) == len(one["/spacecraft_16/controller/action"]) == 200
    assert {topic for topic in one if one[topic] != two.get(topic)} == set()
    done = fulmar("bag", "diff", "one", "two", env=ros_domain.env, cwd=folder)
    assert done.returncode == 0, done.stdout
    for source in ("observations", "odometry"):
        done = fulmar("bag", "rerun", "one", *OWN, "--from", source, "--json", env=ros_domain.env, cwd=folder)
        assert done.returncode == 0, done.stdout + done.stderr
        assert json_of(done.stdout)["asked"] == 200


@pytest.mark.slow
def test_an_evaluation_through_the_nodes_has_the_figures_of_the_one_through_mujoco(
    ros_domain: RosDomain, folder: Path
) -> None:
    found = []
    for through in ("ros", "mujoco"):
        asked = ("evaluate", "spacecraft_16", "go_to_pose_3d", *OWN, "--through", through)
        done = fulmar(
            *asked,
            "--episodes",
            "2",
            "--steps",
            "150",
            "--seed",
            "5",
            "--json",
            env=ros_domain.env,
            cwd=folder,
        )
        assert done.returncode == 0, done.stderr
        found.append(json_of(done.stdout))
    ros, mujoco = found
    assert ros["final_attitude_error_deg"] == mujoco["final_attitude_error_deg"]
    assert ros["final_position_error_m"] == mujoco["final_position_error_m"]


@pytest.mark.slow
def test_goals_of_a_file_are_taken_one_after_another_inside_a_box(
    ros_domain: RosDomain, folder: Path
) -> None:
    (folder / "two.yaml").write_text(
        "kind: positions\ntitle: two places\npositions: [[0.3, 0, 0.3], [0.3, 0, -0.3]]\n"
    )
    asked = ("run", "spacecraft_16", *OWN, "--goals", "two.yaml", "--lockstep", "--json")
    start, box = ("--start", "0,0,0"), "--area=-1,1,-1,1,-1,1"
    (folder / "by_hand.py").write_text(  # this task has no attitude error
        CONTROLLER.replace('0.05 * vector("attitude_error_{}") - ', "-"), encoding="utf-8"
    )
    done = fulmar(*asked, *start, box, "--record", "bag", env=ros_domain.env, cwd=folder)
    summary = json_of(done.stdout)
    assert summary["failure"] is None, done.stderr
    assert summary["task"] == "go_to_position_3d"
    assert summary["goals_progress"] == "2 of 2 targets reached"
    done = fulmar(*asked, *start, "--area=-1,1,-1,1,-1,0.2", env=ros_domain.env, cwd=folder)
    assert done.returncode == 2
    assert "z = 0.3 m lies outside the area" in done.stderr


VALVES = """
title: sixteen valves on a GPIO chip
robot: spacecraft_16
driver:
  kind: gpio_valves
  port: /dev/gpiochip0
  lines: [LINES]
  order: [ORDER]
"""


@pytest.mark.slow
@pytest.mark.real_time
def test_a_run_through_sixteen_emulated_valves_meets_its_goal_by_motion_capture_alone(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    lines = ", ".join(f"'{number}'" for number in range(16))
    order = ", ".join(map(str, reversed(range(16))))
    (tmp_path / "valves.yaml").write_text(VALVES.replace("LINES", lines).replace("ORDER", order))
    asked = ("run", "spacecraft_16", "--backend", "hardware", "--hardware", "valves.yaml", "--emulate")
    goal = ("--controller", "lqr", "--goal", "0.6,0.3,-0.4,0,0,40", "--duration", "30")
    done = fulmar(*asked, *goal, "--record", "bag", "--json", env=ros_domain.env, cwd=tmp_path)
    summary = json_of(done.stdout)
    assert summary["failure"] is None, done.stderr
    assert summary["final_position_error_m"] < 0.05
    assert summary["final_attitude_error_deg"] < 5.0


@pytest.mark.slow
@pytest.mark.parametrize("controller", ["lqr", "pd"])
def test_a_law_follows_a_target_that_moves_in_lock_step(
    controller: str, ros_domain: RosDomain, tmp_path: Path
) -> None:
    asked = ("run", "spacecraft_16", "--goals", "upright_circle", "--controller", controller, "--lockstep")
    done = fulmar(*asked, "--seed", "2", "--record", "bag", "--json", env=ros_domain.env, cwd=tmp_path)
    summary = json_of(done.stdout)
    assert summary["success"], done.stderr
    assert summary["task"] == "go_to_pose_3d"
    assert summary["goals_progress"] == "1 of 1 rounds"
    assert summary["tracking_error_m"] < 0.02
    assert summary["tracking_error_deg"] < 1.5
    assert summary["path_error_m"] < 0.02
    done = fulmar(
        "bag", "rerun", "bag", "--controller", controller, "--json", env=ros_domain.env, cwd=tmp_path
    )
    assert done.returncode == 0, done.stdout + done.stderr
    done = fulmar("report", "bag", env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "The goal moves" in (tmp_path / "bag" / "report.html").read_text(encoding="utf-8")
