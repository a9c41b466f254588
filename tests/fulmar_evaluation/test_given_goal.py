"""A goal in the place of one that a bag does not hold: in a re-run, and in the evaluation of a run."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fulmar_bags.contents import open_bag
from fulmar_bags.control_steps import _given, control_steps_of
from fulmar_bags.run_record import read_run
from fulmar_core.config.errors import BagError, ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_evaluation.run_evaluation import evaluate_run

BAG = Path(__file__).resolve().parents[1] / "replay/bags/floating_platform_go_to_pose_policy"
GOAL = (1.0, 0.0, -0.5, 0.0, 0.0, 90.0)


def test_a_rerun_takes_a_pose_of_the_robot_s_space_and_no_other():
    (goal,) = control_steps_of(open_bag(BAG), goal=(1.0, 2.0, 90.0)).goals
    assert goal.value[0] == pytest.approx([1.0, 2.0, 0.0, 0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)])
    with pytest.raises(ConfigError, match=r"6 numbers; .* moves in two dimensions"):
        control_steps_of(open_bag(BAG), goal=GOAL)


def test_a_rerun_of_a_satellite_takes_an_attitude_and_no_place():
    robot = load_robot("cubesat_wheels")
    turned = _given((0.0, 0.0, 90.0), robot, 0).value[0]
    assert turned == pytest.approx([0.0, 0.0, 0.0, 0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)])
    with pytest.raises(ConfigError, match="x = 5 m would have no effect"):
        _given((5.0, 0.0, 0.0, 0.0, 0.0, 90.0), robot, 0)


def asked_for(goal, task):
    """The run, as if it had been one of a task without a goal on its wire."""
    record = read_run(BAG)
    robot = "spacecraft_16" if task.endswith("_3d") else "floating_platform"
    return replace(record, goals=(), info={**record.info, "goal": goal, "task": task, "robot": robot})


def test_an_evaluation_takes_what_was_asked_for_in_both_spaces():
    flat = evaluate_run(asked_for([1.0, 2.0, 90.0], "go_to_pose"))
    assert flat.targets[-1] == pytest.approx([1.0, 2.0, np.pi / 2])
    spatial = evaluate_run(asked_for(list(GOAL), "go_to_pose_3d"))
    assert spatial.targets[-1] == pytest.approx([1.0, 0.0, -0.5, 0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)])
    assert spatial.figures["final_attitude_error_deg"] >= 0.0
    away = float(np.linalg.norm(read_run(BAG).motion.position[-1] - np.array(GOAL[:3])))
    assert spatial.figures["final_position_error_m"] == pytest.approx(away, abs=1e-3)


@pytest.mark.parametrize("goal", [None, [1.0], ["here", 2.0, 3.0]])
def test_nothing_usable_is_named(goal):
    with pytest.raises(BagError, match="holds no goal on goal_pose"):
        evaluate_run(asked_for(goal, "go_to_pose"))
