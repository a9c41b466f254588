"""Targets in their order."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks.goal import Goal, goal_at, no_obstacles, offset_to, stack_goals

PATH = ((1.0, 0.0, 0.1), (2.0, 0.0, 0.2), (3.0, 0.0, 0.3))


def batch(*done):
    return Goal(
        np.array([PATH] * len(done)),
        np.array(done, dtype=float),
        no_obstacles(len(done)),
        {"gate": np.arange(3.0 * len(done)).reshape(-1, 3)},
    )


def test_targets_come_one_after_another_and_the_first_after_the_last():
    goal = batch(0, 1, 2, 3, 7)
    assert goal.current[:, 0].tolist() == [1.0, 2.0, 3.0, 1.0, 2.0]
    assert goal.ahead(1)[:, 0].tolist() == [2.0, 3.0, 1.0, 2.0, 3.0]
    assert goal.ahead(-1)[:, 0].tolist() == [3.0, 1.0, 2.0, 3.0, 1.0]


def test_a_single_goal_and_a_grid_of_goals_know_theirs_too():
    one = goal_at(*PATH)
    assert one.current.tolist() == list(PATH[0])
    grid = Goal(
        np.array([[PATH] * 2] * 2),
        np.array([[0.0, 1.0], [2.0, 3.0]]),
        np.zeros((2, 2, 0, 3)),
    )
    assert grid.current[..., 0].tolist() == [[1.0, 2.0], [3.0, 1.0]]


def test_the_only_target_is_the_current_one_for_ever():
    goal = goal_at((4.0, 5.0, 6.0))
    for further in range(3):
        assert goal.ahead(further).tolist() == [4.0, 5.0, 6.0]


def test_goals_stack_are_picked_and_overwritten_world_by_world():
    gates = {"gate": np.ones(3)}
    goals = stack_goals([goal_at(*PATH).among(gates), goal_at(*PATH[::-1]).among(gates)])
    assert goals.current[:, 0].tolist() == [1.0, 3.0]
    assert goals[1].current.tolist() == list(PATH[2])
    goals.write([0], batch(2))
    assert goals.current[:, 0].tolist() == [3.0, 3.0]
    assert goals.done.tolist() == [2.0, 0.0]
    assert goals.things["gate"].tolist() == [[0.0, 1.0, 2.0], [1.0, 1.0, 1.0]]


def test_the_offset_leads_from_the_body_to_the_target():
    state = PlanarState(*(np.full(1, value) for value in (1.0, 1.0, 0.0, 0.0, 0.0, 0.0)))
    dx, dy = offset_to(state, np.array([[3.0, 0.0, 0.0]]))
    assert (dx[0], dy[0]) == (2.0, -1.0)


@pytest.mark.parametrize("done", [(0,), (0, 1, 2, 4)])
def test_torch_finds_the_targets_that_numpy_does(done):
    torch = pytest.importorskip("torch")
    goal = batch(*done)
    same = goal.mapped(torch.as_tensor)
    for further in (0, 1):
        np.testing.assert_array_equal(same.ahead(further).numpy(), goal.ahead(further))
