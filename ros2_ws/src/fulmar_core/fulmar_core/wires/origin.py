"""Where the frame `odom` of a robot lies in `map`, the frame that all robots of a domain share."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from fulmar_core.states.attitude import from_euler
from fulmar_core.states.rotation import multiply, rotate_inverse

FORMS = "x,y,deg or x,y,z,deg or x,y,z,roll,pitch,yaw"
FARTHEST_M = 1e6  # one farther away is a mistake of units [m]
HERE = (0.0, 0.0, 0.0)  # odom is map


def check_origin(numbers: Sequence[float]) -> None:
    """Refuse what is no origin.

    Args:
        numbers: As in `FORMS` [m, deg].

    Raises:
        ValueError: With what is allowed.
    """
    if len(numbers) not in (3, 4, 6) or not all(math.isfinite(number) for number in numbers):
        raise ValueError(
            f"an origin has three, four or six finite numbers, {FORMS} [m, deg], found {list(numbers)}."
        )
    place = numbers[: 2 if len(numbers) == 3 else 3]
    if max(abs(number) for number in place) > FARTHEST_M:
        raise ValueError(
            f"an origin lies at most {FARTHEST_M:,.0f} m away, found {list(place)}. Give metres."
        )


def origin_pose(numbers: Sequence[float]) -> tuple[float, ...]:
    """Pose of `odom` in `map`: x, y, z [m], quaternion x, y, z, w.

    Args:
        numbers: As in `FORMS` [m, deg]; none: both are one.
    """
    x, y, *rest = numbers or HERE
    z = rest[0] if len(rest) > 1 else 0.0
    roll, pitch, yaw = rest[1:] if len(rest) == 4 else (0.0, 0.0, rest[-1])
    turned = from_euler(*(np.asarray(math.radians(angle)) for angle in (roll, pitch, yaw)))
    return (float(x), float(y), float(z), *(float(part) for part in turned))


def in_odom(poses: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """Poses of `map` in the frame `odom`.

    Args:
        poses: x, y, z [m], quaternion x, y, z, w, shape (..., 7).
        origin: The same of `odom` in `map`, shape (7,), as `origin_pose` returns it.

    Returns:
        Shape (..., 7).
    """
    back = origin[3:] * np.array([-1.0, -1.0, -1.0, 1.0])
    places = rotate_inverse(origin[3:], poses[..., :3] - origin[:3])
    turned = multiply(np.broadcast_to(back, poses[..., 3:].shape), poses[..., 3:])
    return np.concatenate((places, turned), axis=-1)
