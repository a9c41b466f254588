"""The shortest ways around discs to a goal: surveyed once for each episode, and looked up often.

The shortest way around discs is made of arcs and of lines that touch two of them (Liu and Arimoto, "Path planning using
a tangent graph for mobile robots among polygonal and curved obstacles", IJRR 11(4), 1992). All but its first line
depends on the discs and the goal alone: `survey` measures that from points around every disc. `shortest_way` adds the
first line, from wherever a robot is along the tangents of every disc, or straight to the goal. Since each length is
that of a whole way, who follows the shortest one never turns back, and no pocket of discs holds him.
"""

from __future__ import annotations

import math

import numpy as np

from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.rotation import Array

CORNERS = 8  # of the polygons around discs from which ways are measured
BLOCKED = 10.0  # metres of detour that are worth not to cross a disc [m]
TOUCHING = 0.98  # share of a disc's width within which a line crosses it; tangents only touch
NOWHERE = 1e-6  # width of discs that are not there [m]
AT_ONCE = 8  # episodes surveyed together, so that what they take stays in the cache


def survey(discs: np.ndarray, target: np.ndarray, clearance: float) -> np.ndarray:
    """Measure the ways to a goal from around each disc.

    Args:
        discs: x [m], y [m] and radius [m], 0 for those that are not there, shape (n, m, 3).
        target: Goals, shape (n, 2) [m].
        clearance: That ways keep between the body's centre and a disc's edge [m].

    Returns:
        Shape (n, m, 4 + `CORNERS`): the discs, the width that ways keep off their centres [m], and lengths of the ways
        from the corners of polygons around them, at even angles from that to the goal on [m].
    """
    wide = np.where(discs[..., 2] > 0.0, discs[..., 2] + clearance, NOWHERE)
    surveyed = np.concatenate((discs, wide[..., None], np.zeros((*wide.shape, CORNERS))), axis=-1)
    for i in range(0, len(discs), AT_ONCE):
        some = surveyed[i : i + AT_ONCE]
        some[..., 4:] = _ways(some[..., 0], some[..., 1], some[..., 3], target[i : i + AT_ONCE])
    return surveyed


def _ways(x: np.ndarray, y: np.ndarray, wide: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Lengths of the ways from the polygons' corners, shape (n, m, `CORNERS`) [m]."""
    n, m = x.shape
    first = np.arctan2(target[:, None, 1] - y, target[:, None, 0] - x)
    angles, reach = first[..., None] + np.arange(CORNERS) * _STEP, wide[..., None] * _REACH
    px = np.concatenate(((x[..., None] + reach * np.cos(angles)).reshape(n, -1), target[:, :1]), axis=1)
    py = np.concatenate(((y[..., None] + reach * np.sin(angles)).reshape(n, -1), target[:, 1:]), axis=1)
    dx, dy = px[:, None] - px[:, :, None], py[:, None] - py[:, :, None]  # from the first to the second
    square = np.maximum(dx * dx + dy * dy, 1e-12)
    lines = np.sqrt(square)
    for i in range(m):  # one by one, which takes less memory
        to_x, to_y = (x[:, i, None] - px)[..., None], (y[:, i, None] - py)[..., None]
        share = np.clip((to_x * dx + to_y * dy) / square, 0.0, 1.0)
        crosses = np.hypot(to_x - share * dx, to_y - share * dy) < TOUCHING * wide[:, i, None, None]
        lines += BLOCKED * crosses
    ways = lines[:, :, -1]
    for _ in range(m * CORNERS):  # Bellman: until no way becomes shorter by one more corner
        shorter = np.minimum(ways, np.min(lines + ways[:, None], axis=-1))
        if np.array_equal(shorter, ways):
            break
        ways = shorter
    return np.asarray(ways[:, :-1].reshape(n, m, CORNERS))


def shortest_way(
    x: Array, y: Array, surveyed: Array, goal: tuple[Array, Array]
) -> tuple[Array, Array, Array]:
    """The shortest way from where a robot is.

    Args:
        x: From the robot to the discs' centres, in a frame that is not turned against the world, shape (..., m) [m].
        y: Same.
        surveyed: What `survey` returned, shape (..., m, 4 + `CORNERS`).
        goal: From the robot to the goal in the same frame, shapes (...,) [m].

    Returns:
        Unit vector of its first line, shapes (...,), and its length, shape (...,) [m].
    """
    xp = array_namespace(x)
    ux, uy, lengths = _tangents(x, y, surveyed[..., 3])
    edge_x, edge_y = lengths * ux - x[..., None], lengths * uy - y[..., None]
    to_goal = goal[0][..., None] - x, goal[1][..., None] - y
    total = lengths + _along_edge(edge_x, edge_y, to_goal, surveyed)
    distance = xp.sqrt(goal[0] * goal[0] + goal[1] * goal[1])
    size = clip(distance, 1e-6, None)
    straight = (goal[0] / size, goal[1] / size, distance, distance)
    ux, uy, lengths, total = (
        xp.concat((xp.reshape(lines, (*distance.shape, -1)), line[..., None]), axis=-1)
        for lines, line in zip((ux, uy, lengths, total), straight, strict=True)
    )
    for i in range(x.shape[-1]):
        to_x, to_y = x[..., i, None], y[..., i, None]
        along = ux * to_x + uy * to_y
        nearest = xp.minimum(along, lengths)
        off_x, off_y, width = to_x - nearest * ux, to_y - nearest * uy, TOUCHING * surveyed[..., i, 3, None]
        enters = (along > 0.0) & (off_x * off_x + off_y * off_y < width * width)  # who leaves does not enter
        total = total + BLOCKED * xp.astype(enters, total.dtype)
    best = xp.argmin(total, axis=-1)[..., None]
    ux, uy, total = (xp.take_along_axis(a, best, axis=-1)[..., 0] for a in (ux, uy, total))
    return ux, uy, total


def _tangents(x: Array, y: Array, wide: Array) -> tuple[Array, Array, Array]:
    """Unit vectors along the lines that touch discs on their left and right, and lengths [m], shapes (..., m, 2)."""
    xp = array_namespace(x)
    far = clip(xp.sqrt(x * x + y * y), 1e-9, None)
    length = xp.sqrt(clip(far * far - wide * wide, 0.0, None))
    # Inside a disc the way out leads away from its centre, the more the deeper.
    cos = xp.where(far > wide, length / far, far / wide - 1.0)
    sin = xp.sqrt(1.0 - cos * cos)
    turn = xp.stack((sin, -sin), axis=-1)
    cx, cy, cos = (part[..., None] for part in (x / far, y / far, cos))
    length = xp.maximum(length, 0.1 * wide)
    return cx * cos - cy * turn, cy * cos + cx * turn, xp.stack((length, length), axis=-1)


def _along_edge(x: Array, y: Array, to_goal: tuple[Array, Array], surveyed: Array) -> Array:
    """Length of the way from points at edges of discs, by the better of the next two corners, shape (..., m, 2) [m].

    Args:
        x: From the discs' centres, shape (..., m, 2) [m].
        y: Same.
        to_goal: From the discs' centres to the goal, shapes (..., m) [m].
        surveyed: The discs, shape (..., m, 4 + `CORNERS`).
    """
    xp = array_namespace(x)
    size = clip(xp.sqrt(to_goal[0] * to_goal[0] + to_goal[1] * to_goal[1]), 1e-9, None)
    cos, sin = (part[..., None] for part in (to_goal[0] / size, to_goal[1] / size))
    x, y = cos * x + sin * y, cos * y - sin * x  # the first corner lies along x
    before = xp.floor(xp.atan2(y, x) / _STEP)
    corners = xp.concat((before, before + 1.0), axis=-1)
    reach = surveyed[..., 3, None] * _REACH
    dx = reach * xp.cos(corners * _STEP) - xp.concat((x, x), axis=-1)
    dy = reach * xp.sin(corners * _STEP) - xp.concat((y, y), axis=-1)
    ways = xp.take_along_axis(surveyed[..., 4:], xp.astype(corners % CORNERS, xp.int64), axis=-1)
    by_corner = xp.sqrt(dx * dx + dy * dy) + ways
    return xp.minimum(by_corner[..., :2], by_corner[..., 2:])


_STEP = 2.0 * math.pi / CORNERS  # between two corners [rad]
_REACH = 1.0 / math.cos(
    0.5 * _STEP
)  # how far out they are, in widths, so that the polygons' sides touch the discs
