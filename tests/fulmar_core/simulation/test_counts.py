"""Counts that no machine can do are rejected with the limit."""

from __future__ import annotations

import sys

import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.counts import MOST, check_count, check_episodes, free_memory

GB = 10**9
ROBOT = load_robot("floating_platform")


def test_more_than_ten_million_are_rejected_with_the_limit():
    check_count("--episodes", MOST)
    with pytest.raises(ConfigError, match="--episodes = 10,000,001 is too many: at most 10,000,000"):
        check_count("--episodes", MOST + 1)


def test_more_memory_than_is_free_is_rejected_with_the_count_that_fits():
    check_count("--worlds", 1000, bytes_each=1e6, free=GB)
    with pytest.raises(ConfigError) as caught:
        check_count("--worlds", 1001, bytes_each=1e6, free=GB)
    assert (
        str(caught.value) == "--worlds = 1,001 needs about 1.0 GB of memory, 1.0 GB are free: at most 1,000."
    )


@pytest.mark.parametrize(
    ("counts", "option"),
    [
        ({"episodes": MOST + 1, "steps": 1}, "--episodes"),
        ({"episodes": 1, "steps": MOST + 1}, "--steps"),
        ({"episodes": 9 * 10**6, "steps": 10**5}, "--episodes"),
        ({"episodes": 9 * 10**6, "steps": 10**5, "worlds": 8 * 10**6}, "--worlds = 8,000,000"),
        ({"episodes": 1, "steps": 1, "jobs": 10**6}, "--jobs"),
    ],
)
def test_each_count_of_an_evaluation_is_checked_by_the_name_of_its_option(counts, option):
    with pytest.raises(ConfigError, match=option):
        check_episodes(ROBOT, **counts)


def test_episodes_in_turns_need_only_the_memory_of_those_at_once():
    check_episodes(ROBOT, episodes=9 * 10**6, steps=300, worlds=1)


def test_a_robot_with_more_actuators_leaves_room_for_fewer_episodes():
    wheels = load_robot("turtlebot2")
    assert _most(wheels) > _most(ROBOT)


def test_the_memory_of_a_container_counts_where_it_is_less_than_that_of_the_machine(tmp_path):
    meminfo = tmp_path / "meminfo"
    meminfo.write_text("MemTotal: 9000000 kB\nMemAvailable:  4000000 kB\n")
    assert free_memory(meminfo, tmp_path) == 4_096_000_000
    (tmp_path / "memory.max").write_text("3000000000\n")
    (tmp_path / "memory.current").write_text("2000000000\n")
    (tmp_path / "memory.stat").write_text("anon 1\ninactive_file 500000000\n")
    assert free_memory(meminfo, tmp_path) == 1_500_000_000
    (tmp_path / "memory.max").write_text("max\n")
    assert free_memory(meminfo, tmp_path) == 4_096_000_000


def test_a_system_that_does_not_state_its_memory_sets_no_limit(tmp_path):
    assert free_memory(tmp_path / "none", tmp_path) == sys.maxsize


def _most(robot):
    """How many episodes of a million steps fit, read from the message."""
    with pytest.raises(ConfigError) as caught:
        check_episodes(robot, episodes=MOST, steps=10**6)
    return int(str(caught.value).rpartition("at most ")[2].rstrip(".").replace(",", ""))


def test_processes_share_the_episodes_unless_each_holds_them_all():
    steps = 10**6
    alone = _most(ROBOT)
    with pytest.raises(ConfigError, match=f"at most {alone // 4:,}"):
        check_episodes(ROBOT, episodes=alone, steps=steps, jobs=4, at_once=4)
    check_episodes(ROBOT, episodes=max(1, alone // 2), steps=steps, jobs=4)
