"""Images of a camera that is dead, stuck, late, of another size or encoding are not acted on, each with its reason."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.loop.newest_readings import NewestReadings
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.image_gate import ImageWatch
from fulmar_core.wires.reading import Reading

ROBOT = load_robot("cubesat_8")
MS = 1_000_000
NOW = 10_000 * MS
DEPTH = "camera_depth"
NOTHING = np.full((240, 320), np.inf, np.float32)


def newest(*, in_step=False, names=(DEPTH,), robot=ROBOT) -> NewestReadings:
    return NewestReadings(robot, names, in_step=in_step)


def take(readings, stamp_ns, pixels=NOTHING, name=DEPTH):
    return readings.take(name, Reading(pixels), stamp_ns)


def problem(readings, time_ns=NOW):
    return readings.image_problem((DEPTH,), time_ns)


def test_an_image_of_its_time_is_there_for_one_robot_and_keeps_its_type():
    readings = newest()
    assert take(readings, NOW)
    assert problem(readings) == ""
    assert readings.at(NOW)[DEPTH].shape == (1, 240, 320)
    assert readings.at(NOW)[DEPTH].dtype == np.float32


def test_a_camera_that_never_spoke_is_said():
    assert problem(newest()) == "camera_depth: no image yet. Does the camera run?"


def test_a_camera_that_died_is_said_with_the_age_of_its_last_image():
    readings = newest()
    take(readings, NOW - 500 * MS)
    assert problem(readings) == ""
    assert problem(readings, NOW + 20 * MS) == "camera_depth: no usable image for 520 ms (limit 500 ms)"
    assert DEPTH not in readings.at(NOW + 20 * MS)


def test_a_camera_whose_stamps_stand_still_is_stuck():
    readings = newest()
    for _ in range(9):
        take(readings, NOW - 600 * MS)
    assert problem(readings).endswith("(its stamps do not advance: the camera is stuck)")


def test_images_that_come_late_are_no_newer_than_their_stamps():
    readings = newest()
    for late in (900, 800, 700):
        take(readings, NOW - late * MS)
    assert problem(readings) == "camera_depth: no usable image for 700 ms (limit 500 ms)"


def test_an_image_from_far_ahead_is_of_another_clock_and_does_not_shut_the_camera_out():
    readings = newest()
    take(readings, NOW + 9_000 * MS)
    assert problem(readings).endswith("(it is ahead of odom: two clocks)")
    take(readings, NOW)
    assert problem(readings) == ""


@pytest.mark.parametrize(
    ("pixels", "words"),
    [
        (NOTHING[:64, :64], "the image is 64 × 64 px, the camera of 'cubesat_8' has 320 × 240"),
        (np.zeros((240, 320), np.uint16), "the image has pixels of uint16, must be 32FC1"),
        (np.zeros((240, 320, 3), np.uint8), "the image has pixels of uint8, must be 32FC1"),
        (-NOTHING, "the depth image holds negative distances"),
    ],
)
def test_an_image_that_is_not_the_camera_s_stops_at_once_although_the_one_before_is_young(pixels, words):
    readings = newest()
    take(readings, NOW - 100 * MS)
    assert not take(readings, NOW, pixels)
    assert problem(readings) == f"camera_depth: {words}"
    assert readings.refused == 1
    assert take(readings, NOW + 100 * MS)
    assert problem(readings, NOW + 100 * MS) == ""


def test_an_image_for_a_robot_without_a_camera_is_refused():
    blind = replace(ROBOT, sensors=replace(ROBOT.sensors, camera=None))
    readings = newest(robot=blind)
    assert not take(readings, NOW)
    assert problem(readings) == "camera_depth: an image came, but 'cubesat_8' has no camera in its file"


def test_a_controller_that_takes_no_image_has_no_problem_with_one():
    readings = newest()
    assert readings.image_problem((), NOW) == ""
    assert newest(names=("imu",)).image_problem(("imu",), NOW) == ""


def test_in_lock_step_a_step_waits_for_the_image_of_its_own_time():
    readings = newest(in_step=True)
    assert readings.silent == (DEPTH,)
    take(readings, NOW - 100 * MS)
    assert readings.lacks_something_of(NOW)
    take(readings, NOW, 2.0 * np.ones((240, 320), np.float32))
    assert not readings.lacks_something_of(NOW)
    take(readings, NOW + 100 * MS)
    assert readings.at(NOW)[DEPTH].max() == 2.0


def test_a_camera_that_begins_anew_has_earlier_stamps_and_is_believed():
    watch = ImageWatch(DEPTH)
    assert watch.came(NOW)
    assert not watch.came(NOW)
    assert watch.came(1_000 * MS)
    assert watch.problem(1_100 * MS) == ""
