"""The things of a task's world: what stands or moves there beside the robot, each with a name and a pose."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from fulmar_core.dynamics.contact import Block, push
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.topics import WIRES, Wire, thing_wire
from fulmar_core.states.arrays import array_namespace
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.rotation import Array

Poses = Mapping[str, Array]  # by name, each (..., 3): x [m], y [m], yaw [rad] in the world


@dataclass(frozen=True)
class Thing:
    """One thing. Its pose is `Goal.things[name]`, and comes on `<name>/pose` with each odometry."""

    name: str
    body: Block | None = None  # what the robot pushes to the goal; None: the robot touches nothing there

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[a-z][a-z0-9_]*", self.name):
            raise ValueError(f"'{self.name}' is no name of a thing: use lower-case letters, digits and '_'.")
        if any(wire.name == self.wire.name and wire != self.wire for wire in WIRES):
            raise ValueError(f"'{self.name}' cannot be a thing: '{self.wire.name}' is another topic.")

    @property
    def wire(self) -> Wire:
        """Where its pose is published."""
        return thing_wire(self.name)


def push_things(
    things: Sequence[Thing], poses: Poses, before: PlanarState, after: PlanarState, robot: Robot
) -> tuple[Poses, PlanarState]:
    """Move things in the core's dynamics; simulators with contacts move them themselves.

    Args:
        things: All that there are.
        poses: Where they were, and what else has a pose.
        before: The robot at the start of a step, shapes (...,).
        after: At its end, as if nothing were there.
        robot: The robot.

    Returns:
        Where everything is, and the robot once the things have held it up.
    """
    moved = dict(poses)
    for thing in things:
        if thing.body is not None:
            x, y, yaw = (moved[thing.name][..., i] for i in range(3))
            x, y, after = push(before, after, x, y, thing.body, robot)
            moved[thing.name] = array_namespace(x).stack((x, y, yaw), axis=-1)
    return moved, after
