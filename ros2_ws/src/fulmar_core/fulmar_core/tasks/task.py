"""The interface of tasks, for learners, evaluations and the robot."""

from __future__ import annotations

import functools
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, Self

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names
from fulmar_core.dynamics.things import Thing
from fulmar_core.robots.kinds import GOING
from fulmar_core.robots.kinds.kind import Kind
from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import side_by_side
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.rotation import Array
from fulmar_core.states.state import S, State
from fulmar_core.tasks.goal import Goal, goal_at
from fulmar_core.tasks.goal_words import counted, goal_words
from fulmar_core.tasks.terms import Errors, Tolerance
from fulmar_core.worlds.structures import KeepOut, Structure, load_structure


class Task(ABC, Generic[S]):
    """Observation, reward, errors and tolerance of one task; free of side effects.

    Every array has the leading shape of the state that it goes with.

    Attributes:
        kind: Which class of task this is.
        name: As `load_task` takes it.
        title: The task in a few words.
        episode_s: Length of an episode [s].
        tolerance: What counts as success.
        required: Targets that make an episode a success; None where a closing window does.
        state_type: Form of the states that its methods take.
        thing: Of `configs/things`, in its world; empty: none.
        moves: Whether its target moves by the clock; its goals have more of it than `Goal.current`, see `moving_pose`.
        keeps_thing: Whether it is for its own thing alone.
        observes_numbers: Whether `observe` answers the state of one robot in plain numbers by plain numbers.
    """

    kind: str
    name: str
    title: str
    episode_s: float
    tolerance: Tolerance
    required: int | None = None
    state_type: type[State] = PlanarState
    thing: str = ""
    moves: bool = False
    keeps_thing: bool = False
    observes_numbers: bool = False

    # A class, a property or a field has these two: dataclasses would take a property of this class for a default.
    if TYPE_CHECKING:

        @property
        def goal_topic(self) -> str:
            """One of `fulmar_core.robots.topics.GOAL_WIRES`."""

        @property
        def observation_names(self) -> tuple[str, ...]:
            """Of the terms of `observe`, in their order."""

    @property
    def kinds(self) -> tuple[Kind, ...]:
        """Of robots that it is for."""
        return GOING[self.state_type]

    @property
    def sees_obstacles(self) -> bool:
        """Whether a controller needs the obstacles."""
        return False

    @property
    def things(self) -> tuple[Thing, ...]:
        """What stands or moves in its world: every goal has the pose of each in `Goal.things`."""
        return ()

    @property
    def structures(self) -> tuple[Structure, ...]:
        """Things in space that stand in its world."""
        return ()

    @property
    def keep_outs(self) -> tuple[KeepOut, ...]:
        """Volumes about them that a robot stays out of: to enter one is a failure."""
        return tuple(structure.keep_out for structure in self.structures)

    @property
    def subject(self) -> str:
        """Name of what has to get to the goal: a thing that is pushed, or the robot."""
        return next((thing.name for thing in self.things if thing.body is not None), "robot")

    def farthest_start(self, *, training: bool) -> tuple[str, float]:
        """Key in its file and largest distance of a start from the first target; 0 where nothing limits it [m]."""
        start, name = getattr(self, "start", None), "training_distance" if training else "distance"
        return ("", 0.0) if start is None else (f"start.{name}", getattr(start, name)[1])

    @property
    def step_s(self) -> float | None:
        """Time from one target to the next, where each is published at its time; None: all at once [s]."""
        return None

    @property
    def evaluated(self) -> Task:
        """The task with the errors that evaluations use."""
        return self

    def check(self, robot: Robot) -> None:
        """Refuse a task that does not work with a robot, before anything moves.

        Raises:
            ConfigError: The task is for other kinds of robots.
            TaskError: A member of a user's own task raises, or returns what no task returns.
        """
        self.check_kind(robot)

    def check_running(self, robot: Robot) -> None:
        """The part of `check` that does not ask where episodes begin: a run may have begun elsewhere."""
        self.check(robot)

    def check_kind(self, robot: Robot) -> None:
        """The quick part of `check`, which looks at the robot's kind alone."""
        same = self.name.removesuffix(self.state_type.SUFFIX) + robot.state_type.SUFFIX
        meant = f"Did you mean '{same}'? " if same != self.name and same in config_names("tasks") else ""
        others = f"{meant}`fulmar list tasks` shows others, such as {robot.kind.usual_task}."
        robot.check_kind(f"task '{self.name}'", self.kinds, others)

    def goal_of(self, targets: Array) -> Goal:
        """The goal of one robot from targets that were received.

        Args:
            targets: Poses in the world, shape (k, 7), or twists in the body's frame, shape (k, 6).
        """
        return goal_at(*self.state_type.targets_of(targets))

    def target_of(self, goal: Goal) -> Array:
        """The target that counts now, shape (..., 3), in space (..., 7 or 6)."""
        return goal.current

    def said(self, goal: Goal) -> str:
        """A goal of one robot in words, as the line before a run says it."""
        faces = self.tolerance.heading_deg + self.tolerance.attitude_deg > 0.0
        words = goal_words(self.goal_topic, self.state_type, goal.targets, faces=faces)
        subject = "" if self.subject == "robot" else f"the {self.subject} at "
        count = int((goal.obstacles[..., 2] > 0.0).sum()) if goal.obstacles.size else 0
        around = f", around {counted(count, 'obstacle')}" if count else ""
        return f"{subject}{words}{around}"

    def at_height(self, height: float) -> Self:
        """The task at another height above the ground, of a craft that flies [m].

        Raises:
            ConfigError: It has none of its own.
        """
        raise ConfigError(f"task '{self.name}' has no height to choose. Leave --height out.")

    def along(self, path: str) -> Self:
        """The task along another path, by a name of `named_paths.NAMED`.

        Raises:
            ConfigError: It follows none, or there is no such path.
        """
        raise ConfigError(f"task '{self.name}' has no path to choose. Leave --path out.")

    def episode_of(self, robot: Robot) -> float:
        """Length of an episode of a robot, where it depends on the robot [s]."""
        return self.episode_s

    def pointing_error(self, state: S, robot: Robot) -> Array | None:
        """Angle between the camera's axis and the way to what it looks at, shape (...,) [rad]; None: at nothing."""
        return None

    def fitted(self, robot: Robot) -> Self:
        """The task for a robot: how near it has to come may depend on how well it knows its place."""
        return self

    def surveyed(self, goal: Goal, robot: Robot) -> Goal:
        """A batch of goals, as NumPy, with what the task computes once of the obstacles."""
        return goal

    @abstractmethod
    def draw(self, draws: Draws, robot: Robot, *, training: bool) -> tuple[S, Goal]:
        """Draw starts and goals, as NumPy float64, leading shape (worlds,)."""

    @abstractmethod
    def observe(self, state: S, goal: Goal) -> tuple[Array, ...]:
        """Terms in the order of `observation_names`, each of shape (...,)."""

    @abstractmethod
    def reward(self, before: S, after: S, goal: Goal, ended: Goal) -> Array:
        """Reward of one control step, shape (...,); actuators cost extra.

        Args:
            before: True state when it began.
            after: True state when it ended.
            goal: That it began with.
            ended: The goal after it: targets may be done, things may have moved.
        """

    @abstractmethod
    def errors(self, state: S, goal: Goal) -> Errors:
        """How far a state is from the current target."""

    def begun(self, goal: Goal, state: S) -> Goal:
        """A goal that was received, for a robot that is somewhere, before its first step.

        Not called for a target that moves and goes on from the goal before.
        """
        return goal

    def advance(self, goal: Goal, state: S, time_s: Array) -> Goal:
        """The goal after a measurement: targets may be done, or their time may be over. By default it stays."""
        return goal

    def counted(self, goal: Goal, state: S, time_s: Array) -> Goal:
        """As `advance`, for evaluations: a target counts within the tolerance."""
        return self.advance(goal, state, time_s)

    def collides(self, state: S, goal: Goal, robot: Robot) -> Array | None:
        """Whether a state touches something it must not, or lies in a volume to keep out of, shape (...,).

        None where nothing stands about.
        """
        touching: Array | None = None
        for volume in self.keep_outs:
            within = volume.distance(side_by_side(*state.columns()[:3])) < 0.0
            touching = within if touching is None else touching | within
        return touching

    def kept_out(self, what: str, places: Array) -> str:
        """How the first of some places that does lies in a volume to keep out of; empty where none does.

        Args:
            what: What the places are, such as `the goal`.
            places: x, y, z [m] and whatever follows, shape (k, 3 or more).
        """
        for volume, structure in zip(self.keep_outs, self.structures, strict=False) if len(places) else ():
            deep = -np.asarray(volume.distance(np.asarray(places, dtype=float)[:, :3]))
            if (deep > 0.0).any():
                first = int(np.argmax(deep > 0.0))
                x, y, z = (float(number) for number in np.asarray(places)[first][:3])
                return (
                    f"{what} x = {x:g} m, y = {y:g} m, z = {z:g} m lies {deep[first]:.2f} m within the keep-out "
                    f"volume of '{structure.name}'."
                )
        return ""

    def goal_problem(self, places: Array) -> str:
        """Why no robot may go to some places, as those of `kept_out`; empty where it may."""
        return self.kept_out("the goal", places)

    def penalty(self, state: S, goal: Goal, robot: Robot) -> Array | None:
        """What a state costs a learner beside the reward, shape (...,); None: nothing."""
        return None

    def distance_from_goal(self, state: S, goal: Goal) -> Array | None:
        """What the geofence limits, shape (...,) [m]: by default the way to the current target.

        None where targets are no places.
        """
        if self.goal_topic == "goal_velocity":
            return None
        return state.distance_to(goal.current)


@dataclass(frozen=True, kw_only=True)
class FileTask(Task[S]):
    """A task that a file of `configs/tasks` describes, with what every file has."""

    name: str
    title: str
    episode_s: float  # length of an episode [s]
    tolerance: Tolerance  # what counts as success; of targets that follow each other, within which one counts
    thing: str = ""  # of `configs/things`, that stands at the world's origin; empty: none

    @functools.cached_property
    def structures(self) -> tuple[Structure, ...]:
        """See `Task.structures`.

        Raises:
            ConfigError: As in `load_structure`.
        """
        return (load_structure(self.thing),) if self.thing else ()
