"""MuJoCo's models have the numbers of the YAML."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names
from fulmar_core.robots.actuators.rolling import Rolling
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.spatial import SpatialState

mujoco = pytest.importorskip("mujoco")

from sim_nodes.mujoco_model import BODY, IMU_SITE, Scene, build_model  # noqa: E402

EVERY = config_names("robots")
ROBOTS = {name: load_robot(name) for name in EVERY}
WHEELED = [name for name in EVERY if isinstance(ROBOTS[name].actuators, Rolling)]
FLOATING = [name for name in EVERY if name not in WHEELED]
IN_SPACE = [name for name in EVERY if ROBOTS[name].state_type is SpatialState]
PLATFORM = ROBOTS["floating_platform"]
FREE = replace(PLATFORM, body=replace(PLATFORM.body, planar=False, inertia=(0.1, 0.2, 0.3)))


def test_a_body_lighter_than_its_wheels_is_rejected_with_the_robot_s_name():
    robot = ROBOTS["turtlebot2"]
    feather = replace(
        robot,
        body=replace(robot.body, mass=0.01, inertia=(1e-5, 1e-5, 1e-5)),
        uncertainty=replace(robot.uncertainty, mass=(0.01, 0.02), yaw_inertia=(1e-5, 2e-5)),
    )
    with pytest.raises(ConfigError, match=r"^robot 'turtlebot2': MuJoCo cannot build it: .*Mass and inertia"):
        build_model(feather)


def whole(model):
    """Mass, centre of mass and inertia about it of everything that hangs on the body, as it stands."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    bodies = [i for i in range(1, model.nbody) if model.body_rootid[i] == model.body(BODY).id]
    mass = model.body_mass[bodies].sum()
    centre = (model.body_mass[bodies, None] * data.xipos[bodies]).sum(axis=0) / mass
    inertia = np.zeros((3, 3))
    for i in bodies:
        axes = data.ximat[i].reshape(3, 3)
        offset = data.xipos[i] - centre
        inertia += axes @ np.diag(model.body_inertia[i]) @ axes.T
        inertia += model.body_mass[i] * (offset @ offset * np.eye(3) - np.outer(offset, offset))
    return mass, centre - data.xpos[model.body(BODY).id], np.diag(inertia)


@pytest.mark.parametrize("name", EVERY)
def test_every_robot_weighs_and_turns_as_its_yaml_says(name):
    body = ROBOTS[name].body
    mass, _, inertia = whole(build_model(ROBOTS[name]))
    assert mass == pytest.approx(body.mass, rel=1e-5)
    if not body.as_printed:  # of which no model can be compiled
        np.testing.assert_allclose(inertia, body.inertia[:3], rtol=1e-3)


@pytest.mark.parametrize("name", [name for name in EVERY if name not in IN_SPACE])
def test_a_world_changes_mass_yaw_inertia_and_centre_of_mass(name, episode):
    robot = ROBOTS[name]
    scene = Scene(robot)
    _, before, _ = whole(scene.model)
    heavy, round_ = 1.1 * robot.body.mass, 1.2 * robot.body.inertia[2]
    world = episode(robot, mass=heavy, yaw_inertia=round_, com_x=0.01, com_y=-0.02).world
    scene.robot_model.take_world(scene.model, world)
    mass, centre, inertia = whole(scene.model)
    assert mass == pytest.approx(heavy, rel=1e-5)
    assert inertia[2] == pytest.approx(round_, rel=1e-3)
    np.testing.assert_allclose((centre - before)[:2], [0.01, -0.02], rtol=0, atol=2e-4)


@pytest.mark.parametrize("name", EVERY)
def test_every_model_keeps_the_ticks_of_its_yaml(name):
    scene = Scene(ROBOTS[name])
    tick = scene.model.opt.timestep * scene.robot_model.steps_per_tick
    assert tick == pytest.approx(ROBOTS[name].timing.physics_dt, abs=1e-15)
    kinds = mujoco.mjtIntegrator
    assert scene.model.opt.integrator == (kinds.mjINT_RK4 if name in IN_SPACE else kinds.mjINT_EULER)


@pytest.mark.parametrize("name", EVERY)
def test_the_hull_has_the_outline_of_the_yaml(name):
    body = ROBOTS[name].body
    hull = build_model(ROBOTS[name]).geom("hull")
    wanted = [body.radius] if body.footprint is None else [0.5 * side for side in body.footprint]
    np.testing.assert_allclose(hull.size[: len(wanted)], wanted)
    assert hull.pos[0] == pytest.approx(body.footprint_x)


@pytest.mark.parametrize("name", EVERY)
def test_the_inertial_unit_sits_at_the_body_s_origin(name):
    np.testing.assert_array_equal(build_model(ROBOTS[name]).site(IMU_SITE).pos, 0.0)


@pytest.mark.parametrize("name", [name for name in FLOATING if ROBOTS[name].actuators.kind == "thrusters"])
def test_each_nozzle_is_a_site_and_an_actuator_in_the_order_of_the_yaml(name):
    nozzles = ROBOTS[name].actuators.nozzles
    model = build_model(ROBOTS[name])
    assert model.nu == len(nozzles) + (3 if name in IN_SPACE else 0)  # and the torque of the surroundings
    for i, nozzle in enumerate(nozzles):
        assert model.actuator(i).name == nozzle.name
        np.testing.assert_allclose(model.site(nozzle.name).pos, nozzle.position, rtol=0, atol=1e-12)
        expected = np.array(nozzle.direction) / np.linalg.norm(nozzle.direction)
        np.testing.assert_allclose(model.actuator_gear[i], [*expected, 0.0, 0.0, 0.0], rtol=0, atol=1e-12)
        assert model.actuator_gainprm[i][0] == 1.0  # a control is a force in newtons


def test_each_propeller_pushes_ahead_where_the_yaml_has_it():
    robot = ROBOTS["kingfisher"]
    model = build_model(robot)
    for i, propeller in enumerate(robot.actuators.propellers):
        assert model.actuator(i).name == propeller.name
        np.testing.assert_allclose(model.site(propeller.name).pos, propeller.position)
        np.testing.assert_allclose(model.actuator_gear[i], [1.0, 0, 0, 0, 0, 0])


def test_planar_robots_have_two_slides_and_a_hinge_and_boats_and_free_ones_six_degrees():
    assert [build_model(robot).nv for robot in (PLATFORM, FREE, ROBOTS["kingfisher"])] == [3, 6, 6]
    weights = [-build_model(robot).opt.gravity[2] for robot in (PLATFORM, FREE, ROBOTS["kingfisher"])]
    assert weights == [GRAVITY, 0.0, GRAVITY]


@pytest.mark.parametrize("name", WHEELED)
def test_wheels_have_the_radius_place_and_friction_of_the_yaml(name):
    drive = ROBOTS[name].actuators
    model = build_model(ROBOTS[name])
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    wheels = [i for i in range(model.ngeom) if model.geom_type[i] == mujoco.mjtGeom.mjGEOM_ELLIPSOID]
    assert len(wheels) == (4 if drive.kind == "ackermann" else 2)
    places = sorted(tuple(np.round(data.geom_xpos[i][:2], 9)) for i in wheels)
    axles = (0.0, drive.wheelbase) if drive.kind == "ackermann" else (0.0,)
    wanted = sorted((x, side * 0.5 * drive.track) for x in axles for side in (-1, 1))
    np.testing.assert_allclose(places, wanted, atol=1e-9)
    for i in wheels:
        np.testing.assert_allclose(model.geom_size[i][[0, 2]], drive.wheel_radius)
        assert model.geom_friction[i][0] == drive.friction


@pytest.mark.parametrize("name", ["turtlebot2", "jetbot"])
def test_casters_stand_where_the_yaml_has_them_and_slide_freely(name):
    drive = ROBOTS[name].actuators
    model = build_model(ROBOTS[name])
    casters = [i for i in range(model.ngeom) if model.geom_type[i] == mujoco.mjtGeom.mjGEOM_SPHERE]
    wanted = [drive.caster_x] if drive.caster_x < 0.0 else [-drive.caster_x, drive.caster_x]
    assert sorted(model.geom_pos[i][0] for i in casters) == wanted
    assert all(model.geom_condim[i] == 1 for i in casters)


@pytest.mark.parametrize("name", WHEELED)
def test_motors_push_no_harder_than_the_yaml_says(name):
    drive = ROBOTS[name].actuators
    model = build_model(ROBOTS[name])
    driven = [i for i in range(model.nu) if model.actuator_forcelimited[i]]
    force = sum(model.actuator_forcerange[i][1] for i in driven) / drive.wheel_radius
    whole_force = drive.wheel_force * (1 if drive.kind == "ackermann" else 2)
    # What turns the wheels themselves comes on top.
    assert whole_force <= force <= 1.1 * whole_force
