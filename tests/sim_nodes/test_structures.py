"""Things in space as bodies of MuJoCo: where their parts are, what they are called, and what runs into them."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.worlds.structures import SEMANTIC_IDS, Structure, list_structures, load_structure
from sim_nodes.mujoco_model.scene import Scene
from sim_nodes.mujoco_model.structures import SLICES, add_structure, semantic_ids

ROBOT = load_robot("int_ball2")
every = pytest.mark.parametrize("name", list_structures())


def compiled(structure: Structure) -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    add_structure(spec, structure)
    return spec.compile()


@every
def test_geoms_of_a_structure_stand_where_its_parts_do_and_have_its_meanings(name: str) -> None:
    structure = load_structure(name).at((1.0, 2.0, 3.0, np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0))
    model = compiled(structure)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    ids = semantic_ids(model, (structure,))
    for part in structure.parts:
        geom = data.geom(f"{name}/{part.name}")
        low, high = part.corners.min(axis=0), part.corners.max(axis=0)
        np.testing.assert_allclose(geom.xpos, 0.5 * (low + high), atol=1e-9)
        reach = np.abs(geom.xmat.reshape(3, 3)) @ part.half_box
        np.testing.assert_allclose(reach, 0.5 * (high - low), atol=1e-9)
        assert ids[geom.id] == SEMANTIC_IDS[part.semantic] > 0
    assert model.vis.quality.numslices == SLICES


@every
def test_a_robot_that_flies_into_a_structure_is_stopped_by_it(name: str) -> None:
    structure = load_structure(name)
    wing = max(structure.parts, key=lambda part: part.size[0] * part.size[1])  # a flat one, seen along z
    x, y, _ = wing.pose[:3]
    scene = Scene(ROBOT, structures=(structure,))
    model, data = scene.model, scene.data
    top = wing.pose[2] + wing.size[2] + ROBOT.body.radius
    data.qpos[:3], data.qvel[2] = (x, y, top + 0.1), -0.3
    force, largest, lowest = np.zeros(6), 0.0, top
    for _ in range(round(2.0 / model.opt.timestep)):
        mujoco.mj_step(model, data)
        for i in range(data.ncon):
            mujoco.mj_contactForce(model, data, i, force)
            largest = max(largest, force[0])
        lowest = min(lowest, data.qpos[2])
    assert largest > 1.0, "no contact force"
    assert lowest > top - 0.02, "it went through"
    assert data.qvel[2] > -0.01, "it still flies on"


def test_a_structure_that_is_only_shown_touches_nothing() -> None:
    spec = mujoco.MjSpec()
    add_structure(spec, load_structure("gateway"), touches=False, group=3)
    model = spec.compile()
    assert not model.geom_contype.any() and not model.geom_conaffinity.any()
    assert set(model.geom_group) == {3}
