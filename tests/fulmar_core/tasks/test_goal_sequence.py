"""Goals of a file in their order: what counts at a place and a time."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import GOAL_WIRES
from fulmar_core.states.planar import PlanarState, at_rest
from fulmar_core.tasks.goal_files import FollowedPath, HeldVelocity, Poses, Positions, Velocities, load_goals
from fulmar_core.tasks.goal_sequence import goal_sequence
from fulmar_core.tasks.references.curves import Circle

PLATFORM = load_robot("floating_platform")
CORNERS = Positions("positions", "two corners", ((1.0, 0.0), (1.0, 2.0)))
RING = FollowedPath("path", "ring", Circle("circle", radius=1.0), speed=0.25, look_ahead=0.1)


def at(x: float, y: float, degrees: float = 0.0):
    return at_rest(np.asarray(x), np.asarray(y), np.asarray(math.radians(degrees)))


def drive(sequence, robot_moves_sideways: bool, *, seconds: float, start=(1.2, 0.0, 90.0), dt: float = 0.05):
    """A robot that applies its command at once; the places it passes, and the last goal."""
    x, y, yaw = start[0], start[1], math.radians(start[2])
    places, goal = [], None
    for step in range(int(seconds / dt)):
        goal = sequence.step(at(x, y, math.degrees(yaw)), step * dt)
        ahead, left, turn = goal.current
        assert robot_moves_sideways or left == 0.0
        x += dt * (ahead * math.cos(yaw) - left * math.sin(yaw))
        y += dt * (ahead * math.sin(yaw) + left * math.cos(yaw))
        yaw += dt * turn
        places.append((x, y))
        if sequence.done:
            break
    return np.array(places), goal


@pytest.mark.parametrize("name", [n for n in config_names("goals") if not n.startswith("excite_")])
@pytest.mark.parametrize(
    "robot", ["floating_platform", "kingfisher", "turtlebot2", "leatherback", "spacecraft_16"]
)
def test_every_shipped_file_begins_with_a_goal_for_every_family_of_its_space(name, robot):
    file, the_robot = load_goals(name), load_robot(robot)
    form = file.form
    if form is not the_robot.state_type:
        with pytest.raises(ConfigError, match=f"is in {form.WORLD}"):
            goal_sequence(file, the_robot)
        return
    sequence = goal_sequence(file, the_robot)
    goal = sequence.step(form.resting(form.target_at((0.1, 0.2, 0.3))), 0.0)
    assert sequence.topic in GOAL_WIRES
    assert goal.targets.shape == (1, 3 if form is PlanarState else 7) and np.isfinite(goal.targets).all()
    assert not sequence.done


def test_a_position_gives_way_to_the_next_after_a_moment_there():
    sequence = goal_sequence(CORNERS, PLATFORM)
    assert sequence.topic == "goal_point"
    assert sequence.step(at(0.0, 0.0), 0.0).current[:2].tolist() == [1.0, 0.0]
    assert sequence.step(at(0.95, 0.0), 1.0).current[1] == 0.0
    assert sequence.step(at(0.95, 0.0), 1.9).current[1] == 0.0
    assert sequence.step(at(0.95, 0.0), 2.0).current[1] == 2.0
    assert sequence.progress == "1 of 2 targets reached" and not sequence.done


def test_who_leaves_a_target_too_early_has_to_come_back():
    sequence = goal_sequence(CORNERS, PLATFORM)
    for time_s, x in ((0.0, 1.0), (0.5, 1.2), (1.0, 1.0), (1.9, 1.0)):
        assert sequence.step(at(x, 0.0), time_s).current[1] == 0.0
    assert sequence.step(at(1.0, 0.0), 2.0).current[1] == 2.0


def test_after_the_last_target_the_goal_stays_and_the_sequence_is_done():
    sequence = goal_sequence(CORNERS, PLATFORM)
    for time_s, y in ((0.0, 0.0), (1.0, 0.0), (2.0, 2.0), (3.0, 2.0), (4.0, 5.0)):
        goal = sequence.step(at(1.0, y), time_s)
    assert sequence.done
    assert goal.current.tolist() == [1.0, 2.0, 0.0]


def test_a_pose_is_not_reached_with_another_heading():
    sequence = goal_sequence(Poses("poses", "turned", ((0.0, 0.0, 180.0),)), PLATFORM)
    assert sequence.topic == "goal_pose"
    for time_s, heading in ((0.0, 160.0), (2.0, 160.0), (3.0, -175.0), (3.5, -175.0)):
        sequence.step(at(0.0, 0.0, heading), time_s)
        assert not sequence.done
    sequence.step(at(0.0, 0.0, -175.0), 4.0)
    assert sequence.done


def test_as_a_path_all_targets_are_published_and_passing_them_is_enough():
    sequence = goal_sequence(CORNERS, PLATFORM, as_path=True)
    assert sequence.topic == "goal_path"
    assert sequence.step(at(0.0, 0.0), 0.0).targets.shape == (2, 3)
    assert sequence.step(at(1.0, 0.15), 0.1).targets.shape == (2, 3)
    assert sequence.step(at(1.0, 1.9), 0.2).targets.shape == (2, 3)
    assert sequence.done


@pytest.mark.parametrize("name", ["circle", "velocity_steps"])
def test_velocities_are_no_path_of_waypoints(name):
    with pytest.raises(ConfigError, match="only positions and poses"):
        goal_sequence(load_goals(name), PLATFORM, as_path=True)


def test_velocities_follow_the_clock_and_end_in_standstill():
    held = (HeldVelocity((0.3, 0.0, 0.0), 2.0), HeldVelocity((0.0, 0.1, 90.0), 1.0))
    sequence = goal_sequence(Velocities("velocities", "two", held), PLATFORM)
    goals = [sequence.step(at(0.0, 0.0), time_s).current for time_s in (0.0, 1.9, 2.0, 2.9)]
    np.testing.assert_allclose(goals, [[0.3, 0, 0], [0.3, 0, 0], [0, 0.1, np.pi / 2], [0, 0.1, np.pi / 2]])
    assert not sequence.done
    assert not sequence.step(at(0.0, 0.0), 3.0).current.any()
    assert sequence.done


def test_a_robot_that_moves_sideways_follows_a_circle_without_turning():
    sequence = goal_sequence(RING, PLATFORM)
    places, last = drive(sequence, True, seconds=60.0)
    assert sequence.done and not last.current.any()
    assert np.abs(np.linalg.norm(places[100:], axis=1) - 1.0).max() < 0.02
    assert sequence.progress == "1 of 1 rounds"


@pytest.mark.parametrize("robot", ["kingfisher", "turtlebot2", "jetbot", "leatherback"])
def test_a_robot_that_cannot_move_sideways_steers_round(robot):
    sequence = goal_sequence(RING, load_robot(robot))
    places, last = drive(sequence, False, seconds=60.0)
    assert sequence.done and not last.current.any()
    assert np.abs(np.linalg.norm(places[100:], axis=1) - 1.0).max() < 0.35


def test_a_round_begins_where_the_robot_meets_the_path():
    for degrees in (10.0, 180.0, 350.0):
        sequence = goal_sequence(RING, PLATFORM)
        angle = math.radians(degrees)
        start = (math.cos(angle), math.sin(angle), 0.0)
        places, _ = drive(sequence, True, seconds=60.0, start=start)
        length = np.linalg.norm(np.diff(places, axis=0), axis=1).sum()
        assert length == pytest.approx(2 * math.pi, rel=0.05)


def test_an_open_path_is_followed_from_its_beginning_to_its_end():
    spiral = load_goals("spiral")
    points = spiral.planner().points
    sequence = goal_sequence(spiral, PLATFORM)
    places, last = drive(sequence, True, seconds=400.0, start=(points[-1, 0], points[-1, 1], 0.0))
    assert sequence.done and not last.current.any()
    assert sequence.progress == "the path is at its end"
    assert np.linalg.norm(places - points[0], axis=1).min() < 0.3
    assert np.linalg.norm(places[-1] - points[-1]) < 0.1


def test_waypoints_go_on_where_the_node_before_was():
    first, second = goal_sequence(CORNERS, PLATFORM), goal_sequence(CORNERS, PLATFORM)
    for time_s in (0.0, 1.0, 2.0):
        first.step(at(1.0, 0.0), time_s)
    second.go_on_at(first.place)
    assert second.progress == first.progress == "1 of 2 targets reached"
    assert second.step(at(1.0, 1.0), 0.0).current[1] == 2.0
    second.go_on_at({"reached": 7})  # of another file
    assert second.done


@pytest.mark.parametrize("goals", [RING, load_goals("spiral")], ids=["closed", "open"])
def test_a_path_goes_on_where_the_node_before_was(goals):
    first, second = goal_sequence(goals, PLATFORM), goal_sequence(goals, PLATFORM)
    places, _ = drive(first, True, seconds=28.0)
    assert first.place != second.place
    second.go_on_at(first.place)
    goal = second.step(at(*places[-1]), 0.0)
    assert second.place.get("laps") == first.place.get("laps")
    assert second.place.get("index", 0) >= first.place.get("index", 0)
    assert goal.current == pytest.approx(first.step(at(*places[-1]), 28.0).current, abs=0.05)
