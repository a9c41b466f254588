"""A user's own task, loaded by its dotted path: `mypackage.mymodule:MyTask`.

It is made as `MyTask()`, or as `MyTask(settings)` where its constructor takes `settings`: the mapping in the YAML file
of the same name beside its module (`mymodule.yaml`), empty without such a file. It has the members of `Task`; what it
leaves out is as there.
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_core.config.errors import ConfigError, TaskError, did_you_mean
from fulmar_core.config.own_class import construct, load_class, one_line, settings_beside, source_of
from fulmar_core.dynamics.things import Thing
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.topics import GOAL_WIRES
from fulmar_core.states.arrays import array_namespace
from fulmar_core.states.counter_rng import START, Draws
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.rotation import Array
from fulmar_core.states.spatial import SpatialState
from fulmar_core.states.state import POSE, TWIST, State
from fulmar_core.tasks.goal import Goal
from fulmar_core.tasks.task import Task
from fulmar_core.tasks.terms import Errors, Tolerance

METHODS = ("draw", "observe", "reward", "errors")
ATTRIBUTES = ("episode_s", "tolerance", "goal_topic", "observation_names")
SHIPPED_ONLY = ("step_s", "evaluated", "fitted", "surveyed")  # members that own tasks cannot have
ROLE = "task"  # in messages
TRIED = 3  # episodes that `check` draws


def load_own_task(path: str) -> OwnTask:
    """Load a user's class and make a task of it.

    Args:
        path: Dotted path of the class.

    Raises:
        ConfigError: The class cannot be loaded, lacks a member, has one that cannot be, or its constructor raises.
    """
    cls = load_class(path, members=METHODS, what=ROLE)
    try:
        takes_settings = "settings" in inspect.signature(cls).parameters
    except (TypeError, ValueError):  # a class without a readable signature
        takes_settings = False
    call = f"{cls.__name__}({'settings' if takes_settings else ''})"
    own = construct(cls, call, ROLE, *([settings_beside(cls)] if takes_settings else []))
    lacking = [name for name in ATTRIBUTES if getattr(own, name, None) is None]
    if lacking:
        raise ConfigError(
            f"{ROLE} '{path}': lacks {', '.join(lacking)}. A task needs: {', '.join(ATTRIBUTES)}."
        )
    for name in SHIPPED_ONLY:
        if getattr(cls, name, None) is not getattr(Task, name) and hasattr(cls, name):
            raise ConfigError(
                f"{ROLE} '{path}': has '{name}', which only shipped tasks can have. Leave it out."
            )
    names, required = own.observation_names, getattr(own, "required", None)
    things = getattr(own, "things", ())
    for right, name, must in (
        (
            _is_number(own.episode_s) and own.episode_s > 0.0,
            "episode_s",
            "a number of seconds, greater than 0",
        ),
        (
            getattr(own, "state_type", PlanarState) in (PlanarState, SpatialState),
            "state_type",
            "fulmar_core.states.planar.PlanarState or fulmar_core.states.spatial.SpatialState",
        ),
        (_are_things(things), "things", "a tuple of fulmar_core.dynamics.things.Thing, no name twice"),
        (isinstance(own.tolerance, Tolerance), "tolerance", "a fulmar_core.tasks.terms.Tolerance"),
        (_are_names(names), "observation_names", "a tuple of names, none of them twice"),
        (
            required is None or (_is_number(required) and required >= 1),
            "required",
            "None or a number from 1 on",
        ),
        (
            own.goal_topic in GOAL_WIRES,
            "goal_topic",
            f"a topic of goals.{did_you_mean(str(own.goal_topic), GOAL_WIRES)}",
        ),
    ):
        if not right:
            raise ConfigError(f"{ROLE} '{path}': {name} = {getattr(own, name)!r} must be {must.rstrip('.')}.")
    return OwnTask(
        kind=path,
        name=path,
        title=str(getattr(own, "title", cls.__name__)),
        episode_s=float(own.episode_s),
        tolerance=own.tolerance,
        goal_topic=own.goal_topic,
        observation_names=tuple(names),
        own=own,
        required=None if required is None else int(required),
        sees_obstacles=bool(getattr(own, "sees_obstacles", False)),
        things=tuple(things),
        state_type=getattr(own, "state_type", PlanarState),
    )


@dataclass(frozen=True)
class OwnTask(Task[Any]):
    """A user's object behind the interface of tasks: whatever it does wrong becomes one line.

    Attributes:
        own: The user's object.
    """

    kind: str
    name: str
    title: str
    episode_s: float
    tolerance: Tolerance
    goal_topic: str
    observation_names: tuple[str, ...]
    own: Any
    required: int | None = None
    sees_obstacles: bool = False
    things: tuple[Thing, ...] = ()
    state_type: type[State] = PlanarState

    @property
    def source(self) -> Path:
        """The file that the user's class is in."""
        return source_of(type(self.own))

    def check(self, robot: Robot) -> None:
        """Call every member once on drawn episodes, many at once and one alone; see `Task.check`."""
        super().check(robot)
        draws = Draws(0, np.arange(TRIED), np.zeros(TRIED, dtype=int), START)
        starts, goals = self.draw(draws, robot, training=False)
        for state, drawn in ((starts, goals), (starts[0], goals[0])):
            goal = self.begun(drawn, state)
            self.observe(state, goal)
            self.errors(state, goal)
            self.collides(state, goal, robot)
            self.distance_from_goal(state, goal)
            ended = self.advance(goal, state, np.asarray(0.0))
            self.counted(goal, state, np.asarray(0.0))
            self.reward(state, state, goal, ended)
            self.penalty(state, goal, robot)

    def draw(self, draws: Draws, robot: Robot, *, training: bool) -> tuple[State, Goal]:
        """See `Task.draw`."""
        found = self._ask("draw", draws, robot, training=training)
        form = self.state_type
        if not (isinstance(found, tuple) and [type(part) for part in found] == [form, Goal]):
            what = _kind(found)
            if isinstance(found, tuple) and [type(part) for part in found] in (
                [PlanarState, Goal],
                [SpatialState, Goal],
            ):
                what = f"{_kind(found[0])}; a task in {found[0].WORLD} says state_type = {type(found[0]).__name__}"
            raise self._wrong("draw", f"returned {what}, it must be a {form.__name__} and a Goal")
        state, goal = found
        for name in form.COLUMNS:
            value = getattr(state, name)
            if np.shape(value) != (draws.worlds,):
                raise self._wrong(
                    "draw", f"returned {name} of shape {np.shape(value)}, it must be ({draws.worlds},)"
                )
            self._numbers("draw", value, state, name)
        return state, self._goal("draw", goal, state)

    def observe(self, state: State, goal: Goal) -> tuple[Array, ...]:
        """See `Task.observe`."""
        terms, names = self._ask("observe", state, goal), self.observation_names
        if not isinstance(terms, tuple | list):
            raise self._wrong("observe", f"returned {_kind(terms)}, it must be a tuple of terms")
        if len(terms) != len(names):
            raise self._wrong("observe", f"returned {len(terms)} terms, observation_names has {len(names)}")
        return tuple(
            self._numbers("observe", term, state, f"'{name}'")
            for term, name in zip(terms, names, strict=True)
        )

    def reward(self, before: State, after: State, goal: Goal, ended: Goal) -> Array:
        """See `Task.reward`."""
        return self._numbers("reward", self._ask("reward", before, after, goal, ended), after, "the reward")

    def errors(self, state: State, goal: Goal) -> Errors:
        """See `Task.errors`; of every quantity that the tolerance limits, and of both velocities or of none."""
        found = self._ask("errors", state, goal)
        if not isinstance(found, Errors):
            raise self._wrong(
                "errors", f"returned {_kind(found)}, it must be a fulmar_core.tasks.terms.Errors"
            )
        values = {each.name: getattr(found, each.name) for each in fields(Errors)}
        limits = self.tolerance
        asked = {
            "position": limits.position,
            "heading": limits.heading_deg,
            "velocity": limits.velocity or found.yaw_rate is not None,
            "yaw_rate": limits.yaw_rate_deg or found.velocity is not None,
            "attitude": limits.attitude_deg,
            "rate": limits.rate_deg,
        }
        for name, value in values.items():
            if value is None and asked[name]:
                raise self._wrong(
                    "errors", f"returned no {name}, which the tolerance or the other velocity needs"
                )
        return Errors(
            **{
                name: None if value is None else self._numbers("errors", value, state, name)
                for name, value in values.items()
            }
        )

    def begun(self, goal: Goal, state: State) -> Goal:
        """See `Task.begun`."""
        return self._goal("begun", self._ask("begun", goal, state), state) if self._has("begun") else goal

    def advance(self, goal: Goal, state: State, time_s: Array) -> Goal:
        """See `Task.advance`."""
        if not self._has("advance"):
            return goal
        return self._goal("advance", self._ask("advance", goal, state, time_s), state)

    def counted(self, goal: Goal, state: State, time_s: Array) -> Goal:
        """See `Task.counted`."""
        if not self._has("counted"):
            return self.advance(goal, state, time_s)
        return self._goal("counted", self._ask("counted", goal, state, time_s), state)

    def collides(self, state: State, goal: Goal, robot: Robot) -> Array | None:
        """See `Task.collides`."""
        found = self._maybe("collides", state, goal, robot)
        return None if found is None else found != 0

    def penalty(self, state: State, goal: Goal, robot: Robot) -> Array | None:
        """See `Task.penalty`."""
        return self._maybe("penalty", state, goal, robot)

    def distance_from_goal(self, state: State, goal: Goal) -> Array | None:
        """See `Task.distance_from_goal`."""
        if not self._has("distance_from_goal"):
            return super().distance_from_goal(state, goal)
        return self._maybe("distance_from_goal", state, goal)

    def _has(self, member: str) -> bool:
        return getattr(self.own, member, None) is not None

    def _ask(self, member: str, *arguments: Any, **named: Any) -> Any:
        try:
            return getattr(self.own, member)(*arguments, **named)
        except (Exception, SystemExit) as error:
            raise self._wrong(member, f"raised {one_line(error, type(self.own).__module__)}") from error

    def _maybe(self, member: str, state: State, *more: Any) -> Array | None:
        """Numbers of a member that may be missing, or return None."""
        found = self._ask(member, state, *more) if self._has(member) else None
        return None if found is None else self._numbers(member, found, state, "the result")

    def _numbers(self, member: str, value: Any, state: Any, what: str) -> Array:
        """A result as finite numbers in the shape of the state that it is for."""
        xp, shape = array_namespace(state.x), tuple(state.x.shape)
        try:
            numbers = xp.broadcast_to(xp.asarray(value), shape)
            finite = bool(xp.all(xp.isfinite(numbers)))
        except (TypeError, ValueError, RuntimeError):
            found = f"shape {np.shape(value)}" if hasattr(value, "shape") else _kind(value)
            raise self._wrong(
                member, f"returned {what} of {found}, it must be numbers of shape {shape}"
            ) from None
        if not finite:
            raise self._wrong(member, f"returned {what} that is not finite")
        return numbers

    def _goal(self, member: str, found: Any, state: Any) -> Goal:
        if not isinstance(found, Goal):
            raise self._wrong(member, f"returned {_kind(found)}, it must be a Goal")
        lead = tuple(np.shape(state.x))
        if not isinstance(found.things, Mapping):
            raise self._wrong(
                member, f"returned a Goal whose things are {_kind(found.things)}, not a mapping"
            )
        for thing in self.things:
            if thing.name not in found.things:
                raise self._wrong(member, f"returned a Goal without the pose of {thing.name} in its things")
        rigid = TWIST if self.goal_topic == "goal_velocity" else POSE
        pose, target = (self.state_type.targets_of(np.ones(size)).size for size in (POSE, rigid))
        for name, value, tail in (
            ("targets", found.targets, (None, target)),
            ("done", found.done, ()),
            ("obstacles", found.obstacles, (None, None)),
            *((f"things['{name}']", where, (pose,)) for name, where in found.things.items()),
        ):
            shape, must = tuple(np.shape(value)), (*lead, *tail)
            if len(shape) != len(must) or any(
                want not in (None, size) for size, want in zip(shape, must, strict=True)
            ):
                wanted = ", ".join("any" if size is None else str(size) for size in must)
                raise self._wrong(
                    member, f"returned a Goal with {name} of shape {shape}, it must be ({wanted})"
                )
            if not array_namespace(value).isfinite(value).all():
                raise self._wrong(member, f"returned a Goal with {name} that are not finite")
        return found

    def _wrong(self, member: str, what: str) -> TaskError:
        return TaskError(f"{ROLE} '{self.name}': {member} {what.rstrip('.')}.")


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and bool(np.isfinite(value))


def _are_names(value: Any) -> bool:
    if not isinstance(value, tuple | list) or not value:
        return False
    return all(isinstance(name, str) and name for name in value) and len(set(value)) == len(value)


def _are_things(value: Any) -> bool:
    if not isinstance(value, tuple | list) or not all(isinstance(thing, Thing) for thing in value):
        return False
    return len({thing.name for thing in value}) == len(value)


def _kind(value: Any) -> str:
    return f"a {type(value).__name__}"
