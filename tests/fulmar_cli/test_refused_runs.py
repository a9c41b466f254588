"""Runs and evaluations whose parts do not go together are refused in one line, before anything starts."""

from __future__ import annotations

import pytest

from fulmar_core.config.paths import OWN_FOLDERS
from tests.fulmar_cli.command_line import complaint

RADIO = (
    "floating_platform",
    "--task",
    "go_to_pose",
    "--start",
    "1,0.5,60",
    "--goal",
    "0,0,0",
    "--scenario",
    "radio",
)
EVALUATE = ("evaluate", "floating_platform", "go_to_pose", "--controller", "lqr", "--scenario", "radio")
FLEET = """\
title: a platform and a boat
control_hz: 10.0
least_distance: 0.02
robots:
  - {name: alpha, robot: floating_platform, task: go_to_pose, controller: lqr, start: [0.0, 0.0, 0.0],
     goal: [-1.0, 0.5, 90.0], keep_apart: true}
  - {name: boat, robot: kingfisher, task: go_to_position, controller: classical, start: [0.0, -4.0, 0.0],
     goal: [3.0, -4.0]}
"""


@pytest.mark.parametrize(
    ("words", "reported"),
    [
        (
            ("run", *RADIO, "--lockstep", "--estimator", "mocap_imu"),
            "in lock step a link needs a controller alone: estimator would wait",
        ),
        ((*EVALUATE, "--through", "mujoco"), "--through mujoco does not simulate"),
        ((*EVALUATE, "--through", "mujoco"), "--through ros"),
        (("run", "turtlebot2", "--lockstep", "--markers"), "--markers"),
    ],
)
def test_it_is_one_line(fulmar, words, reported):
    assert reported in complaint(fulmar(*words))


def test_a_fleet_takes_no_goal_of_a_single_robot(fulmar, tmp_path, monkeypatch):
    (tmp_path / "systems").mkdir()
    (tmp_path / "systems" / "pair.yaml").write_text(FLEET)
    monkeypatch.setenv(OWN_FOLDERS, str(tmp_path))
    assert "takes no --goal" in complaint(fulmar("run", "--system", "pair", "--goal", "1,1"))
