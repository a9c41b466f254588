"""What is left in the tank as a term of the observation, where the robot's file asks for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.loop.rollout import roll_out_in_backends
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episodes
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.tasks import load_task
from fulmar_core.tasks.observation import Observer
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes.mock_backend import MockBackend

PLAIN, TASK, IDEAL = load_robot("cubesat_8"), load_task("go_to_pose_3d"), load_scenario("ideal")
ROBOT = replace(PLAIN, sensors=replace(PLAIN.sensors, fuel=replace(PLAIN.sensors.fuel, observed=True)))


class Open:
    """Opens every valve, and keeps what it observed."""

    name, control_hz, estimator, observer, plans_ahead = "open", 10.0, None, None, False

    def __init__(self, readings=()):
        self.readings, self.seen = readings, []

    def reset(self):
        """Nothing is kept."""

    def act(self, inputs):
        self.seen.append(inputs.observation[0])
        return np.ones_like(inputs.previous)


def test_the_share_comes_last_and_changes_no_other_term():
    batches = [BatchSimulation(robot, TASK, IDEAL, worlds=3, seed=1) for robot in (PLAIN, ROBOT)]
    for batch in batches:
        for _ in range(10):
            batch.move(np.ones((3, 8)))
    plain, observed = (np.asarray(batch.observe()) for batch in batches)
    np.testing.assert_array_equal(observed[:, :-1], plain)
    lost = np.asarray(batches[1]._actuation.lost)
    np.testing.assert_allclose(observed[:, -1], 1.0 - lost / ROBOT.actuators.tank.content, rtol=1e-6)
    np.testing.assert_array_equal(np.asarray(batches[1].observe(np.array([2]))), observed[2:])
    assert (Observer(PLAIN, TASK).readings, Observer(ROBOT, TASK).readings) == ((), ("fuel",))
    assert Observer(ROBOT, TASK).names == (*Observer(PLAIN, TASK).names, "fuel_share")


def test_a_robot_observes_its_newest_reading_and_a_full_tank_before_the_first():
    loop = ControlLoop(ROBOT, TASK, Open())
    drawn = draw_episodes(ROBOT, TASK, IDEAL, seed=1, numbers=np.arange(1))
    loop.begin(drawn.goal)
    shares = [
        loop.step(drawn.start, readings, stamp).observation[0, -1]
        for stamp, readings in enumerate(({}, {"fuel": np.array([[0.6, 0.58]])}, {}))
    ]
    assert shares == [1.0, 0.58, 0.58]


def test_the_share_falls_in_a_flight_of_a_simulator_by_its_gauge():
    controller = Open(Observer(ROBOT, TASK).readings)
    task = replace(TASK, episode_s=5.0)
    roll_out_in_backends(
        controller, lambda: MockBackend(ROBOT), task=task, scenario=IDEAL, episodes=1, seed=1
    )
    shares = np.array(controller.seen)[:, -1]
    assert shares[0] == pytest.approx(1.0)
    assert shares[-1] == pytest.approx(1.0 - 8.0 * 4.9 / 687.0, abs=2e-3)  # 8 N, as old as the gauge's period
    assert (np.diff(shares) <= 0.0).all()
