"""Things in space as shapes for viewers: where their parts are, and how far their volumes reach."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.rotation import rotate
from fulmar_core.tasks import load_task
from fulmar_core.wires.robot_name import frames_of
from fulmar_core.worlds.structures import KeepOut, Part, list_structures, load_structure
from fulmar_ros.marker_messages import scene_message
from fulmar_ros.scene.scene import Scene
from fulmar_ros.scene.structure_shapes import KEEP_OUT, THING, structure_shapes


@pytest.mark.parametrize("name", list_structures())
def test_each_part_is_drawn_where_it_is_and_as_large_as_it_is(name: str) -> None:
    structure = load_structure(name)
    shapes = [shape for shape in structure_shapes([structure]) if shape.group == THING]
    assert [shape.number for shape in shapes] == list(range(len(structure.parts)))
    for part, shape in zip(structure.parts, shapes, strict=True):
        np.testing.assert_allclose(shape.size, 2.0 * part.half_box)
        corner = np.array(shape.position) + rotate(np.array(shape.quat), 0.5 * np.array(shape.size))
        assert np.abs(part.corners - corner).sum(axis=1).min() < 1e-9


def test_a_capsule_is_drawn_as_a_cylinder_between_two_balls_whatever_its_direction() -> None:
    structure = load_structure("venus_express")
    capsule = Part("arm", "capsule", (0.1, 0.5), (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0), "arm", (1.0, 0.0, 0.0))
    for end in ((0.0, 0.0, 2.0), (0.0, 0.0, -2.0), (1.2, 1.6, 0.0)):
        both = replace(structure, parts=(capsule,), keep_out=KeepOut((0.0, 0.0, 0.0), end, 3.0))
        shapes = structure_shapes([both])
        assert sorted(shape.kind for shape in shapes) == ["cylinder"] * 2 + ["sphere"] * 4
        tube = next(shape for shape in shapes if shape.group == KEEP_OUT and shape.kind == "cylinder")
        half = rotate(np.array(tube.quat), np.array((0.0, 0.0, 0.5 * tube.size[2])))
        ends = np.array(tube.position) + np.array((-half, half))
        np.testing.assert_allclose(sorted(ends.tolist()), sorted([[0.0, 0.0, 0.0], list(end)]), atol=1e-9)


def test_the_scene_of_a_task_with_a_thing_has_it_from_the_start_on_and_turned() -> None:
    robot = load_robot("int_ball2")
    change = Scene(robot, load_task("go_to_pose_3d", "gateway")).change()
    assert change is not None
    message = scene_message(change, frames_of("int_ball2", "int_ball2"))
    markers = [marker for marker in message.markers if marker.ns == THING]
    assert len(markers) == len(load_structure("gateway").parts)
    assert any(abs(marker.pose.orientation.y) > 0.5 for marker in markers), "modules lie along x"
    assert [marker.scale.x for marker in message.markers if marker.ns == KEEP_OUT] == [
        pytest.approx(2 * 1.536)
    ]
