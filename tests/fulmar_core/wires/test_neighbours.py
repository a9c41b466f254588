"""Messages of where other robots are: read as they were written, and refused where they are not whole."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from fulmar_core.wires.neighbours import DRIVEN, NEIGHBOURS, motions_in, readings_of


def message(name=("beta/x", "beta/y"), position=(1.0, 2.0), velocity=(0.1, 0.2), effort=()):
    return SimpleNamespace(name=name, position=position, velocity=velocity, effort=effort)


def test_each_robot_has_its_place_and_its_velocity():
    found = motions_in(
        message(
            ("beta/x", "beta/y", "boat/x", "boat/y"), (1.0, 2.0, 3.0, 4.0), (0.1, 0.2, 0.3, 0.4), (0, 0, 1, 1)
        )
    )
    assert found is not None
    np.testing.assert_array_equal(found["boat"], (3.0, 4.0, 0.3, 0.4, 1.0))
    rows = readings_of(found, ["boat", "beta"])
    assert rows is not None
    np.testing.assert_array_equal(rows[NEIGHBOURS], [[3.0, 4.0, 0.3, 0.4, 1.0, 2.0, 0.1, 0.2]])
    np.testing.assert_array_equal(rows[DRIVEN], [[1.0, 0.0]])
    assert readings_of(found, ["beta", "gamma"]) is None


def test_robots_of_a_message_without_efforts_are_driven():
    found = motions_in(message())
    assert found is not None and found["beta"][4] == 1.0


@pytest.mark.parametrize(
    "changed",
    [
        {"name": ("beta/x",)},
        {"name": ("beta/y", "beta/x")},
        {"name": ("beta/x", "boat/y")},
        {"position": (1.0,)},
        {"velocity": ()},
        {"effort": (1.0,)},
        {"position": (np.nan, 0.0)},
    ],
)
def test_what_is_not_whole_is_no_message(changed):
    assert motions_in(message(**changed)) is None
