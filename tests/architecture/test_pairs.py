"""The subset of robot and task pairs for quick tests."""

from __future__ import annotations

import itertools

from tests.pairs import covering


def test_a_covering_subset_has_every_robot_and_every_task():
    chosen = covering(itertools.product("abc", range(7)))
    assert {robot for robot, _ in chosen} == set("abc")
    assert {task for _, task in chosen} == set(range(7))
    assert len(chosen) == 7


def test_a_robot_is_included_even_if_all_its_tasks_are_taken():
    assert covering([("a", 1), ("b", 1), ("c", 2)]) == {("a", 1), ("b", 1), ("c", 2)}
