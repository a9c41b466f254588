"""Reference paths: where they run, how evenly, and what is refused."""

from __future__ import annotations

import dataclasses
import typing

import numpy as np
import pytest

from fulmar_core.tasks.references import PATHS, ReferencePath
from fulmar_core.tasks.references.curves import (
    BernoulliLemniscate,
    Circle,
    GeronoLemniscate,
    Hippopede,
    Hypotrochoid,
    InfiniteSquare,
    Lissajous,
    Ngon,
    Sine,
    Spiral,
    Square,
)
from fulmar_core.tasks.references.race_track import RaceTrack
from fulmar_core.tasks.references.rounded import Capsule, Line, Rectangle

COUNT = 1000
EXAMPLES = (
    Circle("circle", 0.75),
    Square("square", 3.0),
    InfiniteSquare("infinite_square", 1.5),
    Spiral("spiral", 0.5, 1.5, 4.0),
    BernoulliLemniscate("bernoulli_lemniscate", 1.5),
    GeronoLemniscate("gerono_lemniscate", 1.5),
    Lissajous("lissajous", 2.0, 1.0, 3, 2),
    Hippopede("hippopede", 1.0, 0.8),
    Hypotrochoid("hypotrochoid", 2.5, 1.5, 0.75),
    Ngon("ngon", 6, 1.5),
    Sine("sine", 4.0, 0.5, 2.0),
    RaceTrack("race_track", seed=1),
    Line("line", 4.0),
    Rectangle("rectangle", 4.0, 2.0, 0.5),
    Capsule("capsule", 3.0, 1.0),
)
EACH = pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.kind)
CLOSED = pytest.mark.parametrize("path", [p for p in EXAMPLES if p.closed], ids=lambda path: path.kind)


def steps(path, count=COUNT):
    """Lengths between neighbours, of a closed path also from the last to the first."""
    points = path.points(count)
    around = np.concatenate((points, points[:1])) if path.closed else points
    return np.linalg.norm(np.diff(around, axis=0), axis=1)


def test_the_table_holds_every_path_under_its_own_kind():
    for kind, cls in PATHS.items():
        assert typing.get_args(typing.get_type_hints(cls)["kind"]) == (kind,)
    assert set(PATHS.values()) == set(typing.get_args(ReferencePath)) == {type(path) for path in EXAMPLES}


@EACH
def test_as_many_points_come_as_were_asked_for(path):
    for count in (3, 10, COUNT):
        assert path.points(count).shape == (count, 2)


@EACH
def test_neighbours_are_equally_far_apart_all_the_way_round(path):
    lengths = steps(path)
    corners = np.sum(lengths < 0.99 * np.median(lengths))
    assert corners <= 8  # a chord that cuts a corner is shorter
    assert np.max(lengths) < 1.002 * np.median(lengths)


@CLOSED
def test_a_closed_path_comes_back_to_its_beginning(path):
    assert np.linalg.norm(path.points(COUNT)[0] - path.points(COUNT)[-1]) == pytest.approx(
        np.median(steps(path)), rel=0.01
    )


@EACH
def test_the_centre_moves_every_point_alike(path):
    moved = dataclasses.replace(path, centre=(2.5, -1.5))
    np.testing.assert_allclose(
        moved.points(100), path.points(100) + np.array([2.5, -1.5]), rtol=0, atol=1e-12
    )


@EACH
def test_a_path_of_two_points_is_refused(path):
    with pytest.raises(ValueError, match="at least 3 points, found 2"):
        path.points(2)


def test_a_circle_keeps_its_radius():
    points = Circle("circle", 0.75, (2.5, -1.5)).points(COUNT)
    np.testing.assert_allclose(np.hypot(points[:, 0] - 2.5, points[:, 1] + 1.5), 0.75)


@pytest.mark.parametrize(("first", "last"), [(0.5, 1.5), (1.5, 0.0)])
def test_a_spiral_goes_from_its_first_to_its_last_radius(first, last):
    points = Spiral("spiral", first, last, 4.0).points(COUNT)
    radius = np.linalg.norm(points, axis=1)
    assert (radius[0], radius[-1]) == (pytest.approx(first), pytest.approx(last, abs=1e-12))
    assert np.all(np.diff(radius) * (last - first) > 0.0)
    turns = np.sum(np.diff(np.unwrap(np.arctan2(points[:-1, 1], points[:-1, 0])))) / (2.0 * np.pi)
    assert turns == pytest.approx(4.0, abs=0.1)


@pytest.mark.parametrize(
    ("path", "rest"),
    [
        (
            BernoulliLemniscate("bernoulli_lemniscate", 1.5),
            lambda x, y: (x * x + y * y) ** 2 - 1.5**2 * (x * x - y * y),
        ),
        (GeronoLemniscate("gerono_lemniscate", 1.5), lambda x, y: x**4 - 1.5**2 * (x * x - y * y)),
        (
            Hippopede("hippopede", 1.0, 0.8),
            lambda x, y: (x * x + y * y) ** 2 - 4.0 * 0.8 * (x * x + 0.2 * y * y),
        ),
        (Lissajous("lissajous", 2.0, 1.0, 1, 2), lambda x, y: y * y - (x * x) * (4.0 - x * x) / 4.0),
        (Sine("sine", 4.0, 0.5, 2.0), lambda x, y: y - 0.5 * np.sin(np.pi * (x + 2.0))),
    ],
    ids=lambda value: getattr(value, "kind", ""),
)
def test_points_fulfil_the_equation_of_their_curve(path, rest):
    x, y = path.points(COUNT).T
    np.testing.assert_allclose(rest(x, y), 0.0, atol=1e-12)


def test_a_hypotrochoid_with_its_pen_on_the_rim_of_a_quarter_wheel_is_an_astroid():
    x, y = Hypotrochoid("hypotrochoid", 2.0, 0.5, 0.5).points(COUNT).T
    np.testing.assert_allclose(np.abs(x) ** (2 / 3) + np.abs(y) ** (2 / 3), 2.0 ** (2 / 3), atol=1e-6)


@pytest.mark.parametrize(
    ("path", "length"),
    [
        (Square("square", 3.0), 12.0),
        (InfiniteSquare("infinite_square", 1.5), 12.0),
        (Ngon("ngon", 6, 1.5), 9.0),
        (BernoulliLemniscate("bernoulli_lemniscate", 1.5), 5.244115 * 1.5),
    ],
    ids=lambda value: getattr(value, "kind", ""),
)
def test_the_length_is_the_known_one(path, length):
    assert np.sum(steps(path, 6000)) == pytest.approx(length, rel=1e-3)


def test_an_infinite_square_goes_straight_on_through_its_centre():
    points = InfiniteSquare("infinite_square", 1.0).points(800)
    here = np.flatnonzero(np.linalg.norm(points, axis=1) < 1e-9)
    assert list(here) == [0, 400]
    for i in here:
        np.testing.assert_allclose(points[i] - points[i - 1], points[i + 1] - points[i], atol=1e-12)


@pytest.mark.parametrize("seed", range(30))
def test_race_tracks_have_9_to_13_corners_and_pass_through_them(seed):
    track = RaceTrack("race_track", seed=seed)
    corners = track.corners()
    assert 9 <= len(corners) <= 13
    assert np.abs(corners).max() <= 7.5
    gaps = np.linalg.norm(corners[:, None] - track.points(2000)[None], axis=-1).min(axis=1)
    assert gaps.max() < 0.03


def test_a_race_track_is_the_same_for_the_same_seed_and_another_for_another():
    one, again, other = (RaceTrack("race_track", seed=seed).points(100) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, again)
    assert not np.allclose(one, other)


def test_race_tracks_turn_smoothly_at_their_corners():
    track = RaceTrack("race_track", seed=3)
    points = track.points(20_000)
    way = np.diff(points, axis=0, append=points[:1])
    turn = np.arctan2(way[:, 1], way[:, 0])
    change = np.abs((np.diff(turn) + np.pi) % (2.0 * np.pi) - np.pi)
    assert np.degrees(change.max()) < 5.0


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Circle("circle", 0.0), "'radius' must be greater than 0."),
        (lambda: Square("square", -1.0), "'side' must be greater than 0."),
        (lambda: InfiniteSquare("infinite_square", 0.0), "'side' must be greater than 0."),
        (lambda: Ngon("ngon", 2, 1.0), "'corners' must be 3 or more."),
        (lambda: Spiral("spiral", 1.0, 1.0, 2.0), "must differ; kind 'circle'"),
        (lambda: Spiral("spiral", -1.0, 1.0, 2.0), "must not be negative."),
        (lambda: Spiral("spiral", 0.0, 1.0, 0.0), "'turns' must be greater than 0."),
        (
            lambda: BernoulliLemniscate("bernoulli_lemniscate", 0.0),
            "'half_width' must be greater than 0.",
        ),
        (lambda: GeronoLemniscate("gerono_lemniscate", 0.0), "'half_width' must be greater than 0."),
        (lambda: Hippopede("hippopede", 1.0, 1.0), "'a' must be greater than 'b'"),
        (lambda: Lissajous("lissajous", 1.0, 1.0, 4, 2), "no common factor, found 4 and 2."),
        (lambda: Lissajous("lissajous", 1.0, 1.0, 0, 2), "'x_cycles' must be greater than 0."),
        (lambda: Hypotrochoid("hypotrochoid", 1.0, 1.0, 0.5), "must be smaller than 'ring_radius'."),
        (lambda: Hypotrochoid("hypotrochoid", np.pi, 1.0, 0.5), "or the curve does not close."),
        (lambda: Sine("sine", 1.0, 0.0, 1.0), "'amplitude' must be greater than 0."),
        (lambda: Circle("circle", 1e300), "'radius' must be at most 10000."),
        (lambda: Spiral("spiral", 0.0, 1e5, 2.0), "must be at most 10000."),
        (lambda: Spiral("spiral", 0.0, 1.0, 20_000.0), "'turns' must be at most 100."),
        (lambda: Ngon("ngon", 500_000_000, 1.0), "'corners' must be at most 100."),
        (lambda: Sine("sine", 1.0, 1.0, 1e6), "'cycles' must be at most 100."),
        (lambda: Lissajous("lissajous", 1.0, 1.0, 1000, 1001), "'x_cycles' must be at most 100."),
        (lambda: Lissajous("lissajous", 1.0, 1.0, 1, 1, phase_deg=0.0), "driven there and back of 1 to 1"),
        (lambda: Lissajous("lissajous", 1.0, 1.0, 2, 1), "driven there and back of 2 to 1"),
        (lambda: RaceTrack("race_track", seed=-1), "'seed' must not be negative."),
        (lambda: RaceTrack("race_track", seed=1, corner_counts=(13, 9)), r"found \[13, 9\]."),
    ],
)
def test_impossible_sizes_are_refused_by_name(make, words):
    with pytest.raises(ValueError, match=words):
        make()
