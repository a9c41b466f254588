"""Closed loops without ROS: what they need, what they leave behind, and that both ways of running them agree."""

from __future__ import annotations

import json
import sys
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names
from fulmar_core.estimators.actuator_health.filters import HealthSettings
from fulmar_core.loop.rollout import roll_out_in_backends, roll_out_in_batch
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.observation import Observer
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes.mock_backend import MockBackend
from tests.pairs import covering
from tests.spaces import shared_space

ROBOT, TASK = load_robot("floating_platform"), load_task("go_to_pose")
IDEAL, NOMINAL = load_scenario("ideal"), load_scenario("nominal")


class Habit:
    """A controller without skill: the same smooth function of what it sees, every time."""

    name = "habit"
    estimator = None
    readings, observer = (), None

    def __init__(self, robot, task, *, boldness=0.3):
        self.control_hz = robot.timing.control_hz
        self._scale = robot.actuators.scale
        shape = (len(Observer(robot, task).names), len(self._scale))
        self._weights = np.random.default_rng(8).normal(size=shape) * boldness

    def reset(self):
        pass

    def act(self, inputs):
        return np.tanh(inputs.observation @ self._weights) * self._scale


class Counted(MockBackend):
    """A mock that knows how many of its kind are open, and fails on request."""

    open = 0
    fail_at_step = fail_at_number = 10**9

    def __init__(self) -> None:
        if Counted.open >= Counted.fail_at_number:
            raise RuntimeError("no more of them")
        super().__init__(ROBOT)
        Counted.open += 1
        self._steps = 0

    def step(self, command, ticks=1):
        self._steps += 1
        if self._steps >= Counted.fail_at_step:
            raise RuntimeError("it broke")
        return super().step(command, ticks)

    def close(self):
        Counted.open -= 1
        super().close()


class Still(Habit):
    """Stands, and keeps what it sees."""

    def reset(self):
        self.seen = []

    def act(self, inputs):
        self.seen.append(inputs.observation)
        return np.zeros_like(inputs.previous)


@pytest.mark.parametrize("through", ["batch", "backends"])
def test_a_waypoint_is_reached_as_near_as_the_robot_can_state(through):
    base, course = load_robot("turtlebot2"), load_task("go_through_positions")
    near = 2 * (course.reach + 0.02,)
    task = replace(course, start_distance=near, episode_s=0.3)
    controller = Still(base, task)
    given = {"task": task, "scenario": IDEAL, "episodes": 4, "seed": 3}
    if through == "batch":
        roll_out_in_batch(controller, base, **given)
    else:
        roll_out_in_backends(controller, lambda: MockBackend(base), **given)
    distance = np.array(controller.seen)[..., task.observation_names.index("goal_distance")]
    np.testing.assert_allclose(distance[0], near[0], atol=1e-3)
    assert np.all(distance[-1] > 0.5), "the next one is shown"


class Restless:
    """Opens one valve after the other, and keeps the estimates that it gets."""

    name, control_hz, estimator = "restless", 5.0, HealthSettings(retry_s=0.0)
    readings, observer = (), None

    def reset(self):
        self.estimates = []

    def act(self, inputs):
        self.estimates.append(inputs.estimates)
        return np.tile(np.eye(8)[len(self.estimates) % 8], (len(inputs.previous), 1))


@pytest.fixture(scope="module")
def estimates():
    """What a controller gets estimated of platforms with one lost valve, in the batch and in backends."""
    controller, found = Restless(), {}
    task = replace(load_task("drift_go_to_pose"), episode_s=8.0)
    given = {"task": task, "scenario": load_scenario("drift_one_lost"), "episodes": 4, "seed": 3}
    for through in ("batch", "backends"):
        if through == "batch":
            roll_out_in_batch(controller, ROBOT, **given)
        else:
            roll_out_in_backends(controller, lambda: MockBackend(ROBOT), **given)
        found[through] = controller.estimates
    return found


@pytest.mark.parametrize("through", ["batch", "backends"])
def test_a_controller_with_an_estimator_gets_its_estimate_at_every_step(estimates, through):
    found = estimates[through]
    assert len(found) == 40
    assert found[0].push.shape == (4, 3)
    np.testing.assert_array_equal(found[0].alive, np.ones((4, 8)))
    np.testing.assert_array_equal(8 - found[-1].alive.sum(axis=1), 1)  # one is lost


def test_estimates_are_alike_in_the_batch_and_in_backends(estimates):
    batch, backends = estimates["batch"][-1], estimates["backends"][-1]
    np.testing.assert_array_equal(batch.alive, backends.alive)
    np.testing.assert_allclose(batch.push, backends.push, atol=0.02)


@pytest.mark.parametrize("way_to_fail", [{}, {"fail_at_step": 3}, {"fail_at_number": 2}], ids=str)
def test_every_backend_is_closed_whatever_happens(monkeypatch, way_to_fail):
    monkeypatch.setattr(Counted, "open", 0)
    for name, value in way_to_fail.items():
        monkeypatch.setattr(Counted, name, value)
    task = replace(TASK, episode_s=1.0)

    def run():
        roll_out_in_backends(Habit(ROBOT, task), Counted, task, NOMINAL, episodes=4, seed=1)

    if way_to_fail:
        with pytest.raises(RuntimeError):
            run()
    else:
        run()
    assert Counted.open == 0


def test_an_episode_shorter_than_a_control_step_is_refused_by_name():
    task = replace(TASK, episode_s=0.05)
    controller, words = (
        Habit(ROBOT, task),
        r"an episode of task 'go_to_pose' lasts 0\.05 s, less than one control",
    )
    with pytest.raises(ConfigError, match=words):
        roll_out_in_batch(controller, ROBOT, task, NOMINAL, episodes=2, seed=1)
    with pytest.raises(ConfigError, match=words):
        roll_out_in_backends(controller, lambda: MockBackend(ROBOT), task, NOMINAL, episodes=2, seed=1)


ALIKE = {name: load_robot(name) for name in ("turtlebot2", "modular_freeflyer", "spacecraft_16", "int_ball2")}


ALIKE_PAIRS = shared_space(ALIKE, {name: load_task(name) for name in config_names("tasks")})


@pytest.mark.parametrize(
    ("robot", "name"),
    [
        pytest.param(*pair, marks=() if pair in covering(ALIKE_PAIRS) else pytest.mark.slow)
        for pair in ALIKE_PAIRS
    ],
)
def test_episodes_go_alike_in_the_batch_and_one_by_one(robot, name):
    robot, task = ALIKE[robot], replace(load_task(name), episode_s=8.0)
    # Errors magnified as much as this task's make rounding grow past any tolerance at the usual boldness.
    boldness = 0.15 if name == "drift_track_velocities" else 0.3
    controller = Habit(robot, task, boldness=boldness)
    batch = roll_out_in_batch(controller, robot, task, IDEAL, episodes=3, seed=5)
    alone = roll_out_in_backends(
        controller, lambda: MockBackend(robot, things=task.things), task, IDEAL, episodes=3, seed=5
    )
    in_space = () if task.state_type is PlanarState else ("z", "attitude_error", "rate_error")
    columns = ("x", "y", "position_error", "velocity_error", "goals", "touching", "outside", "shares")
    for column in (*columns, *in_space):
        one, other = (np.asarray(getattr(run, column), dtype=float) for run in (batch, alone))
        # The batch is in single precision; and this controller pulls nothing together.
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-3, err_msg=column)
    np.testing.assert_allclose(np.cos(batch.yaw - alone.yaw), 1.0, rtol=0, atol=1e-5)


def test_evaluation_works_where_training_is_not_installed(monkeypatch):
    from fulmar_cli.main import app

    for name in [name for name in sys.modules if name.split(".")[0] == "training"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "training", None)
    arguments = "evaluate floating_platform go_to_pose --controller lqr --through batch --episodes 2 --json"
    result = CliRunner().invoke(app, arguments.split())
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["episodes"] == 2
