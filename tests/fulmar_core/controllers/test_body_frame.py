"""What classical laws compute with: the inputs of a step in the body's own frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.paths import config_names
from fulmar_core.controllers.body_frame import BodyFrame
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.obstacles import FAR, SIGHT
from fulmar_core.tasks.shortest_paths import TOUCHING
from fulmar_core.tasks.track_velocities import ERROR_TERMS
from fulmar_core.worlds.scenario import load_scenario
from tests.inputs import inputs_at, inputs_of

ROBOT = load_robot("turtlebot2")
TASKS = {  # `test_space_frame.py` has those of space
    name: task.fitted(ROBOT)
    for name, task in ((name, load_task(name)) for name in config_names("tasks"))
    if task.state_type is ROBOT.state_type
}


@pytest.fixture(params=TASKS.values(), ids=TASKS)
def moment(request):
    """A frame, inputs of robots under way, and what the task itself shows of them by its names."""
    task, rng = request.param, np.random.default_rng(2)
    simulation = BatchSimulation(ROBOT, task, load_scenario("ideal"), worlds=30, seed=6, dtype=np.float64)
    done = rng.integers(0, simulation.goal.targets.shape[1], 30).astype(float)
    state = PlanarState(*(rng.normal(size=30) for _ in range(6)))
    simulation.put(state, replace(simulation.goal, done=done), simulation.command)
    inputs = inputs_of(simulation)
    shown = dict(zip(task.observation_names, inputs.observation.T, strict=False))
    return BodyFrame(ROBOT, task), inputs, shown


def test_it_agrees_with_what_the_task_shows_a_network(moment):
    frame, inputs, shown = moment
    found = dict(
        zip(("velocity_x_in_body", "velocity_y_in_body", "yaw_rate"), frame.motion(inputs), strict=True)
    )
    if "goal_x_in_body" in shown:
        found["goal_x_in_body"], found["goal_y_in_body"] = frame.goal(inputs)
    if "goal_direction_x_in_body" in shown:
        ahead, left = frame.goal(inputs)
        found["goal_distance"] = np.hypot(ahead, left)
        found["goal_direction_x_in_body"] = ahead / found["goal_distance"]
        found["goal_direction_y_in_body"] = left / found["goal_distance"]
    if frame.passes:
        (ahead, left), (leg_x, leg_y) = frame.goal(inputs), frame.next_leg(inputs)
        assert shown["next_goal_distance"] == pytest.approx(np.hypot(ahead + leg_x, left + leg_y))
    if frame.tracks:
        errors = (
            want - have for want, have in zip(frame.wanted_motion(inputs), frame.motion(inputs), strict=True)
        )
        found |= dict(zip(ERROR_TERMS, errors, strict=True))
    common = [name for name in found if name in shown]
    assert len(common) >= 3
    for name in common:
        np.testing.assert_allclose(found[name], shown[name], rtol=0, atol=1e-9, err_msg=name)


def test_the_turn_is_the_wanted_heading_minus_the_heading_and_nothing_where_a_task_has_none(moment):
    frame, inputs, _ = moment
    turn = frame.body_state(inputs).turn
    if not frame.heads:
        np.testing.assert_array_equal(turn, 0.0)
        return
    assert np.abs(turn).max() <= np.pi
    np.testing.assert_allclose(np.cos(inputs.state.yaw + turn), np.cos(inputs.goal.current[:, 2]), atol=1e-9)


def test_without_an_estimate_nothing_pushes_and_no_valve_is_known_dead(moment):
    frame, inputs, _ = moment
    situation = frame.body_state(inputs)
    np.testing.assert_array_equal(situation.push, np.zeros((30, 3)))
    assert situation.alive is None


def test_obstacles_out_of_sight_lie_far_behind_and_the_others_where_they_are():
    task = TASKS["go_to_position_with_obstacles"]
    discs = np.array([[0.0, 2.0, 0.3], [SIGHT + 1.0, 0.0, 0.3], [1.0, 0.0, 0.0]])
    state = PlanarState(*(np.array([value]) for value in (0.0, 0.0, np.pi / 2, 0.0, 0.0, 0.0)))
    simulation = BatchSimulation(ROBOT, task, load_scenario("ideal"), worlds=1, seed=1, dtype=np.float64)
    goal = task.surveyed(replace(simulation.goal, obstacles=discs[None]), ROBOT)
    x, y, wide = BodyFrame(ROBOT, task).obstacles(inputs_at(ROBOT, task, state, goal))
    np.testing.assert_allclose(x[0], [2.0, -FAR, -FAR], atol=1e-9)
    np.testing.assert_allclose(y[0], [0.0, 0.0, 0.0], atol=1e-9)
    assert wide[0, 0] == pytest.approx(TOUCHING * (0.3 + task.obstacles.clearance(ROBOT)))
