"""What a page may wish when a person drives, and the mapping of every robot that can be driven."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fulmar_console.live.hands import SHARE, mapping_or_problem, wish_of
from fulmar_core.loop.teleop import NOTHING, Wish
from fulmar_core.robots.robot_file import load_robot


def test_three_numbers_are_a_wish_within_full_and_letting_go_is_none() -> None:
    assert wish_of({"share": [1, -0.5, 7]}) == Wish(1.0, -0.5, 1.0)
    assert wish_of({"share": [1, 0, 0], "deadman": True}) == Wish(1.0, 0.0, 0.0)
    for deadman in (False, 1, "true", None):
        assert wish_of({"share": [1, 0, 0], "deadman": deadman}) is None


@pytest.mark.parametrize(
    "share", [None, "ahead", [1, 0], [1, 0, 0, 0], [1, 0, math.inf], [1, 0, "1"], [True, 0, 0]]
)
def test_a_share_that_is_none_is_refused_in_words(share: object) -> None:
    assert "three" in str(wish_of({"share": share})) or "3 finite numbers" in str(wish_of({"share": share}))


@pytest.mark.parametrize("name", ["floating_platform", "kingfisher"])
def test_no_wish_is_the_safe_command_and_a_full_one_stays_within_what_the_robot_can(name: str) -> None:
    robot = load_robot(name)
    mapping, problem = mapping_or_problem(name)
    assert problem == ""
    assert mapping.names == tuple(robot.actuators.names)
    assert np.array_equal(mapping.command(NOTHING), robot.actuators.safe_command)
    full = np.abs(mapping.command(Wish(1.0, 0.0, 0.0))).max()
    assert 0.0 < full <= (1.0 if robot.actuators.binary else SHARE)


def test_a_robot_that_no_person_drives_is_refused_with_the_reason() -> None:
    mapping, problem = mapping_or_problem("cubesat_wheels")
    assert mapping is None
    assert "cannot be teleoperated" in problem
