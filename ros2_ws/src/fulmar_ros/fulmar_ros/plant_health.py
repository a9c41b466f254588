"""Diagnostics of a plant."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

from rclpy.lifecycle import LifecycleNode

from fulmar_core.estimators.actuator_health.feedback_check import ActuatorFeedback
from fulmar_core.estimators.actuator_health.supply_check import TANK_EMPTY
from fulmar_core.robots.wire_check import BETWEEN, WIRE_WARNINGS
from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.safety.watchdog import NO_COMMAND
from fulmar_ros.graph import UNNAMED, WireWatch
from fulmar_ros.health import Health
from fulmar_ros.plant_clock import SimulatedTime, WallTime
from fulmar_ros.plant_loops import LockstepLoop, RealtimeLoop
from fulmar_ros.plant_wires import PlantWires

LOOK_S = 0.1  # between two looks for a change
AT_LEAST_S = 1.0  # between two reports without a change
NAMES_LOOKS = 10  # in which discovery reports the name of a node whose publisher is known
GIVE_BACK_BY = "fulmar teleop ROBOT --give-back"  # ends what a device's refusal began
SAFE_CONTROLLER = "safe controller"  # commands what cannot stop when its controller fails
HANGS_S = 0.5  # a step that takes longer than this, and than ten ticks, will not come back


class PlantHealth:
    """Watches a plant's loop from outside its thread, and publishes its status.

    Attributes:
        mode: inactive, waiting, running, stopping, finished or fault.
        reason: Why it is in fault, or could not be configured.
        awaited: Subscribers without whom it does not begin.
        more: Health that a device reports; see `hardware_drivers.driver.DeviceDriver`.
        simulation: What a person does to a simulation; see `simulation_wires`.
        link: What a simulated link has lost; see `plant_link`.
        feedback: Finds parts that do not do what is applied to them; None before the loops are made.
    """

    def __init__(self, robot: str) -> None:
        """Begin inactive."""
        self.mode, self.reason = "inactive", ""
        self.awaited = 0
        self._unnamed_looks = 0
        self._robot = robot
        self._identity: dict[str, str] = {}  # as in `node_identity`
        self._said: tuple[object, ...] = ()
        self._said_at = 0.0
        self._closed = False
        self.more: Callable[[], dict[str, str]] = dict
        self.feedback: ActuatorFeedback | None = None
        self.simulation: Callable[[], dict[str, str]] = dict
        self.link: Callable[[], dict[str, str]] = dict

    def open(self, node: LifecycleNode, identity: Mapping[str, str]) -> None:
        """Begin to publish, with the values of `node_identity`."""
        self._closed = False
        self._identity = dict(identity)
        self._health = Health(node, f"{self._robot}: plant")
        self._wire_watch = WireWatch(node, self._wires.subscribed)
        self._timer = node.create_timer(LOOK_S, self.publish)

    def close(self, node: LifecycleNode) -> None:
        """Stop publishing, also what a beat of the timer that is on its way would publish."""
        self._closed = True
        node.destroy_timer(self._timer)
        for publisher in self._health.publishers:
            node.destroy_publisher(publisher)

    def watch(
        self,
        guard: ActuatorGuard,
        wires: PlantWires,
        clock: SimulatedTime | WallTime,
        lockstep: LockstepLoop,
        realtime: RealtimeLoop | None,
    ) -> None:
        """Watch these from now on; `realtime` is None where the plant runs in lock step."""
        self._guard, self._wires, self._clock = guard, wires, clock
        self._lockstep, self._realtime = lockstep, realtime

    def publish(self) -> None:
        """Publish on change, to a subscriber that has come, and once a second."""
        if self._closed:
            return
        self._wires.commands.see_writers()
        self._wires.estop.look()
        level, message, key = self._status()
        more = self.more()
        unfit = BETWEEN.join(self._wire_watch.look())
        findings = self.feedback.findings if self.feedback is not None else ()
        failed = [finding.words for finding in findings]
        supply = self.feedback.supply if self.feedback is not None else None
        low = supply.warning if supply is not None else ""
        warning = more.get("warning", "") or "; ".join(failed) or low or unfit
        if warning and level == "ok":
            level, message = "warn", warning
        guard, listeners, simulation = self._guard, self._health.listeners(), self.simulation()
        if simulation.get("paused") == "true" and level == "ok":
            message = "paused"
        changed = (
            self.mode, self.reason, key, warning, guard.watchdog.trips, guard.rejected, listeners, self._doing,
            self._wires.estop.held(), self._wires.estop.by,
            *simulation.values(),
        )  # fmt: skip
        now = time.monotonic()
        if changed == self._said and now - self._said_at < AT_LEAST_S:
            return
        self._said, self._said_at = changed, now
        held = self._held()
        parts = ", ".join(finding.part for finding in findings if finding.part)
        values = self._values() | {"failed_parts": parts, WIRE_WARNINGS: unfit} | more | simulation
        values |= self.link()
        if supply is not None and supply.pressure is not None:
            values["supply_pressure_bar"] = f"{1e-5 * supply.pressure:.2f}"
        if supply is not None and supply.empty is not None:
            values[TANK_EMPTY] = supply.empty.words
        also = [text for text in (held, *failed, low) if text]
        self._health.publish(level, message, values, warnings=also)

    def _status(self) -> tuple[str, str, str]:
        """Level, message, and the part of the message whose change counts."""
        if self.mode == "fault":
            return "error", self.reason, "fault"
        if self._guard.failed and self.mode == "running":
            return "error", f"{self._guard.failed}: {self._refuge()}", "failed"
        if self.mode == "running" and self._guard.handed_over:
            return "warn", f"the plant is about to end: {self._refuge()}", "ends"
        held = self._held()
        if held:
            return "error", f"{held}: {self._refuge()} until `{GIVE_BACK_BY}`", held
        contested = self._contested()
        if contested:
            self._unnamed_looks = self._unnamed_looks + 1 if UNNAMED in contested else 0
            level = "warn" if 0 < self._unnamed_looks <= NAMES_LOOKS else "error"
            words = self._refuge()
            return level, f"{contested}. {words[0].upper()}{words[1:]} until the others stop.", contested
        if self.mode == "running" and self._realtime is not None:
            now = time.monotonic_ns()
            late_s = self._realtime.since_tick_s(now)
            if late_s > max(HANGS_S, 10.0 * self._realtime.period_s):
                return "error", f"the backend has not finished a step for {late_s:.1f} s: it hangs", "hangs"
            with self._wires.lock:
                # Asked here too, so that a loop that hangs cannot hide a trip.
                self._guard.watchdog.expired(now)
                tripped, silent_ns = self._guard.watchdog.tripped, self._guard.watchdog.silent_ns(now)
            if tripped:
                limit_ms = self._guard.watchdog.timeout_ns / 1e6
                limit = f"(limit {limit_ms:.0f} ms): {self._refuge()}"
                return "error", f"{NO_COMMAND} {silent_ns / 1e6:.0f} ms {limit}", "tripped"
        stopped = self._estop()
        if stopped:
            return stopped
        if self._guard.person:
            return "warn", "a person has the actuators", "person"
        if self._guard.last_rejection:
            count = self._guard.rejected
            return "warn", f"{count} commands refused, the last: {self._guard.last_rejection}", "refused"
        if self.mode == "waiting" and self.awaited:
            return "ok", f"waiting: {self._wires.subscribers()} of {self.awaited} listen", ""
        return "ok", self.mode, ""

    def _contested(self) -> str:
        """Which nodes publish commands, where two do and one has the actuators."""
        with self._wires.lock:
            contested = self._guard.publishers.reason(time.monotonic_ns())
        return "" if self._guard.person or self.mode == "finished" else contested

    def _held(self) -> str:
        """Why the device's refusal holds the robot; empty where none does, and after the end."""
        with self._wires.lock:
            held = self._guard.held
        return held if self.mode == "running" else ""

    def _estop(self) -> tuple[str, str, str] | None:
        """Status while the e-stop holds: a warning before it was ever released, an error once it stops a run."""
        with self._wires.lock:
            reason = self._guard.estop.reason(time.monotonic_ns())
            level = "error" if self._guard.estop.was_released and self.mode == "running" else "warn"
        return (level, f"{reason}: {self._refuge()}", reason[:16]) if reason else None

    @property
    def _doing(self) -> str:
        """What the safe controller does now; nothing where the plant does not run."""
        return self._guard.doing if self.mode == "running" else ""

    def _refuge(self) -> str:
        """What happens in the place of the controller's commands."""
        doing = self._doing
        return f"the safe controller {doing}" if doing else "actuators in their safe state"

    def _commander(self) -> str:
        if self._doing:
            return SAFE_CONTROLLER
        return "person" if self._guard.person else "controller"

    def _values(self) -> dict[str, str]:
        values = {
            **self._identity,
            "mode": self.mode,
            "reason": self.reason,
            "steps": str(self._lockstep.steps),
            "sim_time_s": f"{self._clock.now_ns / 1e9:.3f}",
            "watchdog_trips": str(self._guard.watchdog.trips),
            "rejected_commands": str(self._guard.rejected),
            "commanded_by": self._commander(),
            "estop": str(self._wires.estop.held()).lower(),
            "estop_by": self._wires.estop.by,
            "safe_controller": self._doing,
            "answers": str(self._wires.commands.answers),
            **self._wires.commands.latency_ms.percentiles("latency_ms"),
        }
        if self._realtime is not None:
            values |= {
                "ticks": str(self._realtime.ticks),
                "overruns": str(self._realtime.deadlines.overruns),
                **self._realtime.deadlines.period_error_ms.percentiles("period_error_ms"),
            }
        return values
