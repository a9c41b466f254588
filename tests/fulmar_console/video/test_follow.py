"""The camera of a film: it jumps to the first view, follows smoothly, and holds what flies."""

from __future__ import annotations

import numpy as np

from fulmar_console.video.follow import NEAR, Follower


def test_the_first_view_has_the_robot_and_its_goal() -> None:
    view = Follower({"space": "plane"}, 0.3).look(np.zeros((1, 3)), [np.array([2.0, 0.0, 0.0])], 0.0)
    assert 0.0 < view.at[0] < 2.0
    assert view.distance > NEAR * 0.3 + 1.0


def test_a_robot_that_jumps_is_followed_smoothly() -> None:
    follower = Follower({"space": "plane"}, 0.3)
    follower.look(np.zeros((1, 3)), [], 0.0)
    there = np.array([[1.0, 0.0, 0.0]])
    first = follower.look(there, [], 0.04).at[0]
    for _ in range(500):
        last = follower.look(there, [], 0.04).at[0]
    assert 0.0 < first < 0.1
    assert abs(last - 1.0) < 0.01


def test_an_aircraft_stays_in_the_middle_at_any_speed() -> None:
    follower = Follower({"space": "flight"}, 3.0)
    for number in range(100):
        place = np.array([[28.0 * 0.08 * number, 0.0, 5.0]])
        view = follower.look(place, [], 0.08)
    assert np.linalg.norm(view.at - place[0]) < 0.1


def test_a_thing_in_space_lies_behind_the_robot() -> None:
    part = {"pose": [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]}
    info = {"space": "space", "structures": [{"parts": [part]}]}
    view = Follower(info, 0.3).look(np.array([[2.0, 0.0, 0.0]]), [], 0.0)
    assert 150.0 < view.azimuth % 360.0 < 210.0 or 150.0 < (view.azimuth - 28.0) % 360.0 < 210.0
