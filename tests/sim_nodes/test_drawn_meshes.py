"""Meshes of a look in MuJoCo: drawn where their file puts them, and no bit of the motion changes."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from fulmar_core.robots.look import Part
from fulmar_core.robots.robot_file import load_robot
from sim_nodes.mujoco_model.scene import Scene
from tests.robot_files import write_cuboid

ROBOTS = ("floating_platform", "kingfisher", "turtlebot2", "leatherback", "cubesat_8", "cubesat_wheels")


def with_mesh(folder, name, size=(400.0, 300.0, 200.0)):
    write_cuboid(folder / "hull.stl", size)
    file = str(folder / "hull.stl")
    part = Part("mesh", (), (0.1, 0.0, 0.05), (0.0, 0.0, 90.0), "navy", file=file, scale=(0.001,) * 3)
    robot = load_robot(name)
    return robot, replace(robot, look=(part,))


@pytest.mark.parametrize("name", ROBOTS)
def test_a_mesh_weighs_nothing_and_touches_nothing(tmp_path, name):
    plain, drawn = (Scene(robot).model for robot in with_mesh(tmp_path, name))
    np.testing.assert_array_equal(drawn.body_mass, plain.body_mass)
    np.testing.assert_array_equal(drawn.body_inertia, plain.body_inertia)
    geom = mujoco.mj_name2id(drawn, mujoco.mjtObj.mjOBJ_GEOM, "look_0")
    assert not drawn.geom_contype[geom]
    assert not drawn.geom_conaffinity[geom]


def test_it_is_drawn_where_the_file_puts_it_and_the_hull_is_hidden(tmp_path):
    model = Scene(with_mesh(tmp_path, "floating_platform")[1]).model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    geom = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, "look_0")
    corners = model.mesh_vert @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
    body = data.xpos[model.geom_bodyid[geom]]
    assert np.ptp(corners, axis=0) == pytest.approx((0.3, 0.4, 0.2), abs=1e-6)
    assert 0.5 * (corners.max(axis=0) + corners.min(axis=0)) - body == pytest.approx(
        (0.1, 0.0, 0.05), abs=1e-6
    )
    hull = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, "hull")
    assert model.geom_group[hull] == 3
    assert model.geom_group[geom] == 2


def test_motion_is_the_same_to_the_last_bit(tmp_path):
    ends = []
    for robot in with_mesh(tmp_path, "kingfisher"):
        model = Scene(robot).model
        data = mujoco.MjData(model)
        data.qvel[:] = np.linspace(0.1, 0.3, model.nv)
        for _ in range(50):
            mujoco.mj_step(model, data)
        ends.append(data.qpos.tobytes() + data.qvel.tobytes())
    assert ends[0] == ends[1]


def test_a_flat_mesh_is_drawn_too(tmp_path):
    (tmp_path / "flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n")
    part = Part("mesh", file=str(tmp_path / "flat.obj"))
    assert Scene(replace(load_robot("floating_platform"), look=(part,))).model.nmesh == 1
