"""Robots in closed loop whose sources fail on the way stop, and say why; sound sources are believed."""

from __future__ import annotations

import pytest

pytest.importorskip("filterpy")
pytest.importorskip("mujoco")

from tests.benchmarks.estimator.source_faults import ESTIMATED, ODOMETRY, run

PLATFORM, SPACECRAFT = "floating_platform", "spacecraft_16"
# Until the last command [s]: two input timeouts of 0.4 s, and what the noise allows.
STOPS_S = {
    "pose repeats": 0.8,
    "pose stands with noise": 1.8,
    "inertial unit stands with noise": 2.8,
    "accelerometer ramps 0.2 m/s³": 3.8,
    "gyroscope ramps 0.1 rad/s²": 3.8,
}


@pytest.mark.parametrize("robot", [PLATFORM, SPACECRAFT])
def test_a_robot_whose_motion_capture_freezes_on_the_way_stops_and_does_not_go_on(robot):
    make = ESTIMATED["pose repeats"]
    found = run(robot, scenario="nominal", seed=0, seconds=3.0, odometry=False, moves=True, make=make)
    assert found.last_command_s <= STOPS_S["pose repeats"]
    assert any("frozen" in words for words in found.warnings)


@pytest.mark.slow
@pytest.mark.parametrize("what", STOPS_S)
@pytest.mark.parametrize("robot", [PLATFORM, SPACECRAFT])
def test_a_robot_on_its_way_whose_sources_fail_stops_within_what_the_noise_allows(robot, what):
    found = run(
        robot, scenario="nominal", seed=0, seconds=8.0, odometry=False, moves=True, make=ESTIMATED[what]
    )
    assert found.last_command_s <= STOPS_S[what]
    assert found.warnings


@pytest.mark.slow
@pytest.mark.parametrize("robot", [PLATFORM, SPACECRAFT, "int_ball2", "turtlebot2", "kingfisher"])
@pytest.mark.parametrize("odometry", [True, False], ids=["odometry", "estimator"])
def test_sound_sources_are_never_suspected(robot, odometry):
    for moves in (True, False):
        found = run(robot, scenario="nominal", seed=1, seconds=60.0, odometry=odometry, moves=moves)
        assert found.warnings == {}


def test_poses_that_are_as_late_as_the_robots_file_says_are_no_contradiction():
    found = run("int_ball2", scenario="nominal", seed=0, seconds=8.0, odometry=False, moves=True)
    assert found.warnings == {}
    assert found.error < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("robot", [PLATFORM, "kingfisher", SPACECRAFT])
def test_odometry_whose_pose_stands_while_its_twist_says_motion_stops_a_robot(robot):
    make = ODOMETRY["pose stands with noise"]
    found = run(robot, scenario="nominal", seed=3, seconds=6.0, odometry=True, moves=True, make=make)
    assert found.last_command_s <= 2.0
    assert found.warnings
