"""What a camera sees, beside the geometry of what stands before it."""

import itertools

import mujoco
import numpy as np
import pytest

from fulmar_core.dynamics.contact import Block
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.camera import PROFILES, CameraConfig
from fulmar_core.states.attitude import from_euler
from fulmar_core.states.rotation import rotate_inverse
from fulmar_core.worlds.structures import SEMANTIC_IDS, load_structure
from sim_nodes.camera.backdrop import BLOCK_ID, FLOOR_ID, WATER_ID, backdrop_of
from sim_nodes.camera.renderer import Renderer
from tests.drawing import AT_REST, alone, drawn, drawn_by

CAMERA = CameraConfig()
DISTANCES = (1.0, 2.0, 5.0, 10.0, 20.0)


def rays(camera):
    """Directions of the pixels' middles in the body, one metre deep, shape (h, w, 3)."""
    v, u = np.mgrid[: camera.height, : camera.width]
    k = camera.intrinsics
    ahead = np.ones(u.shape)
    return np.stack((ahead, -(u - k[0, 2]) / k[0, 0], -(v - k[1, 2]) / k[1, 1]), axis=-1)


def inside(mask):
    """The same without the pixels of its edge."""
    m = np.pad(mask, 1)
    return m[1:-1, 1:-1] & m[:-2, 1:-1] & m[2:, 1:-1] & m[1:-1, :-2] & m[1:-1, 2:]


def nearest(a, b, c):
    """Depth of the first root of a s² - 2 b s + c = 0; infinite where there is none."""
    under = b * b - a * c
    return np.where(under > 0.0, (b - np.sqrt(np.maximum(under, 0.0))) / a, np.inf)


def of_sphere(camera, radius, distance):
    d, middle = rays(camera), np.array([distance + radius, 0.0, 0.0])
    return nearest((d * d).sum(-1), d @ middle, middle @ middle - radius**2)


def of_cylinder(camera, radius, half, distance):
    d, middle = rays(camera), np.array([distance + radius, 0.0])
    side = d[..., :2]
    depth = nearest((side * side).sum(-1), side @ middle, middle @ middle - radius**2)
    return np.where(np.abs(depth * d[..., 2]) < half, depth, np.inf)


@pytest.mark.parametrize("distance", DISTANCES)
def test_depth_of_a_box_is_exact_and_nothing_is_behind_it(distance):
    half = (0.5, 0.4 * distance, 0.3 * distance)
    frames = drawn(CAMERA, (alone("box", half, (distance + 0.5, 0.0, 0.0), "truss"),))
    v, u = np.abs(np.moveaxis(rays(CAMERA)[..., 1:], -1, 0))[::-1]
    box = (u < 0.4) & (v < 0.3)
    assert np.array_equal(frames.segmentation == SEMANTIC_IDS["truss"], box)
    assert np.array_equal(frames.segmentation == 0, ~box)
    assert np.abs(frames.depth[box] - distance).max() <= np.spacing(np.float32(distance))
    assert np.isinf(frames.depth[~box]).all()
    assert (frames.rgb[box] > 0).all() and (frames.rgb[~box] == 0).all()
    assert frames.depth.dtype == np.float32 and frames.segmentation.dtype == np.uint16


@pytest.mark.parametrize("distance", DISTANCES)
@pytest.mark.parametrize(
    ("shape", "size", "exact"),
    [
        ("sphere", (0.3,), of_sphere),
        ("cylinder", (0.3, 0.2), of_cylinder),
    ],
)
def test_depth_of_a_round_part_is_true_within_a_five_hundredth_one_pixel_inside_its_outline(
    shape, size, exact, distance
):
    size = tuple(each * distance for each in size)
    frames = drawn(CAMERA, (alone(shape, size, (distance + size[0], 0.0, 0.0)),))
    depth = exact(CAMERA, *size, distance)
    there = inside(np.isfinite(depth))
    assert there.sum() > 1000
    assert (frames.segmentation[there] == SEMANTIC_IDS["module"]).all()
    assert np.abs(frames.depth[there] / depth[there] - 1.0).max() < 0.002
    away = inside(np.isinf(depth))
    assert (frames.segmentation[away] == 0).all() and np.isinf(frames.depth[away]).all()


@pytest.mark.parametrize("name", ["standard", "rl_avist"])
def test_a_point_is_seen_where_the_intrinsics_and_the_optical_frame_say(name):
    side = (*(0.3, -0.1, 0.2), *from_euler(0.3, 0.2, 0.5))
    camera = CameraConfig(**{**vars(PROFILES[name]), "mount": side})
    pose = np.array([1.0, 2.0, 3.0, *from_euler(-0.4, 0.1, 2.0)])
    optical, k = camera.optical_pose(pose), camera.intrinsics
    in_optical = np.array([0.9, -0.5, 3.0])
    point = optical[:3] + -rotate_inverse(optical[3:] * [1.0, 1.0, 1.0, -1.0], -in_optical)
    frames = drawn(camera, (alone("sphere", (0.1,), tuple(point)),), pose=pose)
    v, u = np.nonzero(frames.segmentation)
    expected = (k @ in_optical / in_optical[2])[:2]
    assert np.abs(np.array([u.mean(), v.mean()]) - expected).max() < 0.5
    assert frames.rgb.shape == (camera.height, camera.width, 3)


def seen_and_exact(name):
    """Frames of a shipped structure; parts, ids and depths of exact rays through the same pixels."""
    structure = load_structure(name)
    camera = CameraConfig(width=160, height=120)
    radius = 1.5 * structure.half_size
    pose = np.array([-radius * np.cos(0.3), 0.0, radius * np.sin(0.3), *from_euler(0.0, 0.3, 0.0)])
    with Renderer(camera, (structure,)) as renderer:
        frames = renderer.render(pose)
        optical = camera.optical_pose(pose)
        d = rays(camera)[..., [1, 2, 0]] * [-1.0, -1.0, 1.0]
        ahead = np.asarray(rotate_inverse(optical[3:] * [-1.0, -1.0, -1.0, 1.0], d.reshape(-1, 3)))
        ids, distance = np.zeros(len(ahead), dtype=np.int32), np.zeros(len(ahead))
        mujoco.mj_multiRay(
            renderer.model, renderer.data, optical[:3], ahead.ravel(), None, 1, -1, ids, distance, None,
            len(ahead), 1e9,
        )  # fmt: skip
        semantic = np.where(ids >= 0, renderer._ids[ids], 0)
        depth = np.where(ids >= 0, distance, np.inf)
        return frames, *(each.reshape(frames.depth.shape) for each in (ids, semantic, depth))


@pytest.mark.parametrize("name", ["gateway", "iss", "venus_express"])
def test_a_station_is_seen_as_exact_rays_see_it(name):
    frames, part, semantic, depth = drawn_by(seen_and_exact, name)
    same = np.ones(part.shape, dtype=bool)
    for ways in itertools.product((-1, 0, 1), repeat=2):
        same &= np.roll(part, ways, (0, 1)) == part
    assert len(np.unique(semantic)) > 3 and same.mean() > 0.8
    assert (frames.segmentation == semantic)[same].all()
    there = same & (semantic > 0)
    assert np.abs(frames.depth[there] / depth[there] - 1.0).max() < 0.002


@pytest.mark.parametrize(
    ("robot", "height", "ground"),
    [
        ("floating_platform", 0.0, FLOOR_ID),
        ("turtlebot2", 0.0, FLOOR_ID),
        ("kingfisher", 0.0, WATER_ID),
        ("navion", 100.0, WATER_ID),
    ],
)
def test_a_robot_on_earth_sees_what_is_below_and_a_horizon(robot, height, ground):
    camera = CameraConfig(mount=(0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 1.0))
    backdrop = backdrop_of(load_robot(robot))
    pose = np.array([3.0, 1.0, height, 0.0, 0.0, 0.0, 1.0])
    frames = drawn(camera, backdrop=backdrop, pose=pose)
    assert set(np.unique(frames.segmentation)) == {0, ground}
    assert (frames.segmentation[:118] == 0).all() and np.isinf(frames.depth[:118]).all()
    assert (frames.segmentation[135:] == ground).all()
    above = height + 0.5 - backdrop.ground.height
    assert frames.depth[-1] == pytest.approx(-above / rays(camera)[-1, :, 2], rel=1e-4)
    assert (frames.rgb[0] > 40).all()  # the sky is bright


def test_a_block_stands_on_the_floor_where_it_is():
    platform = backdrop_of(load_robot("floating_platform"))
    block = Block(radius=0.2, height=0.3, mass=1.0, floor_friction=0.5, grip=0.5)
    where = {"block": np.array([2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])}
    frames = drawn(CAMERA, backdrop=platform, blocks={"block": block}, poses=where)
    v, u = np.nonzero(frames.segmentation == BLOCK_ID)
    assert u.mean() == pytest.approx(159.5, abs=0.5)
    assert frames.depth[v, u].min() == pytest.approx(1.8, rel=1e-3)
    foot = CAMERA.intrinsics[1, 1] * -platform.ground.height / 1.8 + CAMERA.intrinsics[1, 2]
    assert v.max() == pytest.approx(foot, abs=1.0)


def test_a_robot_in_space_sees_nothing_where_nothing_is():
    frames = drawn(CAMERA, backdrop=backdrop_of(load_robot("spacecraft_16")), pose=AT_REST)
    assert not frames.rgb.any() and not frames.segmentation.any() and np.isinf(frames.depth).all()
