"""Entities, filters and features of ROS's simulation_interfaces, from and to what a simulated plant knows."""

from __future__ import annotations

import importlib
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.states.rotation import rotate_inverse, turned
from fulmar_core.states.state import RigidBodyState
from fulmar_core.wires.origin import in_odom
from fulmar_core.wires.robot_name import Frames
from fulmar_ros.action_messages import MAP
from fulmar_ros.convert import stamp_of

WORLD = ("", "world")  # names of the frame that the standard has where none is given: here it is `odom`
SPHERE = 2  # points of a sphere: its centre, and its radius as x of the second one
ROBOT, THING = "CATEGORY_ROBOT", "CATEGORY_DYNAMIC_OBJECT"
FEATURES = (
    "ENTITY_CATEGORIES",
    "ENTITY_STATE_GETTING",
    "SIMULATION_RESET",
    "SIMULATION_RESET_STATE",
    "SIMULATION_STATE_GETTING",
    "SIMULATION_STATE_SETTING",
    "SIMULATION_STATE_PAUSE",
    "STEP_SIMULATION_SINGLE",
    "STEP_SIMULATION_MULTIPLE",
    "STEP_SIMULATION_ACTION",
)
SETTING = "ENTITY_STATE_SETTING"  # of simulators that can put the body elsewhere
REST = np.zeros(3)


def interface(kind: str, name: str) -> Any:
    """A class of simulation_interfaces.

    Args:
        kind: `msg`, `srv` or `action`.
        name: Of the type.

    Raises:
        ConfigError: simulation_interfaces is not installed.
    """
    try:
        return getattr(importlib.import_module(f"simulation_interfaces.{kind}"), name)
    except (ModuleNotFoundError, AttributeError) as error:
        raise ConfigError(
            "services for simulations need the messages of simulation_interfaces, which are not installed. "
            "Run: fulmar install-interfaces"
        ) from error


@dataclass(frozen=True)
class Outcome:
    """How a request ends."""

    name: str = "OK"  # of a constant `RESULT_...`
    words: str = ""
    code: int | None = None  # of the service's own, in the place of the constant

    @property
    def good(self) -> bool:
        """Whether it was done."""
        return self.name == "OK" and self.code is None

    def message(self) -> Any:
        """As a message."""
        kind = interface("msg", "Result")
        number = getattr(kind, f"RESULT_{self.name}") if self.code is None else self.code
        return kind(result=number, error_message=self.words)


DONE = Outcome()


def unsupported(words: str) -> Outcome:
    """Of what this simulator does not do."""
    return Outcome("FEATURE_UNSUPPORTED", words)


def failed(words: str) -> Outcome:
    """Of what it does, but not now or not so."""
    return Outcome("OPERATION_FAILED", words)


@dataclass(frozen=True)
class Entity:
    """A body of the simulation: its true motion in the frame `odom`, and when that was."""

    category: str
    state: RigidBodyState
    stamp_ns: int

    def message(self, frames: Frames) -> Any:
        """As a message; linear and angular velocity are along the axes of `odom`, accelerations stay 0."""
        message = interface("msg", "EntityState")()
        message.header.frame_id, message.header.stamp = frames.odom, stamp_of(self.stamp_ns)
        state, pose, twist = self.state, message.pose, message.twist
        place, quat = state.position_in_world.tolist(), state.quat_xyzw.tolist()
        rate = turned(quat, state.angular_velocity_in_body.tolist())
        pose.position.x, pose.position.y, pose.position.z = place
        q = pose.orientation
        q.x, q.y, q.z, q.w = quat
        twist.linear.x, twist.linear.y, twist.linear.z = state.velocity_in_world.tolist()
        twist.angular.x, twist.angular.y, twist.angular.z = (float(part) for part in rate)
        return message


def still_at(pose: np.ndarray, category: str, stamp_ns: int) -> Entity:
    """An entity of which only the pose is known, shape (7,)."""
    return Entity(category, RigidBodyState(pose[:3], pose[3:], REST, REST), stamp_ns)


def asked_state(
    request: Any, now: RigidBodyState, frames: Frames, origin: np.ndarray | None
) -> RigidBodyState:
    """The state that `SetEntityState` asks for, in the frame `odom`.

    Args:
        request: Of the service. Later versions of it say which parts count; the others stay as they are.
        now: The state that the entity has.
        frames: Of the robot.
        origin: Pose of `odom` in `map`, shape (7,); None: not known.

    Raises:
        ConfigError: The frame is none that the simulation knows.
    """
    message, state = request.state, now
    p, q = message.pose.position, message.pose.orientation
    pose = np.array([p.x, p.y, p.z, q.x, q.y, q.z, q.w], dtype=float)
    linear, angular = (
        np.array([each.x, each.y, each.z]) for each in (message.twist.linear, message.twist.angular)
    )
    frame = message.header.frame_id
    if frame == MAP and origin is not None:
        pose = in_odom(pose, origin)
        linear, angular = rotate_inverse(origin[3:], linear), rotate_inverse(origin[3:], angular)
    elif frame not in WORLD and frames.plain(frame) != "odom":
        known = ["world", frames.odom, *([MAP] if origin is not None else [])]
        raise ConfigError(f"frame is '{frame}', must be one of {', '.join(known)}, or empty for the world.")
    if getattr(request, "set_pose", True):
        state = replace(state, position_in_world=pose[:3], quat_xyzw=pose[3:])
    if getattr(request, "set_twist", True):
        body = rotate_inverse(state.quat_xyzw, angular)
        state = replace(state, velocity_in_world=linear, angular_velocity_in_body=body)
    return state


def matching(filters: Any, entities: Mapping[str, Entity]) -> tuple[tuple[str, ...], Outcome]:
    """Names of the entities that a filter lets pass, and how the request ends."""
    if filters.tags.tags:
        return (), unsupported("entities have no tags: leave the filter 'tags' empty.")
    bounds = filters.bounds
    if bounds.type not in (bounds.TYPE_EMPTY, bounds.TYPE_SPHERE):
        return (), unsupported("entities are found within a sphere alone: TYPE_SPHERE.")
    if bounds.type == bounds.TYPE_SPHERE and len(bounds.points) != SPHERE:
        return (), failed("a sphere has two points: its centre, and its radius as 'x' of the second one.")
    try:
        pattern = re.compile(filters.filter)
    except re.error as error:
        return (), failed(f"'{filters.filter}' is no regular expression: {error}.")
    kinds = {each.category for each in filters.categories}
    return tuple(_passing(pattern, kinds, bounds, entities)), DONE


def _passing(
    pattern: re.Pattern[str], kinds: set[int], bounds: Any, entities: Mapping[str, Entity]
) -> Iterable[str]:
    kind = interface("msg", "EntityCategory")
    for name, entity in entities.items():
        far = False
        if bounds.type == bounds.TYPE_SPHERE:
            centre, size = bounds.points
            away = entity.state.position_in_world - np.array([centre.x, centre.y, centre.z])
            far = float(np.linalg.norm(away)) > size.x
        if pattern.search(name) and (not kinds or getattr(kind, entity.category) in kinds) and not far:
            yield name


def features_message(*, places: bool) -> Any:
    """What the simulator can do; `places`: whether it can put the body elsewhere."""
    message = interface("msg", "SimulatorFeatures")()
    names = (*FEATURES, *((SETTING,) if places else ()))
    message.features = sorted(getattr(message, name) for name in names)
    message.custom_info = (
        "Fulmar: a step is a control step; a reset keeps the simulated time, which never goes back."
    )
    return message
