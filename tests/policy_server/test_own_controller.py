"""Controllers of the user's own without ROS: shapes, limits, and the examples and the table of their page."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names
from fulmar_core.loop.fallback import warm_up
from fulmar_core.robots.airframe.airframe import flow_past
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.air_data import wind_of
from fulmar_core.states.rotation import rotate_inverse
from fulmar_core.tasks import load_task
from fulmar_evaluation.trial_plan import plan_trial, trial_figures
from policy_server.own_controller import OwnController

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "own-controller.md").read_text(encoding="utf-8")
WRONG = '''
import numpy as np

class Short:
    """Forgets the axis of robots."""

    def __init__(self, robot, task, settings):
        self.count = len(robot.actuators.names)

    def reset(self):
        pass

    def act(self, inputs):
        return np.zeros(self.count)

class Fast(Short):
    """Takes the speed for kilometres an hour."""

    def act(self, inputs):
        return np.tile([3.0, 0.1], (len(inputs.state.x), 1))
'''


@pytest.fixture
def own(tmp_path, monkeypatch):
    """Makes a module importable, once."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path)
    names = []

    def write(name: str, text: str) -> str:
        (tmp_path / f"{name}.py").write_text(text)
        names.append(name)
        return name

    yield write
    for name in names:
        sys.modules.pop(name, None)


def made(module: str, name: str, robot: str, task: str) -> OwnController:
    craft = load_robot(robot)
    return OwnController(f"{module}:{name}", craft, load_task(task), craft.timing.control_hz)


def test_an_action_without_the_axis_of_robots_is_refused_before_anything_moves(own):
    controller = made(own("wrong_shape", WRONG), "Short", "airship_v7", "fly_hold")
    with pytest.raises(ConfigError, match=r"'wrong_shape:Short': command has shape \(5,\), must be \(1, 5\)"):
        warm_up(controller, load_robot("airship_v7"), load_task("fly_hold"))


def evaluated(controller: str) -> dict:
    trial = plan_trial(
        robot="turtlebot2", task="go_to_position", controller=controller, policy=None, through="batch", episodes=2,
        seed=1, scenario="nominal", control_hz=None, jobs=1, episode_s=5.0, steps=None, worlds=None, bounds=None,
    )  # fmt: skip
    return trial_figures(trial)


def test_an_evaluation_refuses_it_too_and_warns_of_commands_beyond_the_limits(own):
    module = own("wrong_evaluated", WRONG)
    with pytest.raises(ConfigError, match=r"command has shape \(2,\), must be \(1, 2\)"):
        evaluated(f"{module}:Short")
    (warning,) = evaluated(f"{module}:Fast")["warnings"]
    assert "in 100 % of 100 steps, at most speed 3 m/s" in warning


def test_the_table_of_commands_has_every_family_with_its_units():
    rows = dict(re.findall(r"^\| `(\w+)` \| .* \| ([^|]+) \|$", PAGE.split("## Airspeed")[0], re.MULTILINE))
    for name in config_names("robots"):
        actuators = load_robot(name).actuators
        assert rows[actuators.kind].split(", ") == list(dict.fromkeys(actuators.units)), name


def test_the_wind_is_what_ground_and_air_differ_by():
    rng = np.random.default_rng(5)
    quat = rng.standard_normal((50, 4))
    quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    wind = rng.uniform(-8.0, 8.0, (50, 3))
    velocity = rng.uniform(-5.0, 5.0, (50, 3)) + 20.0
    ahead, left, up = rotate_inverse(quat, velocity - wind).T
    flow = flow_past((ahead, -left, -up), (0.0 * ahead,) * 3, {}, load_robot("airship_v7").airframe)
    air = np.stack((flow.speed, flow.factors["alpha"], flow.factors["beta"], ahead), axis=-1)
    assert wind_of(quat, velocity, air) == pytest.approx(wind, abs=1e-6)


def test_the_example_for_aircraft_measures_the_wind(own):
    code = re.search(r"```python\n(import numpy.*?)```", PAGE, re.DOTALL)
    controller = made(own("sees_wind", code.group(1)), "SeesWind", "airship_v7", "fly_hold")
    assert controller.readings == ("air_data",)
    warm_up(controller, load_robot("airship_v7"), load_task("fly_hold"))
