"""Images of a camera become files that a browser shows, ten a second at most."""

from __future__ import annotations

import io
import time

import numpy as np
import pytest
from PIL import Image as Pillow

from fulmar_console.live.camera_images import DEPTH, RGB, CameraImages, RawImage, encoded


def opened(data: bytes) -> Pillow.Image:
    return Pillow.open(io.BytesIO(data))


def raw(encoding: str, array: np.ndarray) -> RawImage:
    return RawImage(encoding, array.shape[0], array.shape[1], array.tobytes())


def test_colours_become_jpeg_whichever_way_round_they_come() -> None:
    red = np.zeros((8, 16, 3), np.uint8)
    red[..., 0] = 200
    for image in (raw("rgb8", red), raw("bgr8", red[..., ::-1])):
        image = opened(encoded(image))
        assert (image.format, image.size) == ("JPEG", (16, 8))
        assert np.asarray(image)[4, 8].tolist() == pytest.approx([200, 0, 0], abs=4)


def test_depth_is_grey_near_is_dark_and_what_is_endless_is_white() -> None:
    depth = np.array([[0.0, 10.0, 40.0, np.inf, np.nan]], np.float32)
    image = opened(encoded(raw("32FC1", depth)))
    assert image.format == "PNG"
    assert np.asarray(image)[0].tolist() == [0, 127, 255, 255, 0]


def test_ids_have_colours_of_their_own_and_none_is_black() -> None:
    image = opened(encoded(raw("16UC1", np.array([[0, 1, 2, 300]], np.uint16)))).convert("RGB")
    colors = [tuple(map(int, color)) for color in np.asarray(image)[0]]
    assert colors[0] == (0, 0, 0)
    assert len(set(colors)) == 4


@pytest.mark.parametrize(
    "image",
    [RawImage("yuv422", 2, 2, bytes(8)), RawImage("rgb8", 2, 2, bytes(5)), RawImage("rgb8", 2, 2, b"")],
)
def test_an_image_of_another_kind_or_size_is_refused(image: RawImage) -> None:
    with pytest.raises(ValueError, match=r"encoding|reshape"):
        encoded(image)


def wait_for(condition) -> None:
    until = time.monotonic() + 5.0
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.005)


def test_images_that_come_too_fast_are_left_out_and_a_bad_one_ends_nothing() -> None:
    images = CameraImages()
    try:
        made = []
        good = raw("rgb8", np.zeros((4, 4, 3), np.uint8))
        images.offer((3, DEPTH), lambda: RawImage("none", 1, 1, b""))
        for _ in range(50):
            images.offer((3, RGB), lambda: made.append(1) or good)
        found: list = []
        wait_for(lambda: found.extend(images.take()) or found)
        assert [(image.index, image.kind) for image in found] == [(3, RGB)]
        assert len(made) == 1
        assert "none" in images.problem
    finally:
        images.close()
