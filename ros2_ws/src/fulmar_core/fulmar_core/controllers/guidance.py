"""Where to steer and how fast, for robots that go where they point."""

from __future__ import annotations

import numpy as np

from fulmar_core.controllers.body_frame import Vector

MOVING = 0.03  # slower than this counts as standing; a few standard deviations of measured speed [m/s]


def way_to_face(
    goal: Vector, speed: np.ndarray, *, backwards: bool | np.ndarray, margin: float = 0.2
) -> np.ndarray:
    """Whether to go ahead (1) or astern (-1).

    Who is under way goes on that way until the goal is well on the other side, so noise cannot turn it back and forth.

    Args:
        goal: In the body's frame, shapes (...,) [m].
        speed: Ahead, shape (...,) [m/s].
        backwards: Whether going astern is allowed, one truth value or shape (...,).
        margin: Beyond a quarter turn, before the way is changed [rad].

    Returns:
        Shape (...,).
    """
    under_way = np.where(np.abs(speed) > MOVING, np.sign(speed), 0.0)
    beside = np.cos(np.arctan2(goal[1], goal[0]))
    return np.where(backwards & (beside < -np.sin(margin) * under_way), -1.0, 1.0)


def way_to_turn_least(
    goal: Vector, turn: np.ndarray, speed: np.ndarray, *, margin: float = 0.4
) -> np.ndarray:
    """Whether to go to a pose ahead (1) or astern (-1): the way that turns less, before and after, shape (...,).

    Args:
        goal: In the body's frame, shapes (...,) [m].
        turn: Wanted heading minus heading, shape (...,) [rad].
        speed: Ahead, shape (...,) [m/s].
        margin: What is saved at least by a change of the way [rad].
    """
    alpha = np.stack((np.arctan2(goal[1], goal[0]), np.arctan2(-goal[1], -goal[0])))
    after = turn - alpha
    turns = np.abs(alpha) + np.abs(np.arctan2(np.sin(after), np.cos(after)))
    under_way = np.where(np.abs(speed) > MOVING, np.sign(speed), 0.0)
    return np.where(turns[1] < turns[0] - margin * under_way, -1.0, 1.0)


def bearing(goal: Vector, way: np.ndarray) -> np.ndarray:
    """Angle from the end that goes first to the goal, in [-pi, pi], shape (...,) [rad]."""
    return np.asarray(np.arctan2(way * goal[1], way * goal[0]))


def end_that_goes_first(speed: np.ndarray) -> np.ndarray:
    """Direction of travel in the body's frame: ahead, or astern for who moves astern, shape (...,) [rad]."""
    return np.where(speed < -MOVING, np.pi, 0.0)


def stopping_speed(
    distance: np.ndarray, *, gain: float, deceleration: float, last: np.ndarray | float = 0.0
) -> np.ndarray:
    """Fastest speed from which one still comes down to `last` within a distance.

    Far away the braking is even, v² = last² + 2 a d; near by the speed falls with the distance, v = last + k d, because
    even braking would need an infinite gain at its end.

    Args:
        distance: To go, shape (...,) [m].
        gain: k [1/s].
        deceleration: a [m/s²].
        last: Speed at the end [m/s].

    Returns:
        Shape (...,) [m/s].
    """
    return np.minimum(last + gain * distance, np.sqrt(last * last + 2.0 * deceleration * distance))


def passing_speed(goal: Vector, leg: Vector, *, cruise: np.ndarray | float, corner: float) -> np.ndarray:
    """Speed at which to pass a waypoint, given the corner of the path there.

    Args:
        goal: Way to the waypoint, shapes (...,) [m].
        leg: Way from it to the next one, same shapes [m].
        cruise: Where the path goes straight on [m/s].
        corner: Share of it where the path turns by a quarter or more [-].

    Returns:
        Shape (...,) [m/s].
    """
    return np.asarray(cruise * (corner + (1.0 - corner) * np.maximum(straightness(goal, leg), 0.0)))


def straightness(goal: Vector, leg: Vector) -> np.ndarray:
    """Cosine of the corner at a waypoint, shape (...,): 1 straight on, -1 back again."""
    product = np.hypot(*goal) * np.hypot(*leg)
    return np.asarray((goal[0] * leg[0] + goal[1] * leg[1]) / np.maximum(product, 1e-9))


CREEP = 0.15  # least distance returned: a robot that stands at an obstacle can leave [m]


def room_ahead(discs: tuple[np.ndarray, np.ndarray, np.ndarray], direction: np.ndarray) -> np.ndarray:
    """Distance to the first disc in a direction.

    Speed is limited so that the robot can stop before it (the admissible velocities of Fox, Burgard and Thrun, "The
    dynamic window approach to collision avoidance", IEEE RAM 4(1), 1997).

    Args:
        discs: Centres in the body's frame and widths, three arrays of shape (..., k) [m].
        direction: Of travel in the body's frame, shape (...,) [rad].

    Returns:
        Shape (...,), infinite where nothing is in the way [m].
    """
    x, y, wide = discs
    c, s = np.cos(direction)[..., None], np.sin(direction)[..., None]
    along, beside = c * x + s * y, c * y - s * x
    to_edge = along - np.sqrt(np.maximum(wide * wide - beside * beside, 0.0))
    ahead = (np.abs(beside) < wide) & (along > 0.0)
    room = np.where(ahead, np.maximum(to_edge, CREEP), np.inf)
    return np.asarray(np.min(room, axis=-1, initial=np.inf))
