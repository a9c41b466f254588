"""One aircraft is computed in plain numbers: the bits of a batch, in a fraction of its calls."""

from __future__ import annotations

import sys

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
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task

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


def controllers():
    robot, task = load_robot("airship_v7"), load_task("fly_b")
    return robot, task, FlightLqi(robot, task, gains_of(robot, "lqi"))


def test_the_lqi_of_one_craft_commands_what_it_commands_among_others():
    robot, task, _ = controllers()
    laws = [FlightLqi(robot, task, gains_of(robot, "lqi")) for _ in range(2)]
    states, _ = upset(robot, 3)
    states = SpatialState(0.0 * states.x, *states.columns()[1:])
    loops = [ControlLoop(robot, task, law, robots=count) for law, count in zip(laws, (1, 3), strict=True)]
    goal = task.goal_of(_path(task))
    loops[0].begin(goal)
    loops[1].begin(goal.mapped(lambda part: np.repeat(part, 3, axis=0)))
    for step in range(5):
        stamp = round(1e7) * (step + 1)
        alone, together = loops[0].step(states[:1], {}, stamp), loops[1].step(states, {}, stamp)
        assert alone.observation.tobytes() == together.observation[:1].copy().tobytes()
        assert np.allclose(alone.command, together.command[:1], rtol=1e-12, atol=1e-14)


def test_a_control_step_of_an_aircraft_makes_a_third_of_the_calls_that_arrays_take():
    robot, task, law = controllers()
    loop = ControlLoop(robot, task, law)
    loop.begin(task.goal_of(_path(task)))
    state, _ = upset(robot, 1)
    for step in range(3):
        loop.step(state, {}, round(1e7) * (step + 1))
    assert calls_of(lambda: loop.step(state, {}, round(4e7))) < 1800  # 3,900 in arrays


def _path(task) -> np.ndarray:
    places = np.zeros((40, 7))
    places[:, 0], places[:, 2], places[:, 6] = 2.8 * np.arange(40), 1.0 + 0.01 * np.arange(40), 1.0
    return places


def calls_of(act) -> int:
    """Calls that an action makes, those into C included."""
    count = 0

    def note(_frame, event, _arg):
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(note)
    try:
        act()
    finally:
        sys.setprofile(None)
    return count
