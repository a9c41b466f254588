"""What a controller is told, and whether it may act on it: goals, obstacles, the e-stop and odometry."""

from __future__ import annotations

import dataclasses
import threading
import time

from geometry_msgs.msg import PoseStamped
from std_msgs.msg import Bool
from visualization_msgs.msg import MarkerArray

from fulmar_core.robot import Robot
from fulmar_core.safety.arbiter import Decision, Flags, arbitrate
from fulmar_core.safety.area import outside
from fulmar_core.safety.estop import EstopWatch
from fulmar_core.safety.input_gate import Measurement
from fulmar_core.tasks import Task
from fulmar_ros.controller_settings import ControllerSettings
from fulmar_ros.goal_messages import GoalMessage
from fulmar_ros.message_reader import block_of, goal_of, obstacles_of, stamp_ns
from fulmar_ros.mission import Mission

ENDED = "the e-stop stopped this goal"


@dataclasses.dataclass(frozen=True, slots=True)
class Refusal:
    """A goal that does not count."""

    stamp_ns: int = 0
    reason: str = ""  # of the e-stop; empty if the newest goal counts


class ControllerInputs:
    """Where every message to a controller ends, and what a control step begins with.

    Messages and control steps come from different threads. Public methods take the lock themselves unless they say
    otherwise; private ones are called with it held. What `take_...` returns says why something was not taken, and is
    empty if it was; of odometry, `take` says whether it was.

    Attributes:
        lock: Held while several things are looked at together.
        mission: Goal, obstacles and block, and how far it has come.
        newest: The newest usable measurement since the activation.
        acted: Control steps with a command of the controller's own since the activation.
        refusal: What became of the newest goal, if the e-stop refused it or took it away.
    """

    def __init__(self, robot: Robot, task: Task, settings: ControllerSettings) -> None:
        """Know nothing yet."""
        self.lock = threading.Lock()
        self.mission = Mission(robot, task, streamed=settings.goals_streamed)
        self.newest: Measurement | None = None
        self.acted = 0
        self.refusal = Refusal()
        self._settings = settings
        self._control_ns = round(1e9 / settings.control_rate(robot))
        self._flags = settings.flags(robot)
        self._bearing: bool | None = None if settings.has_bearing(robot) else True  # None: not received yet
        self._estop = EstopWatch(required=settings.estop)
        self._gate = settings.input_gate(robot)
        self._newest_epoch = self._acted_epoch = 0  # of the newest measurement, and of the last control step
        self._anew = False  # another goal came; told at the next step, since the controller may be acting now

    @property
    def flags(self) -> Flags:
        """What the arbiter decides by, as of now."""
        return self._flags

    @property
    def epoch(self) -> int:
        """Jumps of the measurements so far."""
        return self._gate.epoch

    def set(self, **changes: object) -> None:
        """Change flags by their names."""
        with self.lock:
            self._change(**changes)

    def activate(self) -> None:
        """Wait for fresh measurements."""
        with self.lock:
            self.newest, self.acted = None, 0
            self._gate.forget()
            self._change(activated=True, last_input_ns=None, input_problem="", outside="")

    def decide(self) -> Decision:
        """Whether the controller may act now."""
        with self.lock:
            return self.arbitrate()

    def arbitrate(self) -> Decision:
        """The same; call with the lock held.

        An e-stop takes the goal away: after it, nothing moves by itself.
        """
        now = time.monotonic_ns()
        stopped = self._estop.reason(now)
        if stopped and self._estop.heard:
            if self.mission.goal_stamp_ns:
                self.refusal = Refusal(self.mission.goal_stamp_ns, stopped)
            self.mission.drop()
            self._follow_mission()
            self._change(outside=self._outside())
        self._change(estop=stopped, active_s=self.acted * self._control_ns / 1e9)
        return arbitrate(self._flags, now)

    def news(self) -> tuple[bool, bool]:
        """Whether time or place jumped, and whether another goal came; each told once. Call with the lock held."""
        news = (self._newest_epoch != self._acted_epoch, self._anew)
        self._anew, self._acted_epoch = False, self._newest_epoch
        return news

    def hear_estop(self, message: Bool) -> None:
        """Hear the e-stop."""
        with self.lock:
            self._estop.hear(bool(message.data), time.monotonic_ns())

    def release_estop(self) -> None:
        """Take a reset of the e-stop."""
        with self.lock:
            self._estop.release(time.monotonic_ns())

    @property
    def bearing_known(self) -> bool:
        """Whether the state of the air bearing has come, or there is none."""
        return self._bearing is not None

    def take_bearing(self, on: bool) -> None:
        """Take the state of the air bearing; once it is on again, what controllers remember is of no use."""
        with self.lock:
            self._anew = self._anew or (on and self._bearing is False)
            self._bearing = on
            self._change(bearing_off=not on)

    def take_goal(self, message: GoalMessage) -> str:
        """Take a goal; none while a heard e-stop holds."""
        goal, problem = goal_of(message)
        if goal is None:
            return problem
        with self.lock:
            stamp, stopped = stamp_ns(message.header.stamp), self._estop.reason(time.monotonic_ns())
            if self._estop.heard and stopped:
                self.refusal = Refusal(stamp, stopped)
                self.mission.refuse(goal, stamp)
                return f"{stopped}. Give a new goal once the e-stop is released."
            if self.mission.is_void(goal, stamp):
                if not self.mission.goal_stamp_ns:
                    self.refusal = Refusal(stamp, ENDED)
                return f"{ENDED}. Publish it with a new stamp."
            self.refusal = Refusal()
            if self.mission.give(goal, stamp):
                self._anew = True
                if not self._settings.goals_streamed:
                    # Somebody has looked: he who left may go on, if he is back.
                    self._change(outside=self._outside())
            self._follow_mission()
            if self._settings.lockstep:
                self._gate.forget()
        return ""

    def take_obstacles(self, message: MarkerArray) -> str:
        """Take all obstacles that there are, in place of those known so far."""
        discs, problem = obstacles_of(message)
        if discs is None:
            return problem
        stamp = stamp_ns(message.markers[0].header.stamp) if message.markers else 0
        with self.lock:
            self.mission.see_obstacles(discs, stamp)
            self._follow_mission()
        return ""

    def take_block(self, message: PoseStamped) -> str:
        """Take the place of the block."""
        place, problem = block_of(message)
        if place is None:
            return problem
        with self.lock:
            self.mission.see_block(place, stamp_ns(message.header.stamp))
            self._follow_mission()
        return ""

    def take(self, measurement: Measurement) -> bool:
        """Take odometry.

        Returns:
            Whether it is usable; if not, `decide` says why.
        """
        with self.lock:
            problem = self._gate.problem(measurement) or ""
            if problem:
                self._change(input_problem=problem)
                return False
            self.newest, self._newest_epoch = measurement, self._gate.epoch
            self.mission.turn_to(measurement.stamp_ns)
            self._follow_mission(
                last_input_ns=time.monotonic_ns(),
                input_problem="",
                outside=self._flags.outside or self._outside(),
            )
        return True

    def _follow_mission(self, **changes: object) -> None:
        """Tell the flags what the mission says."""
        distance = self.mission.distance(self.newest.state) if self.newest else float("inf")
        lacking = self.mission.lacking
        self._change(has_goal=not lacking, lacking=lacking, goal_distance=distance, **changes)

    def _outside(self) -> str:
        """How the robot is outside its area right now; empty if it is not, or if nobody knows."""
        if self.newest is None:
            return ""
        x, y = self.newest.state.position_in_world[:2].tolist()
        return outside(x, y, self._settings.area)

    def _change(self, **changes: object) -> None:
        self._flags = dataclasses.replace(self._flags, **changes)  # type: ignore[arg-type]
