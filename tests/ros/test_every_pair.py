"""Every robot, every task, and policies with memory over the wires: nodes compute what a loop without ROS does."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
import rclpy
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.supervisor import Supervisor
from fulmar_core.config.paths import config_names
from fulmar_core.controllers.controller import Controller, Inputs
from fulmar_core.dynamics.flight_trim import find_trim
from fulmar_core.loop.rollout import roll_out_in_backends
from fulmar_core.robots.actuators.rolling import Rolling
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.backend import Sample
from fulmar_core.simulation.episode import draw_episode, episode_steps
from fulmar_core.tasks import Task, load_task
from fulmar_core.tasks.observation import Observer
from fulmar_core.worlds.scenario import load_scenario
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.runtime import spinning
from sim_nodes.mujoco_backend import MujocoBackend
from sim_nodes.sim_node import make_backend
from tests.conftest import RosDomain
from tests.spaces import robot_for, task_for

SEED = 5
LASTS_S = {"track_velocities": 14.0, "track_velocities_3d": 14.0}  # long enough for a second velocity
BRIEFLY_S = 3.0  # short enough to leave no geofence and to touch no obstacle
TURNS_S = 3.0  # soon after, the guard stops what turns ever further from its goal
FLIES_S = 0.5  # of aircraft, which are commanded more often
# A second task of a kind with other figures brings nothing new onto the wires; tests/conftest.py has more of them.
ALIKE = {
    "drift_go_to_pose",
    "drift_track_velocities",
    "race_waypoints",
    "race_wayposes",
    "point_inertial",
    "slew",
    "fly_airspeed",
    "fly_path",
}
ROBOTS, TASKS = (
    [pytest.param(name, marks=pytest.mark.slow if name in ALIKE else ()) for name in config_names(kind)]
    for kind in ("robots", "tasks")
)


class Wanderer:
    """Does something that depends on all that it sees and is reported, and on what it has seen; reaches nothing."""

    name, estimator = "wanderer", None
    readings, observer = (), None

    def __init__(self, robot: Robot, task: Task) -> None:
        self.control_hz = robot.timing.control_hz
        rng = np.random.default_rng(1)
        self._scale = robot.actuators.scale * (0.4 if isinstance(robot.actuators, Rolling) else 1.0)
        shape = (len(Observer(robot, task).names), len(robot.actuators.names))
        self._middle: Any = 0.0
        if robot.airframe is not None:  # anything bolder tumbles it, and the gates of the nodes end that
            self._middle = find_trim(robot, robot.airframe.speed, 1.0).command
            self._scale = 0.02 * robot.actuators.scale
        self._weights = rng.normal(0.0, 0.4, shape)
        # Docking observes nothing but motion, of which there is none at first: only the wave opens valves.
        self._wave, self._phases = (1.0, np.arange(shape[1])) if task.name == "dock" else (0.2, 0.0)
        self._seen = 0

    def reset(self) -> None:
        self._seen = 0

    def act(self, inputs: Inputs) -> np.ndarray:
        self._seen += 1
        wave = self._wave * np.sin(0.3 * self._seen + self._phases)
        wanted = np.tanh(np.clip(inputs.observation, -2.0, 2.0) @ self._weights + wave)
        return np.asarray(self._middle + self._scale * wanted)

    def metadata(self) -> dict[str, Any]:
        return {"controller": self.name, "sha256": ""}


@pytest.fixture(autouse=True)
def ros(ros_domain: RosDomain) -> Iterator[None]:
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    yield
    rclpy.try_shutdown()


@contextlib.contextmanager
def nodes(
    robot: Robot, task: Task, make: Callable[[Robot, Task], Controller]
) -> Iterator[tuple[PlantNode, ControllerNode, Supervisor]]:
    """Plant and controller in lock step, and an operator."""

    def arguments(*more: str) -> list[str]:
        given = [f"robot:={robot.name}", f"task:={task.name}", "lockstep:=true", *more]
        options = [word for parameter in given for word in ("-p", parameter)]
        return ["--ros-args", "-r", f"__ns:=/{robot.name}", *options]

    def fail(error: Exception) -> None:
        pytest.fail(repr(error))

    operator = Node("operator", namespace=f"/{robot.name}")
    overseer = Supervisor(
        operator, RunPlan(robot.name, task.name, "external", "mock", robot.timing.control_hz)
    )
    plant = PlantNode(make_backend, lambda _code: None, cli_args=arguments("autostart:=false"))
    assert plant.trigger_configure() == TransitionCallbackReturn.SUCCESS
    controller = ControllerNode(
        lambda *_: make(robot, task), lambda _code: None, cli_args=arguments("wait_for_subscribers:=1")
    )
    with spinning(operator, fail), spinning(plant, fail), spinning(controller, fail):
        yield plant, controller, overseer


def _lasts_s(robot: Robot, task: Task) -> float:
    if not robot.kind.goes_anywhere:
        return TURNS_S
    return LASTS_S.get(task.name, FLIES_S if robot.flies else BRIEFLY_S)


def check_pair(robot: Robot, task: Task, make: Callable[[Robot, Task], Controller] = Wanderer) -> None:
    """Run the same two episodes with and without ROS; the second shows that nothing of the first is left."""
    scenario = load_scenario("nominal")
    dt = 1.0 / robot.timing.control_hz
    steps = round(_lasts_s(robot, task) / dt)
    ways: list[list[tuple[float, ...]]] = [[], []]
    with nodes(robot, task, make) as (plant, _, overseer):
        for number in range(2):
            episode = draw_episode(robot, task, scenario, seed=SEED, number=number)
            plant.clock.advance(dt)
            overseer.give_goal(episode.goal, time_ns=plant.clock.now_ns, alive=lambda: None)

            def on_step(sample: Sample, command: np.ndarray, way: list[Any] = ways[number]) -> None:
                assert sample.truth is not None
                turning = float(np.linalg.norm(sample.truth.angular_velocity_in_body))
                way.append((*sample.truth.position_in_world, turning, *command))

            plant.run_episode(episode, number=number, seed=SEED, steps=steps, on_step=on_step)
    assert episode_steps(task, dt) >= steps
    with patch("fulmar_core.loop.rollout.episode_steps", return_value=steps):  # as far as they are compared
        alone = roll_out_in_backends(
            make(robot, task),
            lambda: MujocoBackend.of(robot, task, scenario),
            task,
            scenario,
            episodes=2,
            seed=SEED,
        )
    for number, way in enumerate(map(np.array, ways)):
        moved = way[:, :2] if robot.kind.goes_anywhere else way[:, 3:4]
        assert np.ptp(moved, axis=0).max() > (0.01 if robot.kind.goes_anywhere else 0.001), (
            "it stood still: this shows nothing"
        )
        np.testing.assert_allclose(way[:, 0], alone.x[number, :steps], atol=1e-4)
        np.testing.assert_allclose(way[:, 1], alone.y[number, :steps], atol=1e-4)
        if alone.z is not None:
            np.testing.assert_allclose(way[:, 2], alone.z[number, :steps], atol=1e-4)
            np.testing.assert_allclose(way[:, 3], alone.yaw_rate[number, :steps], atol=1e-4)
        share = np.abs(way[:, 4:]) / robot.actuators.scale
        np.testing.assert_allclose(share.mean(axis=1), alone.effort[number, :steps], atol=1e-4)


@pytest.mark.parametrize("robot", ROBOTS)
def test_every_robot_goes_the_same_way_over_the_wires_as_without_them(robot: str) -> None:
    """To a position; on its own command wire, with its own names, rate and slew."""
    check_pair(load_robot(robot), task_for(load_robot(robot), "go_to_position"))


@pytest.mark.parametrize(
    "name",
    [task for task in TASKS if task.values[0] not in ("go_to_position", "go_to_position_3d", "fly_hold")],
)
def test_every_task_comes_over_the_wires_as_it_does_without_them(name: str) -> None:
    """Poses, waypoints, gates, velocities that change, obstacles and the block; with wheels on `cmd_vel`, or valves."""
    task = load_task(name)
    check_pair(robot_for(task, load_robot("turtlebot2")), task)


@pytest.mark.slow
def test_a_policy_with_memory_goes_the_same_way_over_the_wires_as_without_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("torch")
    from policy_server.policy import Policy
    from training.export import export
    from training.settings import load_training_settings
    from training.train import train

    robot, task = load_robot("turtlebot2"), load_task("go_to_position")
    reported = load_training_settings(robot, task, "recurrent_ppo")
    briefly = replace(
        reported, algorithm=replace(reported.algorithm, epochs=1, steps=16, minibatch=256), worlds=64
    )
    monkeypatch.setattr("training.train.held_out_evaluator", lambda *_: lambda network: (0.5, 0.5))
    train(robot, task, briefly, seed=1, out=tmp_path / "run", updates=2)
    assert export(tmp_path / "run", tmp_path / "bundle").memory
    check_pair(robot, task, lambda robot, task: Policy(tmp_path / "bundle", robot, task))
