"""Images among the inputs of a policy: which pixels it takes, and robots whose camera is another one."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
import pytest

from fulmar_core.loop.image_input import ImageInput
from fulmar_core.robots.robot_file import load_robot

ROBOT = load_robot("cubesat_8")
CAMERA = ROBOT.sensors.camera
IMAGE = ImageInput.of(CAMERA, every=5)


def with_camera(**changes):
    camera = replace(CAMERA, **changes) if changes else None
    return replace(ROBOT, sensors=replace(ROBOT.sensors, camera=camera))


def test_of_each_square_of_pixels_the_middle_one_is_taken():
    image = np.arange(240 * 320, dtype=np.float32).reshape(1, 240, 320)
    taken = IMAGE.taken(image)
    assert taken.shape == (1, *IMAGE.shape) == (1, 1, 48, 64)
    assert taken[0, 0, 1, 2] == image[0, 5 + 2, 10 + 2]


def test_images_of_those_pixels_alone_are_taken_whole():
    image = np.random.default_rng(1).uniform(size=(3, 48, 64)).astype(np.float32)
    np.testing.assert_array_equal(IMAGE.taken(image)[:, 0], image)


def test_a_small_camera_has_the_middles_of_its_pixels_where_those_of_the_large_one_are():
    small, large = IMAGE.camera.intrinsics, CAMERA.intrinsics
    at = np.array([7, 9, 1])
    behind = np.array([5 * 7 + 2, 5 * 9 + 2, 1])
    np.testing.assert_allclose(np.linalg.inv(small) @ at, np.linalg.inv(large) @ behind, atol=1e-12)


def test_colours_come_as_channels():
    colours = ImageInput.of(CAMERA, "camera_image")
    image = np.random.default_rng(1).integers(0, 255, (2, 240, 320, 3), dtype=np.uint8)
    taken = colours.taken(image)
    assert taken.shape == (2, 3, 240, 320)
    assert taken.dtype == np.float32
    assert taken[1, 2, 4, 5] == image[1, 4, 5, 2]


@pytest.mark.parametrize(("every", "words"), [(2, "'every' = 2 must be odd"), (7, "divide 320 and 240")])
def test_pixels_without_a_middle_are_refused(every, words):
    with pytest.raises(ValueError, match=words):
        ImageInput.of(CAMERA, every=every)


def test_the_robot_it_was_trained_with_has_no_problem():
    assert IMAGE.problem(ROBOT, 10.0) == ""


@pytest.mark.parametrize(
    ("robot", "words"),
    [
        (with_camera(), "but 'cubesat_8' has no camera. Add 'camera'"),
        (with_camera(width=640), "with 'width' = 320; the camera of 'cubesat_8' has 640. Change that"),
        (with_camera(field_of_view=60.0), "with 'field_of_view' = 90; the camera of 'cubesat_8' has 60."),
        (with_camera(near=0.5), "with 'near' = 0.1"),
        (with_camera(mount=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)), "with 'mount' = [0.1, 0.0"),
        (with_camera(rate_hz=5.0), "at 10 Hz; that of 'cubesat_8' has 5 Hz. Raise 'rate_hz'"),
    ],
)
def test_another_camera_is_named_in_one_line(robot, words):
    problem = IMAGE.problem(robot, 10.0)
    assert words in problem
    assert "\n" not in problem


def test_json_gives_it_back():
    import json

    assert ImageInput.from_plain(json.loads(json.dumps(asdict(IMAGE)))) == IMAGE


@pytest.mark.parametrize(
    "change",
    [
        {"width": "320"},
        {"every": 2},
        {"scaling": "1 / depth"},
        {"reading": "wheels"},
        {"mount": [0.0]},
        {"more": 1},
    ],
)
def test_what_is_none_in_json_is_refused(change):
    with pytest.raises((ValueError, TypeError)):
        ImageInput.from_plain({**asdict(IMAGE), **change})
