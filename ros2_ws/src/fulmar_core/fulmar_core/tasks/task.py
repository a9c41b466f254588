"""What every task is: one interface for learners, evaluations and the robot."""

from __future__ import annotations

from typing import Protocol

from fulmar_core.counter_rng import Draws
from fulmar_core.goal import Goal
from fulmar_core.planar import PlanarState
from fulmar_core.robot import Robot
from fulmar_core.rotation import Array
from fulmar_core.tasks.terms import Errors, Tolerance


class TaskProtocol(Protocol):
    """Frozen, free of side effects; every array has the leading shape of the state it goes with.

    Some tasks have more, which whoever runs them asks for by name:

    - `required: int`: targets that make an episode a success, where not a closing window but their number counts.
    - `counted(goal, state, radius) -> Goal`: as `advance`, for judges: a target counts within a radius of theirs [m].
    - `begun(goal, state) -> Goal`: a goal that was told, for a robot that is somewhere, before its first step.
    - `distance_from_goal(state, goal) -> Array`: what the geofence limits, where that is not the position's error [m].
    - `penalty(state, goal, robot) -> Array`: what a state costs a learner beside the reward.
    - `pushed(goal, before, after, robot) -> (Goal, PlanarState)`: where the block is after a step in the core's batch,
      and the robot once the block has held it up; simulators with contacts move the block themselves.
    """

    name: str
    title: str
    episode_s: float  # length of an episode [s]
    tolerance: Tolerance
    goal_topic: str
    observation_names: tuple[str, ...]

    def draw(self, draws: Draws, robot: Robot, *, training: bool) -> tuple[PlanarState, Goal]:
        """Draw starts and goals, as NumPy float64, leading shape (worlds,)."""
        ...

    def observe(self, state: PlanarState, goal: Goal) -> tuple[Array, ...]:
        """Terms in the order of `observation_names`, each of shape (...,)."""
        ...

    def advance(self, goal: Goal, state: PlanarState, time_s: Array) -> Goal:
        """The goal after a measurement: targets may be done, or their time may be over."""
        ...

    def reward(self, before: PlanarState, after: PlanarState, goal: Goal, ended: Goal) -> Array:
        """Reward of one control step, shape (...,); actuators cost extra.

        Args:
            before: True state when it began.
            after: True state when it ended.
            goal: That it began with.
            ended: The goal after it: targets may be done, things may have moved.
        """
        ...

    def errors(self, state: PlanarState, goal: Goal) -> Errors:
        """How far a state is from the current target."""
        ...

    def collides(self, state: PlanarState, goal: Goal, robot: Robot) -> Array | None:
        """Whether a state touches something it must not, shape (...,); None where nothing stands about."""
        ...
