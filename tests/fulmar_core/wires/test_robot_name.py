"""Names of robots: which ones ROS takes, and what namespace and frames follow from them."""

from __future__ import annotations

import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.wires.robot_name import (
    LONGEST,
    PLAIN,
    check_robot_name,
    checked_name,
    frames_of,
    namespace_of,
)


@pytest.mark.parametrize("name", ["alpha", "a", "robot_2", "x" * LONGEST])
def test_a_name_of_small_letters_digits_and_underscores_is_taken(name):
    assert checked_name(name) == name


@pytest.mark.parametrize(
    "name", ["", "Alpha", "2nd", "_a", "a-b", "a b", "a/b", "ä", "alpha\n", "x" * (LONGEST + 1)]
)
def test_any_other_name_is_refused_with_what_is_allowed(name):
    with pytest.raises(ValueError, match="must begin with a small letter"):
        check_robot_name(name)
    with pytest.raises(ConfigError, match="Example: alpha_2"):
        checked_name(name)


def test_a_name_makes_the_namespace_and_a_name_apart_from_the_type_the_prefix_of_frames():
    assert namespace_of("alpha") == "/alpha"
    assert frames_of("jetbot", "jetbot") == PLAIN
    frames = frames_of("alpha", "jetbot")
    assert (frames.odom, frames.base, frames.named("imu_link")) == (
        "alpha/odom",
        "alpha/base_link",
        "alpha/imu_link",
    )
    assert [frames.named(shared) for shared in ("map", "inertial")] == ["map", "inertial"]


def test_a_frame_is_known_with_the_own_prefix_and_without_it():
    frames = frames_of("alpha", "jetbot")
    assert [frames.plain(name) for name in ("alpha/odom", "odom", "beta/odom", "map")] == [
        "odom",
        "odom",
        "beta/odom",
        "map",
    ]
