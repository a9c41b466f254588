"""Things in space in the worlds of tasks: which tasks take one, and what counts as a failure beside it."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from fulmar_core.worlds.structures import load_structure

ROBOT = load_robot("int_ball2")


def at(*places: tuple[float, float, float]) -> SpatialState:
    x, y, z = np.array(places).T
    none = np.zeros_like(x)
    return SpatialState.at_rest((x, y, z), (none, none, none, none + 1.0))


def test_a_task_of_free_flyers_takes_any_thing_and_has_it_in_its_world() -> None:
    task = load_task("go_to_pose_3d", "iss")
    assert task.structures == (load_structure("iss"),)
    assert task.keep_outs == (load_structure("iss").keep_out,)
    assert load_task("go_to_pose_3d").structures == ()


def test_to_be_within_the_keep_out_volume_counts_as_touching_in_numpy_and_torch() -> None:
    task = load_task("go_to_pose_3d", "gateway")
    radius = task.keep_outs[0].radius
    state = at((radius - 0.01, 0.0, 0.0), (0.0, radius + 0.01, 0.0))
    goal = draw_episode(ROBOT, task, load_scenario("ideal"), seed=0, number=0).goal
    assert task.collides(state, goal, ROBOT).tolist() == [True, False]
    in_torch = SpatialState(*(torch.tensor(column) for column in state.columns()))
    assert task.collides(in_torch, goal, ROBOT).tolist() == [True, False]
    assert load_task("go_to_pose_3d").collides(state, goal, ROBOT) is None


@pytest.mark.parametrize("task", ["go_to_pose", "point", "fly_hold"])
def test_a_task_whose_robots_do_not_fly_in_space_takes_no_thing(task: str) -> None:
    with pytest.raises(ConfigError, match=f"'gateway' stands in space, and task '{task}' is for robots that"):
        load_task(task, "gateway")


def test_an_unknown_thing_is_said_with_the_nearest_before_anything_starts() -> None:
    with pytest.raises(UnknownNameError, match="unknown thing 'issa'"):
        load_task("go_to_pose_3d", "issa")
