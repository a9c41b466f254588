"""Quick tests of pairs leave out no robot and no task."""

from __future__ import annotations

import itertools

from tests.pairs import covering


def test_a_covering_choice_holds_every_robot_and_every_task_and_robots_take_turns():
    chosen = covering(itertools.product("abc", range(7)))
    assert {robot for robot, _ in chosen} == set("abc")
    assert {task for _, task in chosen} == set(range(7))
    assert len(chosen) == 7


def test_a_robot_whose_every_task_is_taken_comes_once_all_the_same():
    assert covering([("a", 1), ("b", 1), ("c", 2)]) == {("a", 1), ("b", 1), ("c", 2)}
