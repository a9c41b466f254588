"""Following a path by looking ahead."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.tasks.references import BernoulliLemniscate, Circle, InfiniteSquare, Sine, Spiral, Square
from fulmar_core.tasks.references.look_ahead import LookAhead, Progress, body_target, follow, steered_target

CIRCLE = Circle("circle", 1.5)
DT = 0.05


def drive(planner, start, *, most_s=200.0):
    """A robot that has the wanted velocity at once; its track and the progress at each step."""
    x, progress, track, all_progress = np.array(start, dtype=float), planner.nearest(start), [], []
    for _ in range(round(most_s / DT)):
        velocity, progress = planner.aim(progress, x)
        if planner.is_done(progress):
            break
        x = x + DT * velocity
        track.append(x)
        all_progress.append(progress)
    return np.array(track), all_progress


def off_path(track, path):
    points = path.points(3600)
    return np.array([np.min(np.linalg.norm(points - x, axis=1)) for x in track])


def test_the_velocity_has_the_wanted_speed_and_points_to_the_path_a_look_ahead_further_on():
    planner = follow(CIRCLE, speed=0.25, look_ahead=0.3)
    velocity, progress = planner.aim(Progress(), np.array([1.5, 0.0]))
    angle = 0.3 / 1.5
    target = 1.5 * np.array([np.cos(angle), np.sin(angle)])
    way = target - np.array([1.5, 0.0])
    np.testing.assert_allclose(velocity, 0.25 * way / np.linalg.norm(way), atol=1e-3)
    assert progress == Progress(0, 0)


@pytest.mark.parametrize(
    ("path", "speed", "look_ahead", "error"),
    [
        (CIRCLE, 0.25, 0.10, 0.006),
        (Circle("circle", 0.75, (2.5, -1.5)), 0.3, 0.15, 0.016),
        (BernoulliLemniscate("bernoulli_lemniscate", 1.5), 0.2, 0.10, 0.01),
        (Square("square", 3.0), 0.25, 0.30, 0.15),
        (InfiniteSquare("infinite_square", 1.5), 0.25, 0.30, 0.15),
    ],
    ids=lambda value: getattr(value, "kind", ""),
)
def test_closed_paths_are_driven_round_as_often_as_asked(path, speed, look_ahead, error):
    planner = follow(path, speed=speed, look_ahead=look_ahead, loops=2)
    track, progress = drive(planner, path.points(3600)[0])
    assert off_path(track[::10], path).max() < error
    length = np.sum(np.linalg.norm(np.diff(path.points(3600), axis=0), axis=1))
    assert len(track) * DT * speed == pytest.approx(2.0 * length, rel=0.08)
    assert progress[-1].laps == 1


@pytest.mark.parametrize("path", [Spiral("spiral", 0.5, 1.5, 2.0), Sine("sine", 4.0, 0.5, 2.0)])
def test_open_paths_end_at_their_end(path):
    planner = follow(path, speed=0.25, look_ahead=0.15)
    track, _ = drive(planner, path.points(3600)[0])
    assert np.linalg.norm(track[-1] - path.points(3600)[-1]) < 0.01
    assert off_path(track[::10], path).max() < 0.05


def test_progress_never_goes_back_even_if_the_robot_does():
    planner = follow(CIRCLE, speed=0.25, look_ahead=0.3)
    points = CIRCLE.points(3600)
    progress = Progress(1000)
    for index in (1010, 900, 500, 1005):
        _, after = planner.aim(progress, points[index])
        assert after.index >= progress.index
        progress = after
    assert progress.index == 1010


def test_a_figure_of_eight_is_followed_in_its_own_order_where_it_crosses_itself():
    path = BernoulliLemniscate("bernoulli_lemniscate", 1.5)
    planner = follow(path, speed=0.2, look_ahead=0.1)
    _, progress = drive(planner, path.points(3600)[0])
    index = [p.index for p in progress]
    assert max(np.diff(index)) < 100


def test_a_path_with_no_number_of_loops_goes_on_for_ever():
    planner = follow(CIRCLE, speed=1.0, look_ahead=0.2, loops=0)
    _, progress = drive(planner, (1.5, 0.0), most_s=30.0)
    assert progress[-1].laps == 3
    assert not planner.is_done(Progress(0, 1_000_000))


@pytest.mark.parametrize("path", [CIRCLE, Sine("sine", 4.0, 0.5, 2.0)], ids=["closed", "open"])
def test_once_done_the_velocity_is_zero(path):
    planner = follow(path, speed=0.25, look_ahead=0.3)
    points = path.points(3600)
    velocity, progress = planner.aim(Progress(3599, int(path.closed)), points[-1])
    assert planner.is_done(progress)
    np.testing.assert_array_equal(velocity, 0.0)


def test_a_robot_may_begin_anywhere():
    planner = follow(CIRCLE, speed=0.25, look_ahead=0.1)
    assert planner.nearest(np.array([0.0, -3.0])) == Progress(2700)
    track, _ = drive(planner, (0.0, -3.0), most_s=20.0)
    assert off_path(track[-1:], CIRCLE)[0] < 0.01


@pytest.mark.parametrize(
    ("yaw", "expected"), [(0.0, (0.3, 0.1)), (np.pi / 2, (0.1, -0.3)), (np.pi, (-0.3, -0.1))]
)
def test_a_robot_that_moves_sideways_gets_the_same_velocity_in_its_own_frame(yaw, expected):
    np.testing.assert_allclose(body_target(np.array([0.3, 0.1]), yaw), (*expected, 0.0), atol=1e-12)


@pytest.mark.parametrize(
    ("bearing", "yaw_rate"), [(0.0, 0.0), (0.4, 0.2), (-0.4, -0.2), (2.0, 0.5), (-2.0, -0.5)]
)
def test_a_robot_that_cannot_goes_ahead_and_turns_by_half_the_bearing_up_to_a_limit(bearing, yaw_rate):
    yaw = 3.0  # the bearing is taken around the half turn
    aim = 0.3 * np.array([np.cos(yaw + bearing), np.sin(yaw + bearing)])
    np.testing.assert_allclose(steered_target(aim, yaw), (0.3, 0.0, yaw_rate), atol=1e-12)


def test_who_shall_stand_still_does_not_turn():
    np.testing.assert_array_equal(steered_target(np.zeros(2), 1.0), 0.0)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"speed": 0.0}, "'speed' and 'look_ahead' must be greater than 0."),
        ({"look_ahead": -0.1}, "'speed' and 'look_ahead' must be greater than 0."),
        ({"loops": -1}, "'loops' must not be negative"),
        (
            {"look_ahead": 4.0},
            "'look_ahead' = 4 m is too far for this path: at most a quarter of its length, 2.3",
        ),
    ],
)
def test_what_leads_nowhere_is_refused(wrong, words):
    with pytest.raises(ValueError, match=words):
        LookAhead(**({"points": CIRCLE.points(10), "closed": True, "speed": 0.2, "look_ahead": 0.1} | wrong))


def test_an_open_path_is_not_over_for_a_robot_that_is_only_nearest_to_its_end():
    planner = follow(Sine("sine", 4.0, 0.5, 2.0), speed=0.25, look_ahead=0.3)
    aside, progress = np.array([10.0, 0.0]), Progress()
    for _ in range(100):
        velocity, progress = planner.aim(progress, aside)
    assert not planner.is_done(progress)
    assert velocity[0] < 0.0
    _, progress = planner.aim(progress, planner.points[-1] + 0.1)
    assert planner.is_done(progress)
