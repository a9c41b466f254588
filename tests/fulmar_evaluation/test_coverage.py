"""Coverage of things in space: samples of their surface, what a camera sees of them, by rays and by images."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.robots.sensors.camera import CameraConfig
from fulmar_core.states.attitude import from_euler
from fulmar_core.worlds.structures import (
    AT_THE_ORIGIN,
    KeepOut,
    Part,
    Structure,
    list_structures,
    load_structure,
)
from fulmar_evaluation.coverage.coverage import coverage, coverage_of_images
from fulmar_evaluation.coverage.surface import SAMPLES, surface_of

CAMERA = CameraConfig(width=160, height=120, field_of_view=70.0)
SRB = CameraConfig(width=64, height=64, field_of_view=100.4)
FREE = KeepOut((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 9.0)


def looking_in(eye: np.ndarray) -> np.ndarray:
    """Pose of a body at a place whose x axis points to the origin."""
    x, y, z = -eye / np.linalg.norm(eye)
    turn = from_euler(0.0, -math.asin(z), math.atan2(y, x))
    return np.array([*eye, *(float(part) for part in turn)])


def circle(radius: float, tilt_deg: float = 0.0, count: int = 24) -> np.ndarray:
    """Poses on a circle about the origin, tilted about x, that look at its middle, shape (count, 7)."""
    angle, tilt = 2.0 * np.pi * np.arange(count) / count, math.radians(tilt_deg)
    ring = np.stack((np.cos(angle), math.cos(tilt) * np.sin(angle), math.sin(tilt) * np.sin(angle)), axis=1)
    return np.array([looking_in(radius * place) for place in ring])


def two_circles(structure: Structure) -> np.ndarray:
    """The path that sees most: two circles at right angles to one another."""
    radius = 1.5 * structure.half_size
    return np.concatenate((circle(radius, 45.0), circle(radius, -45.0)))


def alone(*parts: tuple[str, tuple[float, ...], tuple[float, float, float]]) -> Structure:
    """A structure of some parts: shape, size and place of each."""
    made = tuple(
        Part(f"part_{i}", shape, size, (*at, *AT_THE_ORIGIN[3:]), "bus", (1.0, 1.0, 1.0))  # type: ignore[arg-type]
        for i, (shape, size, at) in enumerate(parts)
    )
    return Structure("alone", "some parts", made, FREE, 1.0)


@pytest.mark.parametrize(
    ("shape", "size", "up"),
    [  # share of the surface whose normal points up within 1°, or, of round ones, within 60°
        ("box", (1.0, 0.5, 0.25), 2.0 / 7.0),
        ("sphere", (0.7,), 0.25),
        ("cylinder", (0.5, 1.0), 0.1),
        ("capsule", (0.5, 1.0), 0.25 / 3.0),
    ],
)
def test_samples_lie_on_the_surface_evenly_by_area_with_normals_outwards(shape, size, up) -> None:
    surface = surface_of(alone((shape, size, (0.0, 0.0, 0.0))))
    points, normals = surface.points, surface.normals
    assert len(points) == SAMPLES
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-9)
    inwards, outwards = (_inside(shape, size, points + step * normals) for step in (-1e-6, 1e-6))
    assert inwards.all() and not outwards.any()
    assert np.mean(normals[:, 2] >= 0.5) == pytest.approx(up, abs=0.01)


def _inside(shape, size, points) -> np.ndarray:
    x, y, z = np.abs(points).T
    if shape == "box":
        return (x < size[0]) & (y < size[1]) & (z < size[2])
    if shape == "sphere":
        return np.linalg.norm(points, axis=1) < size[0]
    if shape == "cylinder":
        return (np.hypot(x, y) < size[0]) & (z < size[1])
    return np.hypot(np.hypot(x, y), (z - size[1]).clip(0.0)) < size[0]


def test_faces_between_parts_that_touch_are_no_outer_surface() -> None:
    both = alone(("box", (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)), ("box", (1.0, 1.0, 1.0), (2.0, 0.0, 0.0)))
    surface = surface_of(both)
    assert len(surface.points) == pytest.approx(SAMPLES * 10 / 12, rel=0.01)
    assert not (np.abs(surface.points[:, 0] - 1.0) < 1e-6).any()


def test_a_ball_is_seen_up_to_sixty_degrees_from_its_normal() -> None:
    far, radius = 5.0, 1.0
    hidden = math.asin(radius * math.sin(math.radians(60.0)) / far)
    share = 0.5 * (1.0 - math.cos(math.radians(60.0) - hidden))
    found = coverage(
        alone(("sphere", (radius,), (0.0, 0.0, 0.0))), looking_in(np.array([far, 0, 0]))[None], CAMERA
    )
    assert found.share == found.visible == pytest.approx(share, abs=0.005)


def test_what_stands_behind_something_else_is_not_seen() -> None:
    behind = ("box", (0.1, 0.5, 0.5), (0.0, 0.0, 0.0))
    plate = ("box", (0.05, 1.0, 1.0), (1.0, 0.0, 0.0))
    pose = looking_in(np.array([4.0, 0.0, 0.0]))[None]
    for see in (coverage, coverage_of_images):
        surface, found = surface_of(alone(behind, plate)), see(alone(behind, plate), pose, CAMERA)
        assert found.seen[surface.parts == 1].any() and not found.seen[surface.parts == 0].any()


def test_a_camera_that_looks_away_sees_nothing_of_what_could_be_seen() -> None:
    structure = load_structure("gateway")
    away = circle(1.5 * structure.half_size, count=4)
    away[:, 3:] = looking_in(np.array([-3.0, 0.0, 0.0]))[3:]  # all look along x
    away = away[:1]
    found = coverage(structure, away, CAMERA)
    assert found.share == 0.0 and found.visible > 0.05
    turned = replace(CAMERA, mount=(0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0))  # a camera at the back of the body
    assert coverage(structure, away, turned).share > 0.05


@pytest.mark.parametrize("camera", [CAMERA, SRB], ids=["160x120", "64x64"])
@pytest.mark.parametrize("name", list_structures())
def test_images_say_the_same_as_exact_rays(name: str, camera: CameraConfig) -> None:
    structure = load_structure(name)
    poses = two_circles(structure)[::2]
    exact, drawn = coverage(structure, poses, camera), coverage_of_images(structure, poses, camera)
    assert drawn.share == pytest.approx(exact.share, abs=0.02)
    assert np.mean(drawn.seen & ~exact.seen) < 0.05
    assert exact.visible >= exact.share


def test_two_tilted_circles_see_most_of_the_gateway_and_one_in_its_plane_less_than_half() -> None:
    structure = load_structure("gateway")
    assert coverage(structure, two_circles(structure), CAMERA).share >= 0.7
    assert coverage(structure, circle(1.5 * structure.half_size), CAMERA).share < 0.5
