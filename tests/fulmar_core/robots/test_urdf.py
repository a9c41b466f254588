"""URDF of every robot, read by parsers that share no code with ours."""

from __future__ import annotations

import io
from dataclasses import replace
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
import yourdfpy
from scipy.spatial.transform import Rotation

from fulmar_core.config.paths import config_names
from fulmar_core.robots.actuators.pushing import Pushing
from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels
from fulmar_core.robots.actuators.rolling import Rolling
from fulmar_core.robots.look_primitives import primitives_of
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.urdf import body_frames, urdf_of
from fulmar_core.wires.robot_name import frames_of

ROBOTS = config_names("robots")


def read(robot, frames=None):
    text = urdf_of(robot) if frames is None else urdf_of(robot, frames)
    return yourdfpy.URDF.load(io.BytesIO(text.encode()), load_meshes=False, load_collision_meshes=False)


@pytest.mark.parametrize("name", ROBOTS)
def test_mass_inertia_and_centre_of_mass_are_those_of_the_yaml(name):
    body, model = load_robot(name).body, read(load_robot(name))
    assert model.validate()
    assert model.robot.name == name
    inertial = model.link_map["base_link"].inertial
    assert inertial.mass == body.mass
    np.testing.assert_array_equal(inertial.inertia, body.inertia_matrix)
    np.testing.assert_array_equal(inertial.origin[:3, 3], body.com)
    np.testing.assert_array_equal(inertial.origin[:3, :3], np.eye(3))
    others = [link for link in model.robot.links if link.name != "base_link"]
    assert all(link.inertial.mass == 0.0 and not link.inertial.inertia.any() for link in others)


@pytest.mark.parametrize("name", ROBOTS)
def test_each_actuator_has_a_frame_at_its_place_along_its_force(name):
    robot, model = load_robot(name), read(load_robot(name))
    if isinstance(robot.actuators, Pushing):
        for push in robot.actuators.pushes:
            place = model.get_transform(f"{push.name}_link", "base_link")
            np.testing.assert_allclose(place[:3, 3], push.position, atol=1e-12)
            np.testing.assert_allclose(place[:3, 0], push.direction, atol=1e-12)
    elif isinstance(robot.actuators, ReactionWheels):
        for wheel in robot.actuators.wheels:
            place = model.get_transform(f"{wheel.name}_link", "base_link")
            np.testing.assert_allclose(place[:3, 3], np.zeros(3), atol=1e-12)
            np.testing.assert_allclose(place[:3, 0], wheel.direction, atol=1e-12)
    elif robot.flies:  # propellers and surfaces have none yet
        assert f"{robot.actuators.names[0]}_link" not in model.link_map
    else:
        assert isinstance(robot.actuators, Rolling)
        for wheel, (x, y) in robot.actuators.wheels.items():
            place = model.get_transform(f"{wheel}_link", "base_link")
            np.testing.assert_allclose(place[:3, 3], (x, y, 0.0), atol=1e-12)
            np.testing.assert_allclose(place[:3, 1], (0.0, 1.0, 0.0), atol=1e-12)


@pytest.mark.parametrize(
    ("name", "places"), [("turtlebot2", (-0.135, 0.135)), ("jetbot", (-0.06,)), ("leatherback", ())]
)
def test_casters_touch_the_floor_on_which_the_wheels_stand(name, places):
    robot = replace(load_robot(name), look=())  # a look has balls of its own
    model = read(robot)
    casters = {link.name: link for link in model.robot.links if link.name.endswith("caster_link")}
    assert tuple(model.get_transform(caster, "base_link")[0, 3] for caster in casters) == places
    for caster, link in casters.items():
        (ball,) = link.visuals
        lowest = model.get_transform(caster, "base_link")[2, 3] - ball.geometry.sphere.radius
        assert lowest == pytest.approx(-robot.actuators.wheel_radius, abs=1e-12)


@pytest.mark.parametrize("name", [name for name in ROBOTS if not load_robot(name).body.as_printed])
def test_mujoco_compiles_it_with_the_same_mass_and_moments(name):
    robot = load_robot(name)
    spec = mujoco.MjSpec.from_string(urdf_of(robot))
    base = next(body for body in spec.bodies if body.name == "base_link")
    base.add_freejoint()
    model = spec.compile()
    body = model.body("base_link")
    assert body.mass[0] == pytest.approx(robot.body.mass, rel=1e-12)
    moments = np.linalg.eigvalsh(robot.body.inertia_matrix)
    np.testing.assert_allclose(sorted(body.inertia), moments, rtol=1e-9)
    np.testing.assert_allclose(body.ipos, robot.body.com, atol=1e-12)


@pytest.mark.parametrize("name", ROBOTS)
def test_links_of_a_named_robot_are_called_as_its_frames_on_the_wire(name):
    robot, frames = load_robot(name), frames_of("alpha", name)
    links = set(read(robot, frames).link_map)
    assert links == {"alpha/base_link", *(f"alpha/{frame.name}" for frame in body_frames(robot))}


@pytest.mark.parametrize("name", ROBOTS)
def test_the_hull_has_the_size_of_the_outline(name):
    robot, model = load_robot(name), read(load_robot(name))
    (collision,) = model.link_map["base_link"].collisions
    low, high = robot.hull_span
    if robot.body.footprint is None:
        assert collision.geometry.cylinder.radius == robot.body.radius
        assert collision.geometry.cylinder.length == high - low
    else:
        np.testing.assert_array_equal(collision.geometry.box.size, (*robot.body.footprint, high - low))
    assert collision.origin[2, 3] == 0.5 * (low + high)


@pytest.mark.parametrize("name", ROBOTS)
def test_base_link_is_drawn_as_the_look_and_links_draw_nothing_twice(name):
    robot, model = load_robot(name), read(load_robot(name))
    parts, visuals = primitives_of(robot.look), model.link_map["base_link"].visuals
    assert robot.look and len(visuals) == len(parts)
    for part, visual in zip(parts, visuals, strict=True):
        kind = visual.geometry
        size = {"box": kind.box, "cylinder": kind.cylinder, "sphere": kind.sphere}[part.shape]
        diameter = 2.0 * size.radius if part.shape != "box" else size.size[0]
        assert diameter == pytest.approx(part.size[0], rel=1e-12)
        np.testing.assert_allclose(visual.origin[:3, 3], part.at, atol=1e-12)
        np.testing.assert_allclose(
            visual.origin[:3, :3], Rotation.from_quat(part.quat_xyzw).as_matrix(), atol=1e-12
        )
        np.testing.assert_allclose(visual.material.color.rgba, part.rgba)
    assert not any(link.visuals for link in model.robot.links if link.name != "base_link")


def test_a_robot_without_a_look_is_drawn_as_its_hull_with_its_nozzles():
    robot = replace(load_robot("floating_platform"), look=())
    model = read(robot)
    (visual,) = model.link_map["base_link"].visuals
    assert visual.geometry.cylinder.radius == robot.body.radius
    for push in robot.actuators.pushes:
        assert len(model.link_map[f"{push.name}_link"].visuals) == 1


@pytest.mark.parametrize("name", ["floating_platform", "turtlebot2", "cubesat_wheels"])
def test_every_link_states_its_mass_and_all_masses_are_that_of_the_yaml(name):
    """PyBullet takes a link that states none for 1 kg."""
    robot = load_robot(name)
    links = ElementTree.fromstring(urdf_of(robot)).findall("link")
    masses = [float(link.find("inertial").find("mass").get("value")) for link in links]
    assert sum(masses) == pytest.approx(robot.body.mass, rel=1e-12)
