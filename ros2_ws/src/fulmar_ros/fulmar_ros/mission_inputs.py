"""Goals, obstacles and poses of things, from messages to a controller's guarded loop."""

from __future__ import annotations

import time
from collections.abc import Callable

from geometry_msgs.msg import PoseStamped
from visualization_msgs.msg import MarkerArray

from fulmar_bags.message_reader import goal_of, obstacles_of, stamp_ns, thing_of
from fulmar_core.loop.guarded_loop import GuardedLoop
from fulmar_core.safety.arbiter import BEYOND_GEOFENCE
from fulmar_core.wires.robot_name import Frames
from fulmar_ros.goal_age import GoalAge
from fulmar_ros.goal_messages import GoalMessage


class MissionInputs:
    """Reads what a controller is to do, and logs what it refuses.

    Attributes:
        goal_age: Receives each reset of the e-stop.
    """

    def __init__(self, frames: Frames, warn: Callable[[str], None], *, refuses_old_goals: bool) -> None:
        """Begin without a goal.

        Args:
            frames: Of the robot.
            warn: Logs a refusal.
            refuses_old_goals: Whether goals from before the newest reset of the e-stop are refused; see `GoalAge`.
        """
        self._frames, self._warn = frames, warn
        self._was_too_far = False
        self.goal_age = GoalAge(counts=refuses_old_goals)

    def take_goal(self, guard: GuardedLoop, message: GoalMessage, info: dict[str, int]) -> None:
        """Give a goal to the loop, or the reason of its refusal."""
        targets, problem = goal_of(message, self._frames)
        stamp = stamp_ns(message.header.stamp)
        problem = problem or self.goal_age.problem(info)
        if targets is None or problem:
            guard.refuse_goal(problem, stamp)
        else:
            problem = guard.take_goal(targets, stamp, time.monotonic_ns()) or self._too_far(guard)
        if problem:
            self._warn(f"goal refused: {problem}")

    def _too_far(self, guard: GuardedLoop) -> str:
        """Why a goal that was taken is not followed: beyond the geofence; empty if it is, or if the last was as far."""
        reason, before = guard.decide(time.monotonic_ns()).reason, self._was_too_far
        self._was_too_far = BEYOND_GEOFENCE in reason
        return reason if self._was_too_far and not before else ""

    def take_obstacles(self, guard: GuardedLoop, message: MarkerArray) -> bool:
        """Give obstacles to the loop; whether it got them."""
        discs, problem = obstacles_of(message, self._frames)
        if discs is None:
            self._warn(f"obstacles refused: {problem}")
            return False
        guard.take_obstacles(discs, stamp_ns(message.markers[0].header.stamp) if message.markers else 0)
        return True

    def take_thing(self, guard: GuardedLoop, name: str, message: PoseStamped) -> bool:
        """Give the pose of a thing to the loop; whether it got it."""
        pose, problem = thing_of(message, self._frames)
        if pose is None:
            self._warn(f"place of the {name} refused: {problem}")
            return False
        guard.take_thing(name, pose, stamp_ns(message.header.stamp))
        return True
