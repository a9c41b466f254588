"""Modules and folders do not import each other in a circle, and the rooms of the core import lower ones alone."""

from __future__ import annotations

import grimp
import pytest

from tests.architecture.rooms import circles, figures, house, imports


@pytest.fixture(scope="module")
def graph() -> grimp.ImportGraph:
    return house()


def test_no_modules_import_each_other_in_a_circle(graph: grimp.ImportGraph) -> None:
    """Also not inside functions or for type checkers."""
    assert circles(imports(graph)) == []


def test_no_folders_import_each_other_and_no_room_imports_a_higher_one(graph: grimp.ImportGraph) -> None:
    found = figures(graph)
    assert (found.circles, found.upward, found.loose) == ([], [], [])


@pytest.mark.parametrize(
    ("arrows", "found"),
    [
        (["ab", "bc"], []),
        (["ab", "ba"], [["a", "b"]]),
        (["ab", "bc", "ca", "cd"], [["a", "b", "c"]]),
    ],
)
def test_a_circle_is_found(arrows: list[str], found: list[list[str]]) -> None:
    assert circles((arrow[0], arrow[1]) for arrow in arrows) == found
