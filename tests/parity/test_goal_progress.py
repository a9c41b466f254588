"""Training, evaluation in the batch and in simulators, and the node advance goals at the same control step.

All four get the same measurements here: a robot that is carried from target to target, past some of them, with noise.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.paths import config_names
from fulmar_core.loop import rollout
from fulmar_core.loop.controller_settings import ControllerSettings
from fulmar_core.loop.fallback import ControllerSwitch, Standby
from fulmar_core.loop.guarded_loop import GuardedLoop
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.input_gate import Measurement
from fulmar_core.safety.motion_agreement import MotionAgreement
from fulmar_core.simulation.episode import draw_episodes
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.attitude import exponential, normalised, plus, product
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.spatial import SpatialState
from fulmar_core.states.state import State
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.wires.reading import Reading
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes.mock_backend import MockBackend
from tests.spaces import robot_for
from tests.states import received_targets

BASE, SCENARIO = load_robot("turtlebot2"), load_scenario("nominal")
SEED, EPISODES, STEPS, STRIDE = 3, 2, 120, 0.12  # m a step
S = 1_000_000_000


def robot_of(task):
    return robot_for(task, BASE)


def drawn(task):
    robot = robot_of(task)
    return draw_episodes(robot, task.fitted(robot), SCENARIO, seed=SEED, numbers=np.arange(EPISODES))


def short(task):
    """The task in an episode in which several targets have their turn."""
    hold = {"hold_s": 3.0} if hasattr(task, "hold_s") else {}
    return replace(task, episode_s=STEPS * robot_of(task).timing.control_s, **hold)


TASKS = {name: short(load_task(name)) for name in config_names("tasks")}
TASKS = {name: task for name, task in TASKS.items() if drawn(task).goal.targets.shape[1] > 1}


@pytest.fixture(
    params=[
        pytest.param(task, id=name, marks=pytest.mark.slow if name == "fly_path" else ())  # as fly_a
        for name, task in TASKS.items()
    ]
)
def task(request):
    return request.param


def measurements(task):
    """Odometry from target to target, of each episode and step, in single precision as the batch has it."""
    series = in_plane(task) if task.state_type is PlanarState else in_space(task)
    return series.mapped(lambda column: column.astype(np.float32))


def in_space(task):
    """Places and attitudes in turn, with noise, shapes (STEPS, EPISODES)."""
    episode, rng = drawn(task), np.random.default_rng(5)
    poses = np.tile(SpatialState.target_at((0.0, 0.0, 0.0)), (STEPS, EPISODES, 1))
    if task.goal_topic != "goal_velocity":
        for world in range(EPISODES):
            targets = episode.goal.targets[world]
            way = np.vstack((episode.start.pose[world], *(targets for _ in range(3))))
            for before, now in itertools.pairwise(way):
                now[3:] *= np.sign(before[3:] @ now[3:])  # q and -q are one attitude
            along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(way[:, :3], axis=0), axis=1)))
            poses[:, world] = np.stack(
                [np.interp(STRIDE * np.arange(STEPS), along, column) for column in way.T], axis=-1
            )
    aside, turned = rng.normal(0.0, (0.06, 0.05), (3, STEPS, EPISODES, 2)).transpose(3, 0, 1, 2)
    still = SpatialState.resting(poses)
    quat = product(normalised(still.quat), exponential(tuple(turned)))
    return SpatialState(*plus(still.position, tuple(aside)), *quat, *still.velocity, *still.rate)


def in_plane(task):
    """Places and headings in turn, with noise, shapes (STEPS, EPISODES)."""
    episode, rng = drawn(task), np.random.default_rng(5)
    shape = (STEPS, EPISODES)
    columns = {name: np.zeros(shape) for name in PlanarState.COLUMNS}
    if task.goal_topic != "goal_velocity":
        for world in range(EPISODES):
            targets = episode.goal.targets[world]
            start = [episode.start.x[world], episode.start.y[world], targets[0, 2]]
            way = np.vstack((start, *(targets for _ in range(3))))
            along = np.append(0.0, np.cumsum(np.hypot(*np.diff(way[:, :2], axis=0).T)))
            place = STRIDE * np.arange(STEPS)
            columns["x"][:, world] = np.interp(place, along, way[:, 0])
            columns["y"][:, world] = np.interp(place, along, way[:, 1])
            columns["yaw"][:, world] = np.interp(place, along, np.unwrap(way[:, 2]))
    noise = {"x": 0.06, "y": 0.06, "yaw": 0.1}
    return PlanarState(
        *(columns[name] + rng.normal(0.0, noise.get(name, 0.0), shape) for name in PlanarState.COLUMNS)
    )


class Replayed(BatchSimulation):
    """A batch in which the measurements are given, whatever happens."""

    series: State

    def _measure(self):
        super()._measure()
        self.measured = self.series[int(self._steps[0])] if self._steps[0] < STEPS else self.measured


class ReplayedBackend(MockBackend):
    """A simulator whose measurements are given."""

    def __init__(self, robot, series):
        super().__init__(robot)
        self._series, self._number, self._control_step = series, 0, 0

    def reset(self, episode, *, seed, number=0):
        self._number, self._control_step = number, 0
        return self._given(super().reset(episode, seed=seed, number=number))

    def step(self, command, ticks=1):
        self._control_step += 1
        return self._given(super().step(command, ticks))

    def _given(self, sample):
        step = min(self._control_step, STEPS - 1)
        seen = Reading(self._series[step, self._number].in_float64().to_rigid())
        return replace(sample, readings={**sample.readings, "odometry": seen})


class Recorder:
    """Stands, and keeps the targets that it is shown."""

    name, estimator = "recorder", None
    readings, observer = (), None

    def __init__(self, robot):
        self.control_hz, self.targets = robot.timing.control_hz, []

    def reset(self): ...

    def act(self, inputs):
        self.targets.append(inputs.goal.current)
        return np.zeros_like(inputs.previous)


def in_training(task, series, monkeypatch):
    monkeypatch.setattr(Replayed, "series", series, raising=False)
    simulation = Replayed(robot_of(task), task, SCENARIO, worlds=EPISODES, seed=SEED)
    targets = []
    for _ in range(STEPS):
        targets.append(np.array(simulation.goal.current))
        simulation.step(simulation.command)
    return targets


def in_the_batch(task, series, monkeypatch):
    monkeypatch.setattr(Replayed, "series", series, raising=False)
    monkeypatch.setattr(rollout, "BatchSimulation", Replayed)
    robot = robot_of(task)
    recorder = Recorder(robot)
    rollout.roll_out_in_batch(recorder, robot, task, SCENARIO, episodes=EPISODES, seed=SEED)
    return recorder.targets


def in_simulators(task, series, monkeypatch):
    robot = robot_of(task)
    recorder = Recorder(robot)
    rollout.roll_out_in_backends(
        recorder, lambda: ReplayedBackend(robot, series), task, SCENARIO, episodes=EPISODES, seed=SEED
    )
    return recorder.targets


class NoEstop:
    received = False

    def reason(self, now_ns):
        return ""


def in_the_node(task, series, monkeypatch):
    """As the node: a goal that came on a wire, velocities each with the stamp of its time, odometry one by one."""
    targets, robot = [], robot_of(task)
    # What is carried here has a velocity of nothing but noise, which no odometry of a robot that moves has.
    monkeypatch.setattr(MotionAgreement, "agrees", lambda *_: True)
    for world in range(EPISODES):
        recorder, goal = Recorder(robot), goal_in_float64(drawn(task).goal)[world]
        guard = GuardedLoop(
            robot,
            task,
            ControllerSettings(lockstep=True),
            ControllerSwitch(Standby(recorder, "{}", "")),
            NoEstop(),
        )
        guard.activate()
        if task.goal_topic == "goal_velocity":
            for i, target in enumerate(goal.targets):
                one = replace(goal, targets=target[None])
                guard.take_goal(received_targets(one, task), round(S * (1.0 + i * task.step_s)), S)
        else:
            guard.take_goal(received_targets(goal, task), 1, S)
        for step in range(STEPS):
            now_ns = round(S * (1.0 + step * robot.timing.control_s))
            seen = Measurement(now_ns, "odom", "base_link", series[step, world].in_float64().to_rigid())
            assert guard.take(seen, now_ns)
            decision, inputs = guard.begin_step(seen, now_ns)
            assert decision.may_act, decision.reason
            guard.act(inputs)
        targets.append(np.concatenate(recorder.targets))
    return list(np.stack(targets, axis=1))


def test_goals_advance_at_the_same_step_everywhere(task, monkeypatch):
    series = measurements(task)
    expected = in_the_batch(task, series, monkeypatch)
    changes = np.any(np.diff(expected, axis=0) != 0.0, axis=2).sum(axis=0)
    assert len(expected) == STEPS
    assert changes.max() >= 3
    for follow in (in_training, in_simulators, in_the_node):
        found = follow(task, series, monkeypatch)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-5, err_msg=follow.__name__)


def test_every_task_with_several_targets_is_compared():
    assert {"go_through_positions", "go_through_poses", "race_gates", "track_velocities"} <= set(TASKS)
    assert {"go_through_positions_3d", "go_through_poses_3d", "track_velocities_3d"} <= set(TASKS)
