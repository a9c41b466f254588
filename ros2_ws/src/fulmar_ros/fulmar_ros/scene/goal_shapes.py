"""Shapes of a goal, of the limits around it, and of obstacles."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.safety.geofence import NO_AREA
from fulmar_core.states.rotation import rotate
from fulmar_core.states.state import POSE
from fulmar_core.tasks import Task
from fulmar_ros.scene.robot_shapes import velocity_shapes
from fulmar_ros.scene.shape import FLAT_M, Color, Shape, arrow, circle, in_pairs, line, segments

GOAL, GEOFENCE, AREA, OBSTACLES = "goal", "geofence", "area", "obstacles"
GREEN: Color = (0.1, 0.7, 0.2, 1.0)
REACHED: Color = (0.1, 0.7, 0.2, 0.3)  # inside of it the goal is met
BLUE: Color = (0.2, 0.4, 0.9, 1.0)
RED: Color = (0.9, 0.1, 0.1, 0.8)
ORANGE: Color = (0.95, 0.55, 0.1, 0.8)
AXES: tuple[Color, ...] = (
    (0.9, 0.2, 0.2, 1.0),
    (0.2, 0.8, 0.2, 1.0),
    (0.2, 0.3, 0.9, 1.0),
)  # x, y, z as in RViz
OBSTACLE: Color = (0.8, 0.3, 0.2, 1.0)
OBSTACLE_HEIGHT = 0.5  # of what is drawn, our value [m]
# Numbers in the group `goal`.
TOLERANCE, HEADING, PATH, WAYPOINTS, HEADINGS = 0, 1, 10, 11, 12


def goal_shapes(targets: np.ndarray, done: int, task: Task, robot: Robot) -> list[Shape]:
    """The goal: the current target, and the path that it is part of.

    Args:
        targets: As `message_reader.goal_of` reads them: poses in the world, shape (k, 7), or one twist, shape (1, 6).
        done: Targets already reached; after the last one the first comes again.
        task: Its tolerance is drawn, and headings only where they count.
        robot: Arrows are as long as it is wide.
    """
    if targets.shape[1] != POSE:
        return velocity_shapes(GOAL, targets[0].tolist(), robot, GREEN)
    turns = bool(task.tolerance.heading_deg or task.tolerance.attitude_deg)
    shapes = _current(targets[done % len(targets)], task, robot, turns=turns)
    if len(targets) > 1:
        shapes += _path(targets, robot, turns=turns)
    return shapes


def _current(target: np.ndarray, task: Task, robot: Robot, *, turns: bool) -> list[Shape]:
    """A disc or, in space, a ball as wide as the tolerance, with an arrow or three axes."""
    place, quat = target[:3], target[3:]
    in_space = robot.state_type.AXES == 3
    width = 2.0 * task.tolerance.position or robot.body.radius
    size = (width, width, width if in_space else FLAT_M)
    middle = tuple(place.tolist())
    shapes = [Shape(GOAL, TOLERANCE, "sphere" if in_space else "cylinder", False, size, REACHED, middle)]
    if not turns:
        return shapes
    length = max(width, 2.0 * robot.body.radius)
    for axis, color in enumerate(AXES if in_space else (GREEN,)):
        tip = place + length * rotate(quat, np.eye(3)[axis])
        shapes.append(arrow(GOAL, HEADING + axis, middle, tip.tolist(), color, in_body=False))
    return shapes


def _path(targets: np.ndarray, robot: Robot, *, turns: bool) -> list[Shape]:
    """All targets in their order, and back to the first; one shape for all, however many there are."""
    places = targets[:, :3]
    ball = (0.1, 0.1, 0.1)
    shapes = [
        line(GOAL, PATH, [*places.tolist(), places[0].tolist()], BLUE, in_body=False),
        Shape(
            GOAL,
            WAYPOINTS,
            "spheres",
            False,
            ball,
            BLUE,
            points=tuple(tuple(each) for each in places.tolist()),
        ),
    ]
    if turns:
        ahead = rotate(targets[:, 3:], np.broadcast_to([1.0, 0.0, 0.0], places.shape))
        tips = places + robot.body.radius * ahead
        ends = itertools.chain.from_iterable(zip(places.tolist(), tips.tolist(), strict=True))
        shapes.append(segments(GOAL, HEADINGS, ends, BLUE, in_body=False))
    return shapes


def geofence_shapes(targets: np.ndarray, done: int, robot: Robot) -> list[Shape]:
    """How far the robot may be from its current target; nothing around velocities. Arguments as in `goal_shapes`."""
    if targets.shape[1] != POSE:
        return []
    center, radius = targets[done % len(targets), :3].tolist(), robot.limits.geofence
    planes = [(0, 1), (0, 2), (1, 2)] if robot.state_type.AXES == 3 else [(0, 1)]
    ends = [end for axes in planes for end in in_pairs(circle(center, radius, axes))]
    return [segments(GEOFENCE, 0, ends, RED, in_body=False)]


def area_shapes(area: Sequence[float]) -> list[Shape]:
    """The area that the robot must not leave: a rectangle on the floor, or a box; nothing where there is none.

    Args:
        area: As in `Guards.area` [m].
    """
    if tuple(area) == NO_AREA:
        return []
    (left, right), (near, far), *height = zip(area[::2], area[1::2], strict=True)
    corners = [(left, near), (right, near), (right, far), (left, far), (left, near)]
    if not height:
        return [line(AREA, 0, [(x, y, 0.0) for x, y in corners], ORANGE, in_body=False)]
    ends = [end for z in height[0] for end in in_pairs([(x, y, z) for x, y in corners])]
    ends += [(x, y, z) for x, y in corners[:-1] for z in height[0]]
    return [segments(AREA, 0, ends, ORANGE, in_body=False)]


def obstacle_shapes(obstacles: np.ndarray) -> list[Shape]:
    """Discs as cylinders that stand on the floor.

    Args:
        obstacles: Shape (m, 3 or more): x [m], y [m], radius [m]; those of radius 0 are left out.
    """
    there = [[float(part) for part in disc[:3]] for disc in np.asarray(obstacles) if disc[2] > 0.0]
    return [
        Shape(
            OBSTACLES, number, "cylinder", False, (2.0 * radius, 2.0 * radius, OBSTACLE_HEIGHT), OBSTACLE,
            (x, y, 0.5 * OBSTACLE_HEIGHT),
        )
        for number, (x, y, radius) in enumerate(there)
    ]  # fmt: skip
