"""The node that owns a backend: one class for simulators, the mock and hardware."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn

from fulmar_core.backend import Backend
from fulmar_core.disturbances.scenario import draw_world, load_scenario
from fulmar_core.episode import WORLD, Episode, episode_rng
from fulmar_core.errors import FulmarError
from fulmar_core.robot import Robot, load_robot
from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.safety.watchdog import Watchdog
from fulmar_core.state import planar_state
from fulmar_core.topics import DIAGNOSTICS
from fulmar_ros.health import Health
from fulmar_ros.lockstep_loop import LockstepLoop, OnStep, SimulatedTime
from fulmar_ros.parameters import read_parameters
from fulmar_ros.plant_settings import PlantSettings
from fulmar_ros.plant_wires import PlantWires
from fulmar_ros.qos import publisher_qos
from fulmar_ros.realtime_loop import RealtimeLoop
from fulmar_ros.runtime import FAILED, RequestExit

MakeBackend = Callable[[Robot, PlantSettings], Backend]
SAFE_REPEATS = 5  # the safe command is published this often on the way out
HEALTH_PERIOD_S = 0.1  # how soon a change is noticed
HEALTH_AT_LEAST_S = 1.0
SETTLE_S = 0.3  # a publisher sees a match some milliseconds before the subscriber's side is ready


class PlantNode(LifecycleNode):
    """Publishes what the backend measures, applies what controllers command, and stops when they fall silent.

    The backend runs between activation and deactivation, in a thread of its own that no callback can hold up.
    """

    def __init__(
        self,
        make_backend: MakeBackend,
        request_exit: RequestExit,
        *,
        simulated: bool = True,
        cli_args: list[str] | None = None,
    ) -> None:
        """Read the parameters and, unless told otherwise, start.

        Args:
            make_backend: Builds the backend; called at configuration.
            request_exit: Ends the process.
            simulated: Whether the backend knows the truth and makes the time.
            cli_args: ROS arguments of this node alone, where it shares a process.

        Raises:
            FulmarError: If a parameter or a configuration file is wrong.
        """
        super().__init__("plant", cli_args=cli_args)
        self.settings = read_parameters(self, PlantSettings)
        self.robot = load_robot(self.settings.robot)
        self._scenario = load_scenario(self.settings.scenario)
        self._make_backend, self._request_exit, self._simulated = make_backend, request_exit, simulated
        self._thread: threading.Thread | None = None
        self._stop = threading.Event()
        self._mode, self._reason = "inactive", ""
        self._said: tuple[object, ...] = ()
        self._said_at = 0.0
        timeout_s = self.settings.timeout_s(self.robot)
        if timeout_s <= 0.0:
            self.get_logger().warning(
                "THE COMMAND WATCHDOG IS OFF: actuators stay as they are when a controller dies."
            )
            timeout_s = 1e9
        self.guard = ActuatorGuard(self.robot.actuators, Watchdog(round(timeout_s * 1e9)))
        self.clock = SimulatedTime()
        if self.settings.autostart:
            for transition in (self.trigger_configure, self.trigger_activate):
                if transition() != TransitionCallbackReturn.SUCCESS:
                    raise FulmarError(f"plant of '{self.robot.name}' could not start: {self._reason}")

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Build the backend and every endpoint."""
        try:
            self.backend = self._make_backend(self.robot, self.settings)
        except FulmarError as error:
            self._reason = str(error)
            self.get_logger().error(self._reason)
            return TransitionCallbackReturn.FAILURE
        self.wires = PlantWires(self, self.robot, self.guard, simulated=self._simulated)
        publisher = self.create_publisher(DiagnosticArray, DIAGNOSTICS.name, publisher_qos(DIAGNOSTICS))
        self._health = Health(f"{self.robot.name}: plant", [publisher])
        hz = self.settings.control_rate(self.robot)
        self._lockstep = LockstepLoop(
            self.backend,
            self.wires,
            self.guard,
            self.clock,
            control_hz=hz,
            answer_timeout_s=self.settings.answer_timeout_s,
        )
        self._realtime = RealtimeLoop(
            self.backend, self.wires, self.guard, self.clock, rate=self.settings.rate
        )
        self.create_timer(HEALTH_PERIOD_S, self._tell_health)
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start the loop."""
        self._stop.clear()
        self._mode = "waiting"
        self._thread = threading.Thread(target=self._run, name="plant", daemon=True)
        self._thread.start()
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop the loop and close the actuators."""
        self._halt()
        self._mode = "inactive"
        return super().on_deactivate(state)

    def stop(self) -> None:
        """Last words before the process ends: the safe command, several times."""
        self._halt()
        if hasattr(self, "backend"):
            self._make_safe()
            self.backend.close()

    def _halt(self) -> None:
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def run_episode(self, episode: Episode, *, number: int, seed: int, steps: int, on_step: OnStep) -> None:
        """Run one episode in lock step, from the caller's thread.

        Args:
            episode: Where to start and in which world.
            number: Number of the episode.
            seed: Seed of the sensor noise.
            steps: Control steps to run.
            on_step: Told about every step.

        Raises:
            LockstepError: If the controller does not answer in time.
        """
        sample = self.backend.reset(episode.start, episode.world, seed=seed, number=number)
        self._lockstep.run(sample, steps, self._stop, on_step)

    def _run(self) -> None:
        try:
            self._wait_for_subscribers()
            self._mode = "running"
            x, y, heading = self.settings.start
            start = planar_state(x, y, np.deg2rad(heading))
            world = draw_world(self.robot, self._scenario, episode_rng(self.settings.seed, 0, stream=WORLD))
            sample = self.backend.reset(start, world, seed=self.settings.seed)
            if self.settings.lockstep:
                self._lockstep.run(
                    sample, self._count(1.0 / self.settings.control_rate(self.robot)), self._stop
                )
            else:
                self._realtime.run(sample, self._count(self.robot.timing.physics_dt), self._stop)
            self._make_safe()
            self._mode = "inactive" if self._stop.is_set() else "finished"
        except FulmarError as error:
            self._fail(str(error))
        except Exception as error:  # noqa: BLE001 - whatever a backend raises must close the actuators
            self._fail(f"{type(error).__name__}: {error}")

    def _count(self, dt: float) -> int | None:
        """How many loops of `dt` seconds fill the duration; None for no end."""
        return round(self.settings.duration_s / dt) if self.settings.duration_s > 0.0 else None

    def _wait_for_subscribers(self) -> None:
        if not self.settings.wait_for_subscribers:
            return
        while self.wires.subscribers() < self.settings.wait_for_subscribers and not self._stop.wait(0.01):
            pass
        self._stop.wait(SETTLE_S)

    def _fail(self, reason: str) -> None:
        self._mode, self._reason = "fault", reason
        self.get_logger().error(reason)
        self._make_safe()
        self._tell_health()
        self._request_exit(FAILED)

    def _make_safe(self) -> None:
        safe = self.robot.actuators.safe_command
        self.backend.step(safe, 0)
        for _ in range(SAFE_REPEATS):
            self.wires.publish_applied(safe, self.clock.now_ns)
        self.wires.flush()

    def _tell_health(self) -> None:
        """Publish the plant's health when something changed, and now and then."""
        with self.wires.lock:
            silent_ms = self.guard.watchdog.silent_ns(time.monotonic_ns()) / 1e6
            tripped = self.guard.watchdog.tripped and self._mode == "running" and not self.settings.lockstep
            counts = (self.guard.watchdog.trips, self.guard.rejected)
        changed = (self._mode, self._reason, tripped, *counts)
        now = time.monotonic()
        if changed == self._said and now - self._said_at < HEALTH_AT_LEAST_S:
            return
        self._said, self._said_at = changed, now
        level, message = "ok", self._mode
        if tripped:
            limit_ms = self.guard.watchdog.timeout_ns / 1e6
            level = "error"
            message = (
                f"no command for {silent_ms:.0f} ms (limit {limit_ms:.0f} ms): actuators in their safe state"
            )
        elif self._mode == "fault":
            level, message = "error", self._reason
        elif self.guard.last_rejection:
            level, message = (
                "warn",
                f"{self.guard.rejected} commands refused, the last: {self.guard.last_rejection}",
            )
        self._health.publish(level, message, self._values())

    def _values(self) -> dict[str, str]:
        deadlines = self._realtime.deadlines
        return {
            "mode": self._mode,
            "reason": self._reason,
            "ticks": str(self._realtime.ticks),
            "steps": str(self._lockstep.steps),
            "sim_time_s": f"{self.clock.now_ns / 1e9:.3f}",
            "watchdog_trips": str(self.guard.watchdog.trips),
            "rejected_commands": str(self.guard.rejected),
            "overruns": str(deadlines.overruns),
            **self.wires.latency_ms.percentiles("latency_ms"),
            **deadlines.period_error_ms.percentiles("period_error_ms"),
        }
