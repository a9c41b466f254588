"""Contact of a robot's outline with a round block that it pushes."""

from __future__ import annotations

from dataclasses import dataclass

from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.planar import PlanarState, to_body
from fulmar_core.states.rotation import Array


@dataclass(frozen=True)
class Outline:
    """Outline of a robot: everything within `rounding` of a box; a disc is a box without size."""

    ahead: float  # of the box's middle, from the body's origin [m]
    half_length: float  # [m]
    half_width: float  # [m]
    rounding: float  # [m]

    @property
    def extent(self) -> float:
        """How far the outline reaches from the body's origin [m]."""
        return float(((abs(self.ahead) + self.half_length) ** 2 + self.half_width**2) ** 0.5 + self.rounding)

    def nearest(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Point of the box that is nearest to another, both in the body's frame, shapes (...,) [m]."""
        near = clip(x - self.ahead, -self.half_length, self.half_length) + self.ahead
        return near, clip(y, -self.half_width, self.half_width)

    def gap(self, x: Array, y: Array) -> Array:
        """Distance of a point in the body's frame from the outline, negative inside a disc, shapes (...,) [m]."""
        xp = array_namespace(x)
        near_x, near_y = self.nearest(x, y)
        return xp.sqrt((x - near_x) ** 2 + (y - near_y) ** 2) - self.rounding


def outline_of(robot: Robot) -> Outline:
    """The outline that a robot's YAML describes."""
    if robot.body.footprint is None:
        return Outline(0.0, 0.0, 0.0, robot.body.radius)
    length, width = robot.body.footprint
    return Outline(robot.body.footprint_x, 0.5 * length, 0.5 * width, 0.0)


PARTS = 4  # of one step's way; a part has to be shorter than the block's radius
SIDEWAYS = 4.0 / 13.0


@dataclass(frozen=True)
class Block:
    """A round thing to push."""

    radius: float  # [m]
    height: float  # for simulators that have one [m]
    mass: float  # [kg]
    floor_friction: float  # between the block and the floor [-]
    grip: float  # friction between the robot and the block [-]

    def __post_init__(self) -> None:
        if min(self.radius, self.height, self.mass) <= 0.0 or min(self.floor_friction, self.grip) < 0.0:
            raise ValueError("radius, height and mass must be greater than 0, frictions not negative.")


def push(
    before: PlanarState, after: PlanarState, x: Array, y: Array, block: Block, robot: Robot
) -> tuple[Array, Array, PlanarState]:
    """Push a block out of the way that a robot took.

    Quasi-static: friction on the floor takes any speed from the block at once, so that it moves only as far as the
    robot drives into it. Its disc presses evenly on the floor; what force and moment move it together is an ellipsoid
    (Howe and Cutkosky, "Practical force-motion models for sliding manipulation", 1996), with a moment arm of 2/3 of
    the radius. A force along the contact then moves its middle by 1 / (1 + 9/4) = 4/13 of what the contact point
    moves, as the rest is turning, as long as the contact holds; else by the friction coefficient times the way
    inwards.

    Args:
        before: Robot at the start of a step, shapes (...,).
        after: At its end, as if there were no block.
        x: Where the block was, shape (...,) [m].
        y: Same.
        block: The block.
        robot: Its outline and its mass.

    Returns:
        Where the block is, and the robot, which loses the work that pushing took if nothing but its speed carries it
        on: wheels hold theirs, see `RollingDynamics`.
    """
    xp = array_namespace(x)
    outline = outline_of(robot)
    turn = (after.yaw - before.yaw) / PARTS
    step_x, step_y = (after.x - before.x) / PARTS, (after.y - before.y) / PARTS
    start_x, start_y, driven = x, y, xp.zeros_like(x)
    for part in range(1, PARTS + 1):
        yaw = before.yaw + part * turn
        bx, by = to_body(yaw, x - before.x - part * step_x, y - before.y - part * step_y)
        near_x, near_y = outline.nearest(bx, by)
        dx, dy = bx - near_x, by - near_y
        distance = clip(xp.sqrt(dx * dx + dy * dy), 1e-6, None)
        nx, ny = dx / distance, dy / distance  # from the robot into the block, in the body's frame
        depth = clip(outline.rounding + block.radius - distance, 0.0, None)
        # The robot's side of the contact slides along by its own motion and its turning.
        ux, uy = to_body(yaw, step_x, step_y)
        touch_x, touch_y = near_x + outline.rounding * nx, near_y + outline.rounding * ny
        slip = (uy + turn * touch_x) * nx - (ux - turn * touch_y) * ny
        aside = clip(SIDEWAYS * slip, -block.grip * depth, block.grip * depth)
        mx, my = nx * depth - ny * aside, ny * depth + nx * aside
        c, s = xp.cos(yaw), xp.sin(yaw)
        x, y = x + c * mx - s * my, y + s * mx + c * my
        driven = driven + xp.sqrt(mx * mx + my * my)
    return x, y, _slowed(after, x - start_x, y - start_y, driven, block, robot.body.mass)


def _slowed(
    state: PlanarState, dx: Array, dy: Array, driven: Array, block: Block, mass: float
) -> PlanarState:
    """Take the floor's work from the part of a robot's speed that goes the block's way."""
    xp = array_namespace(dx)
    length = clip(xp.sqrt(dx * dx + dy * dy), 1e-9, None)
    ux, uy = dx / length, dy / length
    along = clip(state.vx * ux + state.vy * uy, 0.0, None)
    work = block.floor_friction * block.mass * GRAVITY * driven
    left = xp.sqrt(clip(along * along - 2.0 * work / mass, 0.0, None))
    lost = along - left
    return PlanarState(
        state.x, state.y, state.yaw, state.vx - lost * ux, state.vy - lost * uy, state.yaw_rate
    )
