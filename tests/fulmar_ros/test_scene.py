"""What viewers draw: shapes of goals, limits, thrust and bodies, and which of them are gone."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from visualization_msgs.msg import Marker

from fulmar_core.config.paths import config_names
from fulmar_core.robots.look import Part
from fulmar_core.robots.look_primitives import primitives_of
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.wires.robot_name import PLAIN
from fulmar_ros.marker_messages import marker_of
from fulmar_ros.scene.scene import Scene
from fulmar_ros.scene.shape import Shape
from tests.spaces import task_for

POSE = np.array([[1.0, 2.0, 0.0, 0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)]])  # it looks along y
PATH = np.array([[float(x), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0] for x in range(4)])


def scene_of(robot: str = "floating_platform", task: str = "go_to_pose", **more) -> Scene:
    return Scene(load_robot(robot), load_task(task), **more)


def drawn(scene: Scene) -> dict[tuple[str, int], Shape]:
    """What there is after a change."""
    change = scene.change()
    assert change is not None
    return {shape.key: shape for shape in change.shapes}


def groups(shapes: dict[tuple[str, int], Shape]) -> set[str]:
    return {group for group, _ in shapes}


@pytest.mark.parametrize("robot", config_names("robots"))
def test_every_robot_shows_its_body_at_once_and_nothing_that_was_not_received(robot):
    shapes = drawn(scene_of(robot, task_for(load_robot(robot), "go_to_pose").name))
    parts = primitives_of(load_robot(robot).look)
    assert [*shapes] == [("body", number) for number in range(len(parts))]
    for part, shape in zip(parts, shapes.values(), strict=True):
        assert shape.in_body
        assert (shape.kind, shape.position, shape.color) == (part.shape, part.at, part.rgba)
        assert (shape.size[0], shape.size[-1]) == (part.size[0], part.size[-1])
        assert shape.quat == part.quat_xyzw


def test_a_robot_without_a_look_shows_its_outline():
    robot = replace(load_robot("kingfisher"), look=())
    shapes = drawn(Scene(robot, load_task("go_to_pose")))
    assert [*shapes] == [("body", 0)]
    low, high = robot.hull_span
    width = robot.body.footprint or (2.0 * robot.body.radius,) * 2
    assert shapes["body", 0].size == (*width, high - low)
    assert shapes["body", 0].position == (robot.body.footprint_x, 0.0, 0.5 * (low + high))


def test_nothing_is_drawn_again_before_it_changes():
    scene = scene_of()
    scene.change()
    assert scene.change() is None
    scene.give_goal(POSE, 5)
    scene.change()
    scene.give_goal(POSE, 6)  # the same goal once more
    assert scene.change() is None


def test_a_pose_is_a_disc_as_wide_as_the_tolerance_with_an_arrow_along_its_heading():
    scene = scene_of()
    scene.give_goal(POSE, 5)
    shapes = drawn(scene)
    disc, arrow = shapes["goal", 0], shapes["goal", 1]
    assert (disc.kind, disc.in_body, disc.position) == ("cylinder", False, (1.0, 2.0, 0.0))
    assert disc.size[:2] == (0.2, 0.2)  # go_to_pose: 0.1 m
    tail, tip = arrow.points
    assert tail == (1.0, 2.0, 0.0)
    assert tip[0] == pytest.approx(1.0)
    assert tip[1] > 2.1


def test_a_place_has_no_arrow():
    scene = scene_of(task="go_to_position")
    scene.give_goal(POSE, 5)
    assert {key for key in drawn(scene) if key[0] == "goal"} == {("goal", 0)}


def test_a_pose_in_space_is_a_ball_with_the_three_axes_of_its_attitude():
    scene = scene_of("spacecraft_16", "go_to_pose_3d")
    scene.give_goal(
        np.array([[1.0, 2.0, 3.0, math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)]]), 5
    )  # rolled by 90 degrees
    shapes = drawn(scene)
    assert shapes["goal", 0].kind == "sphere"
    assert shapes["goal", 0].size == pytest.approx((0.1, 0.1, 0.1))
    ways = [np.subtract(*reversed(shapes["goal", 1 + axis].points)) for axis in range(3)]
    unit = [way / np.linalg.norm(way) for way in ways]
    assert np.allclose(unit, [(1, 0, 0), (0, 0, 1), (0, -1, 0)])


@pytest.mark.parametrize("done", [0, 2, 5])
def test_a_path_shows_all_waypoints_and_disc_and_geofence_around_the_current_one(done):
    scene = scene_of(task="go_through_positions")
    scene.give_goal(PATH, 5)
    scene.give_status({"goal_stamp_ns": "5", "goals_done": str(done), "mode": "active"})
    shapes = drawn(scene)
    assert len(shapes["goal", 11].points) == 4
    assert shapes["goal", 10].points[0] == shapes["goal", 10].points[-1]  # back to the first
    assert shapes["goal", 0].position == (done % 4, 0.0, 0.0)
    center = np.mean(shapes["geofence", 0].points, axis=0)
    assert np.allclose(center, (done % 4, 0.0, 0.0), atol=1e-9)
    radius = np.linalg.norm(np.array(shapes["geofence", 0].points) - center, axis=1)
    assert np.allclose(radius, load_robot("floating_platform").limits.geofence)


def test_a_long_path_takes_no_more_shapes_than_a_short_one():
    scene = scene_of(task="go_through_poses")
    scene.give_goal(PATH, 5)
    short = drawn(scene)
    scene.give_goal(np.tile(PATH, (2000, 1)), 6)
    assert drawn(scene).keys() == short.keys()


def test_a_velocity_is_an_arrow_and_an_arc_on_the_robot_and_has_no_geofence():
    scene = scene_of("turtlebot2", "track_velocities")
    scene.give_goal(np.array([[0.4, 0.0, 0.0, 0.0, 0.0, -0.5]]), 5)
    shapes = drawn(scene)
    assert groups(shapes) == {"body", "goal"}
    assert all(shapes["goal", number].in_body for number in (0, 1))
    tail, tip = shapes["goal", 0].points
    assert tip[0] - tail[0] == pytest.approx(0.4)
    assert shapes["goal", 1].points[-1][1] < 0.0  # it turns to the right


@pytest.mark.parametrize(
    ("robot", "area", "ends"),
    [
        ("floating_platform", (-1.0, 2.0, -3.0, 4.0), 5),
        ("spacecraft_16", (-1.0, 2.0, -3.0, 4.0, -5.0, 6.0), 24),
    ],
)
def test_the_area_is_a_rectangle_or_in_space_a_box(robot, area, ends):
    shapes = drawn(scene_of(robot, f"go_to_pose{load_robot(robot).state_type.SUFFIX}", area=area))
    corners = np.array(shapes["area", 0].points)
    assert len(corners) == ends  # of a closed line; of twelve edges
    assert not shapes["area", 0].in_body
    for axis in range(len(area) // 2):
        assert {*corners[:, axis]} == {*area[2 * axis : 2 * axis + 2]}


def test_each_open_nozzle_has_a_plume_against_its_push():
    scene, robot = scene_of(), load_robot("floating_platform")
    names = robot.actuators.names
    scene.give_applied(names, [1.0 if name in (names[0], names[3]) else 0.0 for name in names])
    shapes = drawn(scene)
    assert {key for key in shapes if key[0] == "thrust"} == {("thrust", 0), ("thrust", 3)}
    for number in (0, 3):
        push, plume = robot.actuators.pushes[number], shapes["thrust", number]
        assert plume.in_body
        assert plume.points[0] == push.position
        assert np.dot(np.subtract(*reversed(plume.points)), push.direction) < 0.0


def test_a_plume_is_as_long_as_its_share_of_full_thrust_and_turns_round_astern():
    scene, robot = scene_of("kingfisher"), load_robot("kingfisher")
    lengths = {}
    for command in (1.0, -1.0, 0.1):  # 19.5 N, -4 N, nothing
        scene.give_applied(robot.actuators.names, [command, command])
        shapes = drawn(scene)
        lengths[command] = (
            np.subtract(*reversed(shapes["thrust", 0].points))[0] if ("thrust", 0) in shapes else 0.0
        )
    assert lengths[1.0] == pytest.approx(-robot.body.radius)
    assert lengths[-1.0] == pytest.approx(robot.body.radius * 4.0 / 19.5)
    assert lengths[0.1] == 0.0


def test_a_pulse_between_two_looks_shows_as_its_share_of_the_time():
    scene = scene_of()
    names = load_robot("floating_platform").actuators.names
    for value in (0.0, 1.0, 0.0, 0.0):
        scene.give_applied(names, [value] + [0.0] * (len(names) - 1))
    plume = drawn(scene)["thrust", 0]
    full = load_robot("floating_platform").body.radius
    assert math.dist(*plume.points) == pytest.approx(0.25 * full)


def test_wheels_show_where_they_drive_to():
    scene, car = scene_of("leatherback"), load_robot("leatherback")
    scene.give_applied(car.actuators.names, [1.0, 0.3])
    shapes = drawn(scene)
    assert math.dist(*shapes["drive", 0].points) == pytest.approx(1.0)
    end = shapes["drive", 1].points[-1]
    assert math.atan2(end[1], end[0]) == pytest.approx(math.tan(0.3) / 0.32)


@pytest.mark.parametrize(
    ("names", "effort"), [(["valve"], [1.0]), ([], []), (None, [math.nan] * 8), (None, [1.0] * 7)]
)
def test_an_invalid_actuator_state_draws_nothing(names, effort):
    scene = scene_of()
    scene.give_applied(load_robot("floating_platform").actuators.names if names is None else names, effort)
    assert groups(drawn(scene)) == {"body"}


def test_what_is_gone_is_named_as_long_as_it_is_gone():
    scene = scene_of()
    names = load_robot("floating_platform").actuators.names
    scene.give_applied(names, [1.0] + [0.0] * (len(names) - 1))
    scene.give_obstacles(np.array([[1.0, 0.0, 0.2], [2.0, 0.0, 0.3]]))
    assert scene.change().gone == ()
    scene.give_obstacles(np.array([[1.0, 0.0, 0.2]]))
    assert scene.change().gone == (("obstacles", 1),)
    scene.forget_applied()
    assert scene.change().gone == (("obstacles", 1), ("thrust", 0))
    scene.give_applied(names, [1.0] + [0.0] * (len(names) - 1))
    assert scene.change().gone == (("obstacles", 1),)


@pytest.mark.parametrize(
    ("status", "shown"),
    [
        ({}, 2.0),  # an external controller reports nothing
        ({"goal_stamp_ns": "6", "mode": "active"}, 2.0),
        ({"goal_stamp_ns": "5", "mode": "active"}, 1.0),  # it refused the second
        ({"goal_stamp_ns": "0", "mode": "armed"}, None),  # an e-stop took the goal away
    ],
)
def test_the_goal_is_the_one_that_the_controller_follows(status, shown):
    scene = scene_of()
    for number in (1, 2):
        scene.give_goal(np.array([[float(number), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]]), 4 + number)
    scene.give_status(status)
    shapes = drawn(scene)
    assert (shapes["goal", 0].position[0] if ("goal", 0) in shapes else None) == shown


@pytest.mark.parametrize(("mode", "is_shown"), [("active", True), ("armed", False)])
def test_a_goal_without_a_stamp_is_shown_while_the_controller_acts(mode, is_shown):
    scene = scene_of()
    scene.give_goal(POSE, 0)
    scene.give_status({"goal_stamp_ns": "0", "mode": mode})
    assert (("goal", 0) in drawn(scene)) is is_shown


def test_a_mesh_is_drawn_from_its_file(tmp_path):
    part = Part(
        "mesh", (), (0.1, 0.0, 0.2), (0.0, 0.0, 90.0), file=str(tmp_path / "hull.stl"), scale=(0.001,) * 3
    )
    robot = replace(load_robot("floating_platform"), look=(part,))
    shape = drawn(Scene(robot, load_task("go_to_pose")))["body", 0]
    assert (shape.kind, shape.size, shape.position) == ("mesh", part.scale, part.at)
    assert shape.quat == part.quat_xyzw
    marker = marker_of(shape, PLAIN)
    assert marker.type == Marker.MESH_RESOURCE
    assert marker.mesh_resource == (tmp_path / "hull.stl").as_uri()
    assert marker.scale.x == 0.001
