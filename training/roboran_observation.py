"""RoboRAN's observation, computed from the terms of our tasks.

Source: snt-spacer/RobRAN-Code at 9273fc28, `rans/tasks/*.py` (order, frames and signs of the terms) and
`rans/robots/*.py` (the last actions follow the terms of the task).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from fulmar_core.config.errors import ConfigError, did_you_mean
from training.onnx_graph import Tensor

MOTION = ("velocity_x_in_body", "velocity_y_in_body", "yaw_rate")
GOALS = ("goal_", "next_goal_", "goal_after_next_")  # prefixes of our terms, nearest target first
NEAR_M = 1e-6  # closer than this a target has no bearing [m]

Terms = Callable[[str], Tensor]  # our term of a name, shape (rows, 1)


@dataclass(frozen=True)
class Layout:
    """What an observation of RoboRAN consists of."""

    kind: str  # of the task
    goals: int  # targets that it shows; 0 where the task has one goal or none
    width: int  # terms of the task, without the last actions


def layout_for(kind: str, inputs: int, actions: int) -> Layout:
    """Find the layout of a network's input.

    Args:
        kind: Kind of the task, as in `configs/tasks`.
        inputs: Width of the network's input.
        actions: Number of actuators.

    Raises:
        ConfigError: RoboRAN's observation of this task is not supported, or never has this width.
    """
    if kind not in _TERMS:
        raise ConfigError(
            f"RoboRAN's observation of '{kind}' is not supported, only those of {', '.join(_TERMS)}."
            f"{did_you_mean(kind, _TERMS)}"
        )
    possible = [Layout(kind, goals, width) for goals, width in _WIDTHS[kind]]
    for layout in possible:
        if layout.width + actions == inputs:
            return layout
    widths = " or ".join(str(layout.width + actions) for layout in possible)
    raise ConfigError(
        f"the network takes {inputs} terms, RoboRAN's observation of '{kind}' with {actions} last actions has "
        f"{widths}. Give the robot and the task that it was trained for."
    )


def write_observation(
    observation: Tensor, names: Sequence[str], layout: Layout, last_actions: Tensor
) -> Tensor:
    """Add the nodes that compute RoboRAN's observation to a graph.

    Args:
        observation: Our terms, shape (rows, n).
        names: Of our terms, in order.
        layout: What to compute.
        last_actions: Shape (rows, actions).

    Returns:
        Shape (rows, `layout.width` + actions).
    """
    index = {name: column for column, name in enumerate(names)}

    def term(name: str) -> Tensor:
        return observation.columns([index[name]])

    columns = _TERMS[layout.kind](term, layout.goals)
    return observation.graph.concatenate([*columns, last_actions])


def _position(term: Terms, goals: int) -> list[Tensor]:
    return [*_polar(term("goal_x_in_body"), term("goal_y_in_body")), *map(term, MOTION)]


def _pose(term: Terms, goals: int) -> list[Tensor]:
    place = _polar(term("goal_x_in_body"), term("goal_y_in_body"))
    return [*place, term("cos_heading_error"), term("sin_heading_error"), *map(term, MOTION)]


def _velocities(term: Terms, goals: int) -> list[Tensor]:
    """RoboRAN does not ask for lateral velocity: `enable_lateral_velocity` is off, which zeroes that error."""
    ahead = term("velocity_error_x_in_body")
    return [ahead, ahead.graph.constant(0.0) * ahead, term("yaw_rate_error"), *map(term, MOTION)]


def _positions(term: Terms, goals: int) -> list[Tensor]:
    """Every target in the robot's frame: targets without a heading have no frame of their own."""
    columns = [term(name) for name in MOTION]
    for prefix in GOALS[:goals]:
        columns += [term(f"{prefix}distance"), *_bearing(term, prefix)]
    return columns


def _poses(term: Terms, goals: int) -> list[Tensor]:
    """The first target in the robot's frame, each further one in the frame of the target before it."""
    columns = [*map(term, MOTION), term("goal_distance"), *_bearing(term, "goal_"), *_heading(term, "goal_")]
    for before, prefix in itertools.pairwise(GOALS[:goals]):
        x0, y0 = _place(term, before)
        x1, y1 = _place(term, prefix)
        (c0, s0), (c1, s1) = _heading(term, before), _heading(term, prefix)
        dx, dy = x1 - x0, y1 - y0
        columns += [*_polar(c0 * dx + s0 * dy, c0 * dy - s0 * dx), c1 * c0 + s1 * s0, s1 * c0 - c1 * s0]
    return columns


def _polar(x: Tensor, y: Tensor) -> list[Tensor]:
    """Distance, and cosine and sine of the bearing; straight ahead where there is no distance."""
    graph = x.graph
    zero, one = graph.constant(0.0), graph.constant(1.0)
    distance = graph.node("Sqrt", x * x + y * y)
    far = distance > graph.constant(NEAR_M)
    divisor = graph.where(far, distance, one)
    return [distance, graph.where(far, x / divisor, one), graph.where(far, y / divisor, zero)]


def _bearing(term: Terms, prefix: str) -> tuple[Tensor, Tensor]:
    return term(f"{prefix}direction_x_in_body"), term(f"{prefix}direction_y_in_body")


def _heading(term: Terms, prefix: str) -> tuple[Tensor, Tensor]:
    return term(f"{prefix}cos_heading_error"), term(f"{prefix}sin_heading_error")


def _place(term: Terms, prefix: str) -> tuple[Tensor, Tensor]:
    x, y = _bearing(term, prefix)
    distance = term(f"{prefix}distance")
    return x * distance, y * distance


_WIDTHS: dict[str, list[tuple[int, int]]] = {  # numbers of targets that a task can show, each with its terms
    "go_to_position": [(0, 6)],
    "go_to_pose": [(0, 8)],
    "track_velocities": [(0, 6)],
    "go_through_positions": [(2, 9), (3, 12)],
    "race_waypoints": [(2, 9)],
    "go_through_poses": [(2, 13)],
    "race_wayposes": [(2, 13)],
}
_TERMS: dict[str, Callable[[Terms, int], list[Tensor]]] = {
    "go_to_position": _position,
    "go_to_pose": _pose,
    "track_velocities": _velocities,
    "go_through_positions": _positions,
    "race_waypoints": _positions,
    "go_through_poses": _poses,
    "race_wayposes": _poses,
}
