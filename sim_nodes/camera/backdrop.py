"""What a camera of each kind of robot sees beside structures: a floor, water, or the black of space."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass

from fulmar_core.robots.robot import Robot
from sim_nodes.mujoco_model.scene import robot_model_of

# Semantic ids of what is no part of a structure, beside `SEMANTIC_IDS`; 0 is the sky and the black of space.
FLOOR_ID, WATER_ID, BLOCK_ID = 100, 101, 102
SEA_FAR_M = 2000.0  # an aircraft's horizon is as far at least


@dataclass(frozen=True)
class Ground:
    """A plane without an end, in squares of one metre."""

    height: float  # in the world, in which a robot at rest on it is at 0 [m]
    semantic: int
    color: tuple[float, float, float]


@dataclass(frozen=True)
class Backdrop:
    """What there is everywhere."""

    ground: Ground | None = None
    sky: bool = False  # a bright one with light from everywhere; else it is black
    far: float = 0.0  # that is seen at least, whatever the camera's file says [m]


SPACE = Backdrop()
SEA = Ground(0.0, WATER_ID, (0.30, 0.50, 0.62))


def _in_the_plane(robot: Robot) -> Backdrop:
    if robot.hydrodynamics is not None:
        return Backdrop(SEA, sky=True)
    low = -robot_model_of(robot).rest_height
    return Backdrop(Ground(low, FLOOR_ID, (0.78, 0.78, 0.76)), sky=True)


BY_KIND: dict[str, Callable[[Robot], Backdrop]] = defaultdict(
    lambda: lambda _: SPACE,
    planar=_in_the_plane,
    rolling=_in_the_plane,
    aircraft=lambda _: Backdrop(SEA, sky=True, far=SEA_FAR_M),
)


def backdrop_of(robot: Robot) -> Backdrop:
    """What there is around a robot."""
    return BY_KIND[robot.kind.name](robot)
