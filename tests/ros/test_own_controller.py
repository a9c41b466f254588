"""A controller of the user's own, from a folder outside the checkout: in runs, evaluations and re-runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from fulmar_core.config.errors import BAD_USAGE
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of

PAGE = Path(__file__).resolve().parents[2] / "docs" / "own-controller.md"
RUN = ("run", "turtlebot2", "--task", "go_to_position", "--lockstep", "--record", "bag", "--json")
WRONG = """
import numpy as np
class Plain:
    def __init__(self, robot, task, settings): self.count = len(robot.actuators.names)
    def reset(self): pass
    def act(self, inputs): return np.zeros((len(inputs.previous), self.count))
class Short(Plain):
    def act(self, inputs): return np.zeros(3)
class NotANumber(Plain):
    def act(self, inputs): return np.full(inputs.previous.shape, np.nan)
class Raises(Plain):
    def act(self, inputs): raise ZeroDivisionError("by hand")
"""


@pytest.mark.slow
def test_the_controller_of_the_page_reaches_its_goal_in_run_evaluation_and_rerun(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    code = re.search(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert code is not None
    (tmp_path / "my_control.py").write_text(code.group(1))
    (tmp_path / "my_control.yaml").write_text("gain: 1.5\n")
    own = ("--controller", "my_control:Steer")
    done = fulmar(*RUN, *own, "--duration", "20", env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert json_of(done.stdout)["success"]
    done = fulmar(
        "evaluate", "turtlebot2", "go_to_position", *own, "--through", "mujoco", "--episodes", "8", "--json",
        env=ros_domain.env, cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert json_of(done.stdout)["success_rate"] == 1.0
    done = fulmar("bag", "rerun", "bag", *own, "--from", "odometry", env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    done = fulmar("bag", "rerun", "bag", env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == BAD_USAGE
    assert "a class that only this bag names" in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("wrong:Short", "command has shape (3,), must be (1, 2)"),
        ("wrong:NotANumber", "command for actuator 1 is not finite"),
        ("wrong:Raises", "controller 'wrong:Raises' raised ZeroDivisionError: by hand"),
    ],
)
def test_a_class_that_answers_nonsense_ends_its_run_with_one_line_and_a_robot_that_stands(
    name: str, words: str, ros_domain: RosDomain, tmp_path: Path
) -> None:
    (tmp_path / "wrong.py").write_text(WRONG)
    done = fulmar(*RUN, "--controller", name, "--duration", "5", env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 1
    summary = json_of(done.stdout)
    assert words in summary["failure"]
    assert not summary["actuator_use"]
    assert "Traceback" not in done.stderr
