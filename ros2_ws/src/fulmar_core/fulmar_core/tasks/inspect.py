"""Fly along a path about a thing in space, with the camera on it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, Self

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace
from fulmar_core.states.attitude import (
    cross,
    dot,
    exponential,
    length,
    normalised,
    product,
    scaled,
    turn,
    uniform_direction,
)
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.rotation import Array
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks.goal import Goal
from fulmar_core.tasks.goal_words import number
from fulmar_core.tasks.moving_pose import MovingPose
from fulmar_core.tasks.references.named_paths import named_path
from fulmar_core.tasks.references.planned_flight import (
    LOOKS_AHEAD,
    Flight,
    Pace,
    Quat,
    planned_flight,
    poses_along,
)


@dataclass(frozen=True)
class OnPath:
    """Where episodes begin: at rest on the path, in training so far off it and turned by so much."""

    training_distance: float = 0.0  # at most [m]
    training_angle_deg: float = 0.0  # at most [deg]

    def __post_init__(self) -> None:
        if min(self.training_distance, self.training_angle_deg) < 0.0:
            raise ValueError("'training_distance' and 'training_angle_deg' must not be negative.")


@dataclass(frozen=True, kw_only=True)
class Inspect(MovingPose):
    """Follow one whole round of a path about a thing at the origin, with the camera's axis on its middle.

    The body turns about that axis nowhere. Closed paths begin anywhere on them, as the seed draws it. In training
    every path of `training_paths` is drawn alike; many end within an episode.
    """

    kind: Literal["inspect"]
    path: str  # one of `named_paths.NAMED`
    training_paths: tuple[str, ...] = ()  # empty: `path` alone
    radius: float  # nearest place of a path, in halves of the thing's largest side [-]
    pace: Pace
    start: OnPath = OnPath()

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.thing:
            raise ValueError("'thing' must name what is looked at: one of `fulmar list things`.")
        if self.radius <= 0.0:
            raise ValueError("'radius' must be greater than 0.")
        for path in (self.path, *self.training_paths):
            named_path(path, 1.0)

    def along(self, path: str) -> Self:
        """See `Task.along`."""
        return replace(self, path=path, training_paths=())

    def farthest_start(self, *, training: bool) -> tuple[str, float]:
        """See `Task.farthest_start`."""
        return ("start.training_distance", self.start.training_distance) if training else ("", 0.0)

    def said(self, goal: Goal) -> str:
        """See `Task.said`."""
        return f"the {self.path} about '{self.thing}', {number(self.spacing_s * (len(goal.targets) - 1))} s"

    def flight(self, robot: Robot, path: str = "") -> Flight:
        """What a robot flies; `path`: another one than the task's."""
        middle = self.structures[0]
        return planned_flight(
            path or self.path, self.radius * middle.half_size, self.pace,
            facing="point", looks=looks_of(robot), can=robot.performance,
        )  # fmt: skip

    def episode_of(self, robot: Robot) -> float:
        """See `Task.episode_of`: one whole round."""
        step = robot.timing.control_s
        return step * math.ceil(self.flight(robot).duration_s / step)

    def check(self, robot: Robot) -> None:
        """See `Task.check`, and `Flight.check`.

        Raises:
            ConfigError: As these, or the thing has no part, so that there is nothing to see.
        """
        super().check(robot)
        if not self.structures[0].parts:
            raise ConfigError(f"the thing '{self.thing}' has no part: there is no surface to inspect.")
        self.flight(robot).check(robot, self.keep_outs, f"the {self.path} about '{self.thing}'")

    def draw(self, draws: Draws, robot: Robot, *, training: bool) -> tuple[SpatialState, Goal]:
        """Draw a start on the path, and the path from there on."""
        numbers = draws.uniform(0.0, 1.0, 6)
        unit = np.asarray(numbers)
        paths = (training and self.training_paths) or (self.path,)
        flights = [self.flight(robot, path) for path in paths]
        over_s = self.episode_s + 1.0 if training else flights[0].duration_s
        times = self.spacing_s * np.arange(1 + math.ceil(over_s / self.spacing_s))
        which = np.minimum((unit[:, 0] * len(paths)).astype(int), len(paths) - 1)
        targets = poses_along(flights, which, unit[:, 1], times)
        xp = array_namespace(numbers)
        goal = self.goal_through(xp.asarray(targets), xp.zeros_like(numbers[:, 0]))
        return self._start(numbers, goal.targets[:, 0], training=training), goal

    def _start(self, numbers: Array, first: Array, *, training: bool) -> SpatialState:
        """At rest at the first pose, or off it in training."""
        aside = uniform_direction(numbers[:, 2], numbers[:, 3])
        far = (self.start.training_distance if training else 0.0) * numbers[:, 4]
        angle = (math.radians(self.start.training_angle_deg) if training else 0.0) * numbers[:, 5]
        x, y, z, *quat = (first[:, i] for i in range(7))
        a, b, c = scaled(far, aside)
        turned = exponential(scaled(angle, (aside[1], aside[2], aside[0])))
        return SpatialState.at_rest((x + a, y + b, z + c), product(normalised((*quat,)), turned))

    def pointing_error(self, state: SpatialState, robot: Robot) -> Array:
        """See `Task.pointing_error`: the thing's middle is the origin."""
        axis = turn(state.quat, turn(looks_of(robot), (1.0, 0.0, 0.0)))
        way = scaled(-1.0, state.position)
        xp = array_namespace(state.x)
        return xp.atan2(length(cross(axis, way)), dot(axis, way))


def looks_of(robot: Robot) -> Quat:
    """Attitude of the robot's camera in its body, x along its axis; without one it looks along the body's x."""
    camera = getattr(robot.sensors, "camera", None)
    return LOOKS_AHEAD if camera is None else camera.quat_xyzw
