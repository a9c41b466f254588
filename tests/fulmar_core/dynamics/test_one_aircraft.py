"""One aircraft is computed in plain numbers, to the bits of a batch."""

from __future__ import annotations

import copy
import functools

import numpy as np
import pytest

from fulmar_core.config.paths import config_names
from fulmar_core.controllers.classical import gains_of
from fulmar_core.controllers.flight_lqi import FlightLqi
from fulmar_core.dynamics.batch_dynamics import Steps
from fulmar_core.dynamics.by_kind import actuation_of
from fulmar_core.dynamics.flight_dynamics import FlightDynamics
from fulmar_core.dynamics.flight_trim import find_trim, still_air
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.states.arrays import is_number
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes.mujoco_backend import MujocoBackend

AIRCRAFT = [name for name in config_names("robots") if load_robot(name).flies]


def bits(state: SpatialState) -> bytes:
    return b"".join(np.asarray(column, dtype=float).tobytes() for column in state.columns())


def upset(robot, count: int) -> tuple[SpatialState, np.ndarray]:
    """States of craft that are off their trim, shapes (count,), and the command of it, shape (m, count)."""
    trim, draws = find_trim(robot, robot.airframe.speed, 2.0 * robot.airframe.span), np.random.default_rng(3)
    columns = [float(part) + draws.uniform(-0.05, 0.05, count) for part in trim.state.columns()]
    return SpatialState(*columns), np.repeat(trim.command[:, None], count, axis=1)


@pytest.mark.parametrize("name", AIRCRAFT)
def test_an_aircraft_moves_in_plain_numbers_as_it_does_among_others(name):
    robot, count = load_robot(name), 3
    together, command = upset(robot, count)
    dynamics, steps, alone = FlightDynamics(robot, turbulent=False), Steps(4), together[:1].in_numbers()
    world, own = still_air(robot, count), still_air(robot, 1)
    every, one = actuation_of(robot, 0.9 * command), actuation_of(robot, 0.9 * command[:, :1])
    every.begin(command, world, None)
    one.begin(command[:, :1], own, None)
    together = dynamics.move(together, every, world, (np.zeros(count),) * 3, steps)
    alone = dynamics.move(alone, one, own.in_numbers(), (0.0,) * 3, steps)
    assert bits(alone) == bits(together[0])
    assert one.applied.tobytes() == every.applied[:, :1].copy().tobytes()
    assert one.servo_rates.tobytes() == every.servo_rates[:, :1].copy().tobytes()


def test_craft_that_do_not_fly_stop_in_plain_numbers_too():
    robot = load_robot("airship_v7")
    state, command = upset(robot, 1)
    under = SpatialState(state.x, state.y, 0.0 * state.z - 1.0, *state.columns()[3:]).in_numbers()
    actuation, world = actuation_of(robot, command), still_air(robot, 1)
    after = FlightDynamics(robot, turbulent=False).move(
        under, actuation, world.in_numbers(), (0.0,) * 3, Steps(1)
    )
    assert after == under.stopped()


@functools.cache
def law() -> FlightLqi:
    robot, task = load_robot("airship_v7"), load_task("fly_b")
    return FlightLqi(robot, task, gains_of(robot, "lqi"))


def test_the_lqi_of_one_craft_sees_and_commands_what_it_does_among_others():
    robot, task = law().robot, law().task
    states, _ = upset(robot, 3)
    loops = [ControlLoop(robot, task, copy.deepcopy(law()), robots=count) for count in (1, 3)]
    for loop, count in zip(loops, (1, 3), strict=True):
        loop.begin(goal_of(task).mapped(lambda part, count=count: np.repeat(part, count, axis=0)))
    terms = len(task.observation_names)  # those after it are of commands, which sums of other lengths round
    for step in range(1, 6):
        alone, among = (loop.step(states[: len(loop.previous)], {}, round(1e7) * step) for loop in loops)
        assert alone.observation[0, :terms].tolist() == among.observation[0, :terms].tolist()
        np.testing.assert_allclose(alone.command, among.command[:1], rtol=1e-11, atol=1e-13)


def test_the_observer_of_one_craft_and_its_simulator_evaluate_the_model_in_plain_numbers(monkeypatch):
    seen, wrench = [], FlightDynamics.wrench

    def noted(self, state, *others):
        seen.append(all(is_number(column) for column in state.columns()))
        return wrench(self, state, *others)

    monkeypatch.setattr(FlightDynamics, "wrench", noted)
    robot, task = law().robot, law().task
    loop, (state, _) = ControlLoop(robot, task, copy.deepcopy(law())), upset(robot, 1)
    loop.begin(goal_of(task))
    loop.step(state, {}, round(1e7))
    seen.clear()
    for step in range(2, 4):
        loop.step(state, {}, round(1e7) * step)
    assert seen == [True] * (2 * 4)  # four slopes of each prediction
    backend = MujocoBackend(robot)
    backend.reset(draw_episode(robot, task, load_scenario("severe_turbulence"), seed=1, number=0), seed=1)
    seen.clear()
    backend.step(robot.actuators.safe_command)
    assert seen == [True] * 2  # steps of MuJoCo in a tick


def goal_of(task):
    places = np.zeros((40, 7))
    places[:, 0], places[:, 2], places[:, 6] = 2.8 * np.arange(40), 1.0 + 0.01 * np.arange(40), 1.0
    return task.goal_of(places).mapped(lambda part: np.asarray(part)[None])
