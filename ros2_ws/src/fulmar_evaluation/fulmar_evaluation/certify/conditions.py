"""Conditions of episodes: the axes of a robot's kind at a task, and episodes altered to given values of them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.kinds.envelope_axis import EnvelopeAxis
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.certified_set import Axis
from fulmar_core.safety.declared_conditions import certified_body, declared_conditions
from fulmar_core.states.attitude import Vector, exponential, product, scaled, uniform_direction
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal import Goal
from fulmar_core.worlds.parts import Actuation, Air, Sensing
from fulmar_core.worlds.scenario import Scenario

CONDITIONS = 5  # stream of random numbers, beside those of the core
PLACES = ("distance",)  # axes of tasks whose goal is a place
DOWN = 0.25  # of the height axis: as `start.height` of fly_hold, craft begin at most a quarter as far below
SPARE = 20  # random numbers of an episode: directions and signs


def axes_of(robot: Robot, task: Task) -> tuple[Axis, ...]:
    """The axes of a robot at a task, in their own units.

    Raises:
        ConfigError: Its kind has none, or the task counts targets, which no closing window ends.
    """
    if task.required is not None or task.things or task.structures or task.moves:
        raise ConfigError(
            f"task '{task.name}' has waypoints, obstacles or a moving target, which no axis describes yet. Certify a "
            f"task with one goal, such as {robot.kind.usual_task}."
        )
    found = tuple(_axis(axis, robot) for axis in robot.kind.envelope if _applies(axis, robot, task))
    if not found:
        raise ConfigError(f"no axes of an operating envelope are known for the {robot.kind.plural}.")
    return found


def _applies(axis: EnvelopeAxis, robot: Robot, task: Task) -> bool:
    """Whether an axis means something for a robot at a task."""
    if axis.water is not None and axis.water != (robot.hydrodynamics is not None):
        return False
    if axis.name == "center_of_mass" and robot.uncertainty.center_of_mass == 0.0:
        return False
    if axis.name in PLACES:
        return bool(task.goal_topic in ("goal_pose", "goal_point"))
    return axis.name != "height" or hasattr(getattr(task, "start", None), "training_height")


def _axis(axis: EnvelopeAxis, robot: Robot) -> Axis:
    its = robot.performance
    scales = {"": 1.0, "radius": robot.body.radius}
    scale = scales[axis.of] if axis.of in scales else float(getattr(its, axis.of))
    # An axis that ended before what the robot's own file declares could not hold the robot.
    declared = declared_conditions(robot, certified_body(robot)).get(axis.name, 0.0)
    high = max(scale * axis.high, math.ceil(1e6 * declared) / 1e6)
    return Axis(axis.name, scale * axis.low, round(high, 6), axis.unit)


def scenario_of(axes: tuple[Axis, ...]) -> Scenario:
    """The scenario whose largest values bound every condition: simulators prepare for what may come."""
    high = {axis.name: axis.high for axis in axes}
    return Scenario(
        title="certification",
        sensor_noise=True,
        body="uncertain",
        actuation=Actuation(delay_s=high.get("delay", 0.0)),
        sensing=Sensing(velocity_noise=(0.0, high.get("velocity_noise", 0.0))),
        air=Air(wind=(0.0, high.get("wind", 0.0)), turbulence=high.get("turbulence", 0.0)),
    )


@dataclass(frozen=True)
class Conditions:
    """Conditions of the episodes `first`, `first` + 1 and so on."""

    robot: Robot
    axes: tuple[Axis, ...]
    shares: np.ndarray  # (n, k) in [0, 1]
    first: int
    seed: int
    dead: int = 0  # actuators that do nothing

    def __call__(self, numbers: np.ndarray, start: Any, goal: Goal, world: Any) -> tuple[Any, Goal, Any]:
        """Alter episodes; see `fulmar_core.simulation.episode.Alter`."""
        rows = np.asarray(numbers) - self.first
        values = {
            axis.name: axis.low + (axis.high - axis.low) * self.shares[rows, i]
            for i, axis in enumerate(self.axes)
        }
        drawn = Draws(self.seed, np.asarray(numbers), np.zeros(len(rows), dtype=int), CONDITIONS)
        spare = np.asarray(drawn.uniform(0.0, 1.0, SPARE)).T
        start = _STARTS[type(start)](start, goal, values, spare)
        return start, goal, self._world(world, values, spare)

    def _world(self, world: Any, values: dict[str, np.ndarray], spare: np.ndarray) -> Any:
        """The nominal body and surroundings with what the values say."""
        one = np.ones_like(world.mass)
        changed = {
            "mass": self.robot.body.mass * _either(values.get("mass", one), spare[6]),
            "gain": world.gain * (1.0 - values.get("thrust_loss", 0.0 * one)),
            "action_delay": values.get("delay", 0.0 * one),
            "velocity_noise": values.get("velocity_noise", 0.0 * one),
        }
        if self.dead:
            changed["alive"] = _survivors(len(world.alive), self.dead, spare)
        form = _in_plane if hasattr(world, "yaw_inertia") else _in_space
        return replace(world, **changed, **form(self.robot, world, values, spare))


def _either(factor: np.ndarray, lot: np.ndarray) -> np.ndarray:
    """A factor, or one over it, by a lot in [0, 1]."""
    return np.where(lot < 0.5, factor, 1.0 / factor)


def _sign(lot: np.ndarray) -> np.ndarray:
    return np.where(lot < 0.5, -1.0, 1.0)


def _survivors(count: int, dead: int, spare: np.ndarray) -> np.ndarray:
    """1 for actuators that work, shape (n, worlds); which ones do not hangs on the spare numbers."""
    lots = np.modf(np.outer(1.0 + np.arange(count), 997.0 * spare[19]) + spare[11])[0]
    return (np.argsort(np.argsort(lots, axis=0), axis=0) >= dead).astype(float)


def _in_plane(robot: Robot, world: Any, values: dict[str, np.ndarray], spare: np.ndarray) -> dict[str, Any]:
    """What only worlds in the plane have."""
    zero, bearing, side = 0.0 * world.mass, 2.0 * math.pi * spare[3], 2.0 * math.pi * spare[4]
    force, offset = values.get("force", zero), values.get("center_of_mass", zero)
    return {
        "yaw_inertia": robot.body.inertia[2] * _either(values.get("inertia", 1.0 + zero), spare[7]),
        "drag": _either(values.get("drag", 1.0 + zero), spare[8]),
        "com_x": robot.body.center_of_mass[0] + offset * np.cos(side),
        "com_y": robot.body.center_of_mass[1] + offset * np.sin(side),
        "force_x": force * np.cos(bearing),
        "force_y": force * np.sin(bearing),
        "torque": values.get("torque", zero) * _sign(spare[5]),
    }


def _in_space(robot: Robot, world: Any, values: dict[str, np.ndarray], spare: np.ndarray) -> dict[str, Any]:
    """What only worlds in space have, and the air around aircraft."""
    zero = 0.0 * world.mass
    offset = values.get("center_of_mass", zero)
    growth = _either(values.get("inertia", 1.0 + zero), spare[7])
    aside, towards = _direction(spare[3], spare[4]), _direction(spare[5], spare[8])
    about, force = _direction(spare[9], spare[10]), values.get("force", zero)
    found = {
        "inertia": np.stack([growth * entry for entry in robot.body.tensor]),
        "com": np.stack([own + offset * part for own, part in zip(robot.body.com, aside, strict=True)]),
        "force": np.stack([force * part for part in towards]),
        "torque": np.stack([values.get("torque", zero) * part for part in about]),
    }
    if hasattr(world, "turbulence"):
        bearing, speed = 2.0 * math.pi * spare[3], values.get("wind", zero)
        found["wind"] = np.stack([speed * np.cos(bearing), speed * np.sin(bearing), zero])
        found["turbulence"] = values.get("turbulence", zero)
    return found


def _direction(first: np.ndarray, second: np.ndarray) -> Vector:
    """A unit vector, uniform over the sphere by two numbers in [0, 1]."""
    return uniform_direction(first, second)


def _planar_start(
    start: PlanarState, goal: Goal, values: dict[str, np.ndarray], spare: np.ndarray
) -> PlanarState:
    """As far from the goal as asked for, in the direction that the task drew; under way in any direction."""
    x, y = start.x, start.y
    if "distance" in values:
        x, y = _from((x, y), goal.current, values["distance"])
    speed, bearing = values.get("speed", 0.0 * x), 2.0 * math.pi * spare[12]
    turning = values.get("turn_rate", 0.0 * x) * _sign(spare[13])
    return replace(
        start, x=x, y=y, vx=speed * np.cos(bearing), vy=speed * np.sin(bearing), yaw_rate=turning
    )  # fmt: skip


def _spatial_start(
    start: SpatialState, goal: Goal, values: dict[str, np.ndarray], spare: np.ndarray
) -> SpatialState:
    """As in the plane; in the air about level flight, and of satellites turned away from the goal."""
    parts: dict[str, Any] = {}
    if "distance" in values:
        parts |= dict(zip("xyz", _from(start.position, goal.current, values["distance"]), strict=True))
    if "height" in values:
        parts["z"] = goal.current[:, 2] + values["height"] * np.where(spare[16] < 0.5, 1.0, -DOWN)
    if "speed" in values:
        along = _direction(spare[12], spare[13])
        parts |= {f"v{axis}": values["speed"] * part for axis, part in zip("xyz", along, strict=True)}
    if "turn_rate" in values:
        about = _direction(spare[14], spare[15])
        parts |= {f"w{axis}": values["turn_rate"] * part for axis, part in zip("xyz", about, strict=True)}
    for name, of in (("tilt", start.quat), ("angle", tuple(goal.current[:, 3 + i] for i in range(4)))):
        if name in values:
            away = exponential(scaled(math.pi / 180.0 * values[name], _direction(spare[17], spare[18])))
            parts |= dict(zip(("qx", "qy", "qz", "qw"), product(of, away), strict=True))
    return replace(start, **parts)


_STARTS: dict[type, Callable[..., Any]] = {PlanarState: _planar_start, SpatialState: _spatial_start}


def _from(place: tuple[np.ndarray, ...], target: np.ndarray, distance: np.ndarray) -> list[np.ndarray]:
    """A place as far from a target as asked for, in the direction of another one [m]."""
    way = [part - target[:, i] for i, part in enumerate(place)]
    length = np.maximum(np.sqrt(sum(part * part for part in way)), 1e-9)
    return [target[:, i] + distance * part / length for i, part in enumerate(way)]
