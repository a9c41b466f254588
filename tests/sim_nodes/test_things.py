"""Obstacles stop a robot, and a block gives way."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.config.paths import config_names
from fulmar_core.dynamics.things import Thing
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.obstacles import TOUCH, clearance
from sim_nodes.mock_backend import MockBackend

mujoco = pytest.importorskip("mujoco")

from sim_nodes.mujoco_backend import MujocoBackend  # noqa: E402

# No task in space has obstacles or things.
EVERY = [name for name in config_names("robots") if load_robot(name).state_type is PlanarState]
BLOCK = load_task("push_block").things
AHEAD = np.array([[1.6, 0.0, 0.21], [9.0, 9.0, 0.0], [0.0, 5.0, 0.21]])


def ahead(robot):
    """A command that pushes straight ahead."""
    kind = robot.actuators.kind
    if kind == "thrusters":
        share = 0.5 if robot.actuators.continuous else 1.0
        front = [
            nozzle.direction[0] > 0.0 and nozzle.position[0] >= 0.0 for nozzle in robot.actuators.nozzles
        ]
        return share * np.array(front)
    return np.array([0.7, 0.7]) if kind == "propellers" else np.array([0.4, 0.0])


@pytest.mark.parametrize("name", EVERY)
def test_an_obstacle_holds_a_robot_up_and_touching_is_seen_by_the_task_s_measure(name, episode):
    robot = load_robot(name)
    backend = MujocoBackend(robot, sensor_noise=False)
    backend.reset(episode(robot, obstacles=AHEAD), seed=0)
    gaps = []
    for _ in range(60):
        state = PlanarState.from_rigid(backend.step(ahead(robot), 10).truth)
        gaps.append(float(clearance(state, AHEAD, robot)))
    assert min(gaps) < TOUCH  # it came there, where collision checks count it
    assert min(gaps) > -0.015  # it was not let in


def test_obstacles_of_another_episode_stand_elsewhere_and_those_of_none_nowhere(episode):
    robot = load_robot("turtlebot2")
    backend = MujocoBackend(robot, sensor_noise=False)

    def reached(obstacles):
        backend.reset(episode(robot, obstacles=obstacles), seed=0)
        return backend.step(ahead(robot), 400).truth.position_in_world[0]

    free = reached(None)
    assert reached(AHEAD) < 1.3 < free
    compiled = backend.model
    assert reached(AHEAD + (0.4, 0.0, 0.0) * (AHEAD[:, 2:] > 0.0)) == pytest.approx(1.613, abs=0.02)
    assert reached(AHEAD * (1.0, 1.0, 0.0)) == pytest.approx(free, abs=1e-6)
    assert backend.model is compiled  # moved, not built anew
    bigger = AHEAD * (1.0, 1.0, 2.0)
    assert reached(bigger) == pytest.approx(1.6 - 0.42 - robot.body.radius, abs=0.02)


@pytest.mark.parametrize("name", EVERY)
def test_a_block_is_pushed_ahead_about_as_the_core_pushes_it(name, episode):
    robot = load_robot(name)
    places = []
    for backend in (MujocoBackend(robot, sensor_noise=False, things=BLOCK), MockBackend(robot, things=BLOCK)):
        sample = backend.reset(episode(robot, things={"block": (1.1, 0.0, 0.0)}), seed=0)
        np.testing.assert_allclose(sample.things["block"], (1.1, 0.0, 0.0), atol=1e-9)
        for _ in range(40):
            sample = backend.step(ahead(robot), 10)
            if sample.things["block"][0] > 1.5:
                break
        places.append(sample.things["block"])
    theirs, ours = places
    assert theirs[0] == pytest.approx(ours[0], abs=0.15)
    assert abs(theirs[1]) < 0.1
    assert theirs[0] > 1.3


def test_a_block_that_nobody_touches_stays_where_it_is(episode):
    robot = load_robot("turtlebot2")
    backend = MujocoBackend(robot, sensor_noise=False, things=BLOCK)
    backend.reset(episode(robot, things={"block": (1.0, 1.0, 0.0)}), seed=0)
    sample = backend.step(ahead(robot), 100)
    np.testing.assert_allclose(sample.things["block"], (1.0, 1.0, 0.0), atol=1e-4)


def test_what_is_not_pushed_stays_where_the_episode_puts_it_and_what_is_not_declared_is_not_reported(episode):
    robot, poses = load_robot("turtlebot2"), {"gate": (0.3, 0.0, 1.5), "kept": (9.0, 9.0, 0.0)}
    for kind in (MujocoBackend, MockBackend):
        backend = kind(robot, things=(Thing("gate"),))
        backend.reset(episode(robot, things=poses), seed=0)
        sample = backend.step(ahead(robot), 400)
        assert sample.truth.position_in_world[0] > 0.5  # through it
        assert {name: tuple(pose) for name, pose in sample.things.items()} == {"gate": poses["gate"]}
        assert not kind(robot).reset(episode(robot), seed=0).things
