"""Events of a running system, from the reports of its plant and controller. Knows no ROS."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Protocol

from fulmar_core.safety.estop import HOLDS
from fulmar_core.safety.watchdog import NO_COMMAND
from fulmar_core.tasks.goal_sequence import HOLD_S

ARRIVES_S = 0.3  # after a controller reports that it acts, its command has arrived
Emit = Callable[..., None]  # name of the event, and its fields by keyword


class Reported(Protocol):
    """The newest status of one node."""

    level: str
    message: str
    values: dict[str, str]
    received_s: float  # when, by a monotonic clock [s]


class SystemEvents:
    """Compares each report with the one before, and emits an event for every change that an operator waits for.

    The events, each with `time_s`, seconds of the robot's own time: `goal` (stamp_ns), `goal_refused` (reason),
    `target` (done: targets of a path so far), `reached` (distance_m, after_s: within the task's tolerance for a
    second), `swapped` (controller, sha256), `swap_refused` (reason), `estop` (reason), `reset`, `fault` (node, reason)
    and `recovered` (node).
    """

    def __init__(self, emit: Emit) -> None:
        """Begin with nothing known; `emit` is called with each event."""
        self._emit = emit
        self._goals, self._goal_s = "0", 0.0
        self._refused = ("", "0")
        self._done = 0
        self._inside_s: float | None = None  # since when the robot is at its goal; infinite once reported
        self._controller: tuple[str, str] | None = None
        self._swap = ""
        self._held = False
        self._acts_since: float | None = None  # when the controller began to act [s]
        self._faults: dict[str, str] = {}

    def look(self, plant: Reported, controller: Reported, time_s: float) -> None:
        """Compare the newest reports with those before; `time_s` is the robot's own time [s].

        A controller that reports nothing has empty values.
        """
        self._look_at_estop(plant, time_s)
        if controller.values:
            self._look_at_controller(controller.values, time_s)
            self._look_at_goal(controller.values, time_s)
        waits = plant.message.startswith(NO_COMMAND) and not self._is_commanded(plant, controller)
        self._look_at_fault("plant", plant, time_s, excused=self._held or waits)
        self._look_at_fault("controller", controller, time_s, excused=self._held)

    def forget_controller(self) -> None:
        """Another controller process has begun, which counts its goals from zero."""
        self._goals, self._refused, self._done, self._inside_s = "0", ("", "0"), 0, None
        self._swap, self._acts_since = "", None

    def _is_commanded(self, plant: Reported, controller: Reported) -> bool:
        """Whether a plant can miss commands: it has reported since its controller began to act."""
        if controller.values.get("mode") == "armed":
            self._acts_since = None
        elif self._acts_since is None:
            self._acts_since = controller.received_s
        return self._acts_since is not None and plant.received_s - self._acts_since > ARRIVES_S

    def _look_at_estop(self, plant: Reported, time_s: float) -> None:
        held = plant.message.startswith(HOLDS)
        if held and not self._held:
            self._emit("estop", time_s=time_s, reason=plant.message)
        elif self._held and not held:
            self._emit("reset", time_s=time_s)
        self._held = held

    def _look_at_controller(self, values: dict[str, str], time_s: float) -> None:
        now = values.get("controller", ""), values.get("sha256", "")
        if self._controller is not None and now != self._controller:
            self._emit("swapped", time_s=time_s, controller=now[0], sha256=now[1])
        self._controller = now
        swap = values.get("swap", "")
        if swap != self._swap and swap.startswith("refused"):
            self._emit("swap_refused", time_s=time_s, reason=swap)
        self._swap = swap

    def _look_at_goal(self, values: dict[str, str], time_s: float) -> None:
        refused = values.get("goal_refused", ""), values.get("goal_refused_stamp_ns", "0")
        if refused[0] and refused != self._refused:
            self._emit("goal_refused", time_s=time_s, reason=refused[0])
        self._refused = refused
        goals, done = values.get("goals_received", "0"), int(values.get("goals_done", "0"))
        stamp = values.get("goal_stamp_ns", "0")
        # One beyond the geofence is not followed yet.
        if goals != self._goals and not (refused[0] and refused[1] == stamp):
            self._goals, self._goal_s, self._done, self._inside_s = goals, time_s, 0, None
            self._emit("goal", time_s=time_s, stamp_ns=int(stamp))
        if done > self._done:
            self._done = done
            self._emit("target", time_s=time_s, done=done)
        if values.get("at_goal") != "true":
            self._inside_s = None if self._inside_s != math.inf else math.inf
        elif self._inside_s is None:
            self._inside_s = time_s
        elif time_s - self._inside_s >= HOLD_S:
            self._inside_s = math.inf
            self._emit(
                "reached",
                time_s=time_s,
                distance_m=float(values["goal_distance_m"]),
                after_s=round(time_s - self._goal_s, 3),
            )

    def _look_at_fault(self, node: str, report: Reported, time_s: float, *, excused: bool) -> None:
        before = self._faults.get(node, "")
        now = report.message if report.level == "error" and not excused else ""
        if now and not before:
            self._emit("fault", time_s=time_s, node=node, reason=now)
        elif before and not now and not excused:
            self._emit("recovered", time_s=time_s, node=node)
        if now or not excused:
            self._faults[node] = now


def distance_of(values: dict[str, Any]) -> float | None:
    """Distance from the goal as a controller reports it [m]; None without a goal, or where it reports none."""
    distance = float(values.get("goal_distance_m") or "inf")
    return distance if math.isfinite(distance) else None


def mode_of(plant: Reported, controller: Reported) -> str:
    """What a system is doing, in a word: `e-stop`, or the mode of its controller, or of its plant."""
    if plant.message.startswith(HOLDS):
        return "e-stop"
    return controller.values.get("mode") or plant.values.get("mode") or "starting"
