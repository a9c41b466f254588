"""Robots at tasks of their space: a few pairs with each at least once are quick tests, all others are slow ones."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping
from typing import Any

import pytest

from tests.spaces import shared_space


def covering(pairs: Iterable[tuple[Hashable, Hashable]]) -> set[tuple[Hashable, Hashable]]:
    """Choose few pairs that hold every robot and every task of all pairs, with the robots taking turns.

    Args:
        pairs: Names of a robot and of a task.

    Returns:
        Those chosen, the same ones each time.
    """
    pairs, chosen = list(pairs), dict[tuple[Hashable, Hashable], None]()
    turns = dict.fromkeys((robot for robot, _ in pairs), 0)
    for task in dict.fromkeys(task for _, task in pairs):
        robot = min((robot for robot, other in pairs if other == task), key=turns.__getitem__)
        turns[robot] += 1
        chosen[robot, task] = None
    for robot, task in pairs:
        if not turns[robot]:
            turns[robot] += 1
            chosen[robot, task] = None
    return set(chosen)


def each_pair(robots: Mapping[str, Any], tasks: Mapping[str, Any]) -> pytest.MarkDecorator:
    """Give a test every robot with every task of its space, as `robot` and `task`; a covering choice is quick.

    Args:
        robots: What the test receives, by name.
        tasks: Same.
    """
    names = shared_space(robots, tasks)
    quick = covering(names)
    return pytest.mark.parametrize(
        ("robot", "task"),
        [
            pytest.param(
                robots[robot],
                tasks[task],
                id=f"{robot}-{task}",
                marks=() if (robot, task) in quick else pytest.mark.slow,
            )
            for robot, task in names
        ],
    )
