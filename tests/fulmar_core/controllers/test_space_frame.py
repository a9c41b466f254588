"""What laws in space compute with: the inputs of a step in the body's own frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.paths import config_names
from fulmar_core.controllers.space_frame import SpaceFrame
from fulmar_core.robots.kinds.free_flyer import FREE_FLYER
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.attitude import first_rows, length, normalised
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.space_terms import AXES, ROTATION_TERMS
from fulmar_core.worlds.scenario import load_scenario
from tests.inputs import inputs_of
from tests.spaces import SPACECRAFT

TASKS = {
    name: task
    for name, task in ((name, load_task(name)) for name in config_names("tasks"))
    if FREE_FLYER in task.kinds and name != "dock"  # which shows a network nothing of the goal
}
COUNT = 30


@pytest.fixture(params=TASKS.values(), ids=TASKS)
def moment(request):
    """A frame, inputs of bodies under way, and what the task itself shows of them by its names."""
    task, rng = request.param, np.random.default_rng(2)
    simulation = BatchSimulation(
        SPACECRAFT, task, load_scenario("ideal"), worlds=COUNT, seed=6, dtype=np.float64
    )
    done = rng.integers(0, simulation.goal.targets.shape[1], COUNT).astype(float)
    columns = rng.normal(size=(13, COUNT))
    columns[3:7] = normalised(tuple(columns[3:7]))
    simulation.put(SpatialState(*columns), replace(simulation.goal, done=done), simulation.command)
    inputs = inputs_of(simulation)
    return (
        SpaceFrame(task),
        inputs,
        dict(zip(task.observation_names, inputs.observation.T, strict=True)),
    )


def vector(shown, *names):
    return np.stack([shown[name] for name in names], axis=-1)


def axes(before, after):
    return [f"{before}{axis}{after}" for axis in AXES]


def test_it_agrees_with_what_the_task_shows_a_network(moment):
    frame, inputs, shown = moment
    now = frame.motion(inputs)
    pairs = [
        (now.moving, vector(shown, *axes("velocity_", "_in_body"))),
        (now.turning, vector(shown, *axes("turn_rate_", ""))),
    ]
    if frame.tracks:
        pairs += [
            (-now.velocity, vector(shown, *axes("velocity_error_", "_in_body"))),
            (-now.rate, vector(shown, *axes("turn_rate_error_", ""))),
            (now.way, np.zeros((COUNT, 3))),
        ]
    elif frame.passes:
        way = shown["goal_distance"][:, None] * vector(shown, *axes("goal_direction_", "_in_body"))
        after = shown["next_goal_distance"][:, None] * vector(
            shown, *axes("next_goal_direction_", "_in_body")
        )
        pairs += [(now.way, way), (now.way + frame.next_leg(inputs), after)]
    else:
        pairs += [(now.way, vector(shown, *axes("goal_", "_in_body")))]
        np.testing.assert_allclose(length(tuple(now.way.T)), shown["goal_distance"], rtol=0, atol=1e-9)
    for found, expected in pairs:
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)


def test_the_rotation_is_that_to_the_wanted_attitude_and_none_where_a_task_has_none(moment):
    frame, inputs, shown = moment
    rotation = np.stack(first_rows(frame.motion(inputs).to_goal), axis=-1)
    named = "goal_" if frame.passes else ""
    assert frame.heads == (f"{named}rotation_to_goal_11" in shown)
    expected = np.tile([1.0, 0.0, 0.0, 0.0, 1.0, 0.0], (COUNT, 1))
    if frame.heads:
        expected = vector(shown, *(f"{named}{term}" for term in ROTATION_TERMS))
    np.testing.assert_allclose(rotation, expected, rtol=0, atol=1e-9)


def test_without_an_estimate_no_valve_is_known_dead(moment):
    frame, inputs, _ = moment
    assert frame.motion(inputs).alive is None
