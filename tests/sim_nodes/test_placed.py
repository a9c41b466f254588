"""Simulators of every kind of robot, put elsewhere or begun anew while they run."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.disturbances import read_disturbance
from fulmar_core.simulation.state_requests import read_state
from fulmar_ros.plant_settings import PlantSettings, first_episode
from sim_nodes.sim_node import make_backend
from tests.sim_nodes.test_disturbed import BOAT, CRAFT, PLATFORM, both, places, run

BASE = ("turtlebot2", "go_to_pose", (0.0, 0.0, 0.0))
TURNED = [0.0, 0.0, 0.6, 0.8]
ELSEWHERE = {"position_m": [2.0, -1.0, 0.0], "quat_xyzw": TURNED}
kinds = pytest.mark.parametrize("kind", [PLATFORM, BOAT, BASE, CRAFT], ids=lambda kind: kind[0])


def rest(simulator):
    return np.array(simulator.robot.actuators.safe_command, dtype=float)


@both
@kinds
def test_a_robot_is_where_it_was_put_after_the_next_step(kind, backend):
    samples, simulator = run(kind, backend, ticks=5)
    moved = []
    simulator.moved = lambda: moved.append(True)
    simulator.place(read_state(ELSEWHERE, simulator.robot))
    assert not moved  # the thread that steps does it
    sample = simulator.step(rest(simulator))
    np.testing.assert_allclose(places([sample])[0], [2.0, -1.0, 0.0, *TURNED], atol=2e-3)
    assert moved == [True]
    assert np.linalg.norm(places(samples)[-1][:2]) < 0.1
    after = [simulator.step(rest(simulator)) for _ in range(5)]
    np.testing.assert_allclose(places(after)[-1][:2], [2.0, -1.0], atol=1e-2)


@both
def test_a_robot_moves_as_it_was_put(backend):
    _, simulator = run(PLATFORM, backend, ticks=5)
    moving = {**ELSEWHERE, "velocity_m_s": [0.2, 0.1, 0.0], "rate_rad_s": [0.0, 0.0, 0.1]}
    simulator.place(read_state(moving, simulator.robot))
    truth = simulator.step(rest(simulator)).truth
    np.testing.assert_allclose(truth.velocity_in_world[:2], [0.2, 0.1], atol=1e-3)
    assert truth.angular_velocity_in_body[2] == pytest.approx(0.1, abs=1e-3)


@both
def test_a_simulation_that_begins_anew_does_the_same_again_undisturbed(backend):
    first, simulator = run(PLATFORM, backend, ticks=30, command=1.0)
    simulator.disturb(read_disturbance({"what": "push"}, simulator.robot))
    settings = PlantSettings(robot=PLATFORM[0], task=PLATFORM[1], backend=backend)
    simulator.begin_anew(first_episode(simulator.robot, settings), seed=3)
    command = rest(simulator)
    command[0] = simulator.robot.actuators.scale[0]
    again = [simulator.step(command) for _ in range(30)]
    np.testing.assert_array_equal(places(again), places(first[1:]))
    assert simulator.names == ()


@both
def test_what_is_pushed_stays_where_it_is_when_the_robot_is_put_elsewhere(backend):
    robot = load_robot("floating_platform")
    settings = PlantSettings(robot=robot.name, task="push_block", backend=backend)
    simulator = make_backend(robot, settings)
    before = simulator.reset(first_episode(robot, settings), seed=3).things["block"]
    simulator.place(read_state({"position_m": [5.0, 5.0, 0.0], "quat_xyzw": TURNED}, robot))
    sample = simulator.step(rest(simulator))
    np.testing.assert_allclose(sample.things["block"], before, atol=1e-6)
    np.testing.assert_allclose(sample.truth.position_in_world[:2], [5.0, 5.0], atol=1e-3)


def test_an_aircraft_of_jsbsim_cannot_be_put_elsewhere():
    pytest.importorskip("jsbsim")
    robot = load_robot("navion")
    settings = PlantSettings(
        robot="navion", task="fly_hold", backend="jsbsim", start=(0.0, 0.0, 100.0, 0.0, 0.0, 0.0)
    )
    simulator = make_backend(robot, settings)
    with pytest.raises(ConfigError, match="cannot put 'navion' elsewhere"):
        simulator.place(first_episode(robot, settings).start.to_rigid())
    simulator.close()
