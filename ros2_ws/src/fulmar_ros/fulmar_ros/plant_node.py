"""The node that owns a backend: one class for simulators, the mock and hardware."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn

from fulmar_core.config.errors import BAD_USAGE, FAILED, ConfigError, FulmarError
from fulmar_core.controllers.flight_refuge import BLIND, refuge_of
from fulmar_core.estimators.actuator_health.feedback_check import ActuatorFeedback
from fulmar_core.robots.actuators.refuge import DOWN, LANDS_S
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import CLOCK, DIAGNOSTICS
from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.safety.command_end import TakesEnds
from fulmar_core.safety.estop import EstopMonitor
from fulmar_core.safety.watchdog import Watchdog
from fulmar_core.simulation.backend import AirBearing, Backend, Sample
from fulmar_core.simulation.disturbed import Disturbed
from fulmar_core.simulation.episode import Episode
from fulmar_core.tasks import load_task
from fulmar_core.wires.origin import origin_pose
from fulmar_core.worlds.scenario import load_scenario
from fulmar_ros.air_bearing import AirBearingWires
from fulmar_ros.lifecycle_requests import refuse_impossible_transitions
from fulmar_ros.living_plant import BRIEFLY_S, LATE_S, others_in, refuse_living_plant
from fulmar_ros.motion_capture import MakeCapture, capture_maker
from fulmar_ros.node_identity import identity_of
from fulmar_ros.operator_subscription import destroy_all, subscribe_every
from fulmar_ros.pace import Pace
from fulmar_ros.parameters import name_of, read_parameters
from fulmar_ros.plant_clock import SimulatedTime, WallTime, other_clocks
from fulmar_ros.plant_health import PlantHealth
from fulmar_ros.plant_link import plant_link
from fulmar_ros.plant_link_loop import LinkLoop
from fulmar_ros.plant_loops import ChainLoop, LockstepLoop, OnStep, RealtimeLoop, UnansweredLoop
from fulmar_ros.plant_settings import PlantSettings, first_episode
from fulmar_ros.plant_wires import PlantWires
from fulmar_ros.qos import SAFE_REPEATS
from fulmar_ros.robot_info_wire import RobotInfoWire
from fulmar_ros.runtime import RequestExit, settle_memory
from fulmar_ros.simulation_wires import SimulationWires

MakeBackend = Callable[[Robot, PlantSettings], Backend]
DONE, REFUSED = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE
SETTLE_S = 0.3  # a publisher sees a match some milliseconds before the subscriber's side is ready
BLIND_S = 3.0  # without any measured state, after which a descent is none [s]
LOOK_S = 0.05  # between two looks at a descent [s]
PATIENCE_S = 2.0  # for a backend that hangs in a step, before the node goes on without it


class PlantNode(LifecycleNode):
    """Publishes what the backend measures, applies what controllers command, and stops when commands stop.

    Between activation and deactivation the backend runs in a thread of its own, which no callback can delay.
    """

    def __init__(
        self,
        make_backend: MakeBackend,
        request_exit: RequestExit,
        *,
        simulated: bool = True,
        settings_class: type[PlantSettings] = PlantSettings,
        cli_args: list[str] | None = None,
    ) -> None:
        """Read the parameters and, unless `autostart` is off, start.

        Args:
            make_backend: Builds the backend; called at configuration.
            request_exit: Ends the process.
            simulated: Whether the backend knows the truth and makes the time.
            settings_class: Parameters of the node.
            cli_args: ROS arguments of this node alone, where it shares a process.

        Raises:
            FulmarError: A parameter or a configuration file is wrong, or another plant of this name lives.
        """
        super().__init__("plant", cli_args=cli_args, use_global_arguments=cli_args is None)
        refuse_impossible_transitions(self)
        self._made_s = time.monotonic()
        self._started_ns = time.time_ns()
        self.settings = read_parameters(self, settings_class)
        self.robot = load_robot(self.settings.robot)
        link = load_scenario(self.settings.scenario).link  # a wrong name is refused before anything starts
        self._link = plant_link(link, lockstep=self.settings.lockstep, chain=self.settings.between)
        in_step = self.settings.lockstep and self._link is None  # time stands still until a command comes
        load_task(self.settings.task, self.settings.thing)
        self._make_backend, self._request_exit, self._simulated = make_backend, request_exit, simulated
        self._backend: Backend | None = None
        self._simulation: SimulationWires | None = None
        self._exit_code = 0
        self._air: AirBearingWires | None = None
        self._thread: threading.Thread | None = None
        self._stop = threading.Event()
        self.health = PlantHealth(name_of(self, self.robot))
        self.health.awaited = self.settings.wait_for_subscribers
        timeout_s = self.settings.timeout_s(self.robot)
        if timeout_s == 0.0:
            until = (
                "actuators stay as they are"
                if self.robot.kind.rests
                else "the safe controller flies, and no trip is reported"
            )
            off = f"THE COMMAND WATCHDOG IS OFF: {until} when a controller dies."
            self.get_logger().warning(off)
            timeout_s = 1e9
        rate = self.settings.control_rate(self.robot)
        ticks_hz = 1.0 / self.robot.timing.physics_dt
        self.guard = ActuatorGuard(
            self.robot.actuators,
            Watchdog(round(timeout_s * 1e9)),
            estop=EstopMonitor(required=self.settings.estop),
            control_dt=1.0 / rate,
            period_s=1.0 / (rate * min(self.settings.rate, 1.0)),
            lockstep=in_step,
            refuge=refuge_of(self.robot, rate if in_step else ticks_hz),
            wall_ns=time.monotonic_ns,
        )
        self.clock = SimulatedTime() if simulated else WallTime()
        if self.settings.autostart:
            space = self.get_namespace()
            refuse_living_plant(self, space, since_s=self._made_s, spins=False, within_s=BRIEFLY_S)
            for transition in (self.trigger_configure, self.trigger_activate):
                if transition() != DONE:
                    name = name_of(self, self.robot)
                    raise FulmarError(f"plant of '{name}' could not start: {self.health.reason}")
            self._twin_reports = subscribe_every(self, DiagnosticArray, DIAGNOSTICS, self._yield_to_older)
            self._twin_timer = self.create_timer(LATE_S, self._end_watch)

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Build the backend and every endpoint."""
        try:
            ticks = self.robot.timing.substeps(self.settings.control_rate(self.robot))
            self._pace = Pace(1 if self.settings.lockstep else ticks)
            self._backend = self._make_backend(self.robot, self.settings)
        except Exception as error:  # noqa: BLE001 - rclpy would leave it out, and nobody would know why
            said = str(error) if isinstance(error, FulmarError | ValueError | ImportError) else ""
            self.health.reason = said or f"{type(error).__name__}: {error}".removesuffix(": ")
            self._exit_code = BAD_USAGE if isinstance(error, ConfigError) else 0
            self.get_logger().error(f"not configured: {self.health.reason}")
            return REFUSED
        self._exit_code = 0
        self.wires = PlantWires(
            self,
            self.robot,
            self.guard,
            simulated=self._simulated,
            clock=self._simulated and self.settings.clock and not self._clock_is_taken(),
            odometry=self.settings.publishes_odometry,
            mocap=self._motion_capture(),
            lockstep=self.settings.lockstep,
            simulated_time=self.clock if isinstance(self.clock, SimulatedTime) else None,
            chain=self.settings.between,
            transforms=self.settings.transforms,
            truth_in_period=self.settings.truth_in_period,
            origin=origin_pose(self.settings.origin),
            link=self._link,
            fleet=self.settings.fleet,
            neighbours=self.settings.neighbours,
        )
        if isinstance(self._backend, AirBearing):
            self._air = AirBearingWires(self, self._backend, watched=not self.settings.between)
        self._make_loops(self._backend)
        if isinstance(self._backend, Disturbed):
            self._simulation = SimulationWires(
                self,
                self._backend,
                self._pace,
                self._change_rate,
                self.clock,
                lockstep=self.settings.lockstep,
                first=lambda: (first_episode(self.robot, self.settings), self.settings.seed),
            )
            self._backend.moved = lambda: self._feedback.reset()
            self.wires.commands.cuts, self.health.simulation = self._backend.cuts, self._simulation.values
        identity = identity_of(
            self,
            started_ns=self._started_ns,
            robot=self.settings.robot,
            task=self.settings.task,
            control_hz=self.settings.control_rate(self.robot),
            rate=self.settings.rate,
        )
        self.health.open(self, identity)
        self._info = RobotInfoWire(self, self.robot, self.settings, self.guard, started_ns=self._started_ns)
        return DONE

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start the loop, from the safe command on."""
        assert self._backend is not None
        self._stop.clear()
        with self.wires.lock:
            self.guard.reset()
        self.wires.commands.listening = True
        self._make_loops(self._backend)
        self.health.mode = "waiting"
        settle_memory()
        self._thread = threading.Thread(target=self._run, args=(self._backend,), name="plant", daemon=True)
        self._thread.start()
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop the loop and bring the actuators to their safe state."""
        self._halt()
        self._make_safe()
        self.health.mode = "inactive"
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop, make safe, and destroy the backend and every endpoint."""
        self._dismantle()
        return DONE

    # From whatever state, and after an error too: actuators are never left as they are.
    on_shutdown = on_error = on_cleanup

    def bring_down(self, cut_short: Callable[[], bool]) -> None:
        """Let the safe controller of an aircraft in flight bring it to the ground, before the process ends.

        Returns at once for what can stop, what is on the ground, what an autopilot flies on, and in lock step, where
        time stands still.

        Args:
            cut_short: Whether the process has been asked once more to end.
        """
        rests = self.robot.kind.rests or isinstance(self._backend, TakesEnds)
        if rests or self.settings.lockstep or self.health.mode != "running":
            return
        self.get_logger().warning(
            f"asked to end in flight: the safe controller flies down, within {LANDS_S:g} s; asked again, the plant ends"
        )
        with self.wires.lock:
            self.guard.hand_over(time.monotonic_ns())
        self.health.publish()
        until_s = blind_s = time.monotonic() + LANDS_S
        while self.health.mode == "running" and self.guard.doing != DOWN:
            now_s = time.monotonic()
            blind_s = min(blind_s, now_s + BLIND_S) if self.guard.doing == BLIND else until_s
            if cut_short() or now_s > min(until_s, blind_s):
                return
            time.sleep(LOOK_S)

    def stop(self) -> int:
        """Publish the safe command several times before the process ends.

        Returns:
            Exit code: 2 where the last configuration was refused for a mistake in a file.
        """
        self._halt()
        if self._backend is not None:
            try:
                self._make_safe()
            finally:
                self._backend.close()
                if self._air is not None:
                    self._air.publish()
        return self._exit_code

    def run_episode(self, episode: Episode, *, number: int, seed: int, steps: int, on_step: OnStep) -> None:
        """Run control steps of an episode in lock step, from the caller's thread, on a configured node.

        Raises:
            LockstepError: If the controller does not answer in time.
        """
        assert self._backend is not None
        sample = self._backend.reset(episode, seed=seed, number=number)
        if self._link is not None:
            self._link.begin(seed, number)
        with self.wires.lock:
            self.guard.reset()  # actuators begin with the episode, not where the one before left them
            self.guard.begin_with(episode.command)
        self._feedback.reset()
        self._lockstep.run(sample, steps, self._stop, on_step)

    def fly_on(self, sample: Sample, *, ticks: int, stop: threading.Event, on_step: OnStep) -> None:
        """Go on from the last sample of `run_episode` once its controller has ended; see `UnansweredLoop`."""
        assert self._backend is not None
        UnansweredLoop(self._backend, self.wires, self.guard, self.clock).run(sample, ticks, stop, on_step)

    def _clock_is_taken(self) -> bool:
        """Whether another node publishes the clock already; logs that ours is left out then."""
        others = other_clocks(self, since_s=self._made_s, within_s=BRIEFLY_S)
        if others:
            self.get_logger().warning(
                f"{others[0]} publishes {CLOCK.name} already: this plant leaves it out. Its own nodes do not need it; "
                "nodes with use_sim_time follow the other one."
            )
        return bool(others)

    def _motion_capture(self) -> MakeCapture | None:
        """Source of poses: in the place of the odometry for an estimator, or beside it at a rate of its own."""
        settings = self.settings
        if not (settings.estimated and settings.captured) and not settings.mocap_hz:
            return None
        return capture_maker(
            self.robot,
            rate_hz=settings.mocap_hz,
            late_s=settings.mocap_late_s,
            rate=settings.rate,
            lockstep=settings.lockstep,
        )

    def _make_loops(self, backend: Backend) -> None:
        """New loops with new counts and deadlines."""
        self._feedback = ActuatorFeedback(self.robot, moves=self.settings.publishes_odometry)
        kind = LinkLoop if self._link else ChainLoop if self.settings.between else LockstepLoop
        self._pace.pause(False)
        if self._simulation is not None:
            self._simulation.begin_anew()
        self._lockstep = kind(
            backend,
            self.wires,
            self.guard,
            self.clock,
            control_hz=self.settings.control_rate(self.robot),
            answer_timeout_s=self.settings.answer_timeout_s,
            publish_bearing=self._air.publish_and_wait if self._air else lambda: None,
            feedback=self._feedback,
            pace=self._pace,
        )
        self._realtime = RealtimeLoop(
            backend,
            self.wires,
            self.guard,
            self.clock,
            rate=self.settings.rate,
            feedback=self._feedback,
            pace=self._pace,
        )  # fmt: skip
        realtime = None if self.settings.lockstep else self._realtime
        self.health.watch(self.guard, self.wires, self.clock, self._lockstep, realtime)
        self.health.feedback = self._feedback
        if self._link is not None:
            self.health.link = self._link.values

    def _change_rate(self, rate: float) -> str:
        return "lock step has no rate" if self.settings.lockstep else self._realtime.change_rate(rate)

    def _halt(self) -> None:
        self._stop.set()
        if self._thread is not None:
            self._thread.join(PATIENCE_S)
            self._thread = None
        if self._backend is not None:
            self.wires.end_capture()

    def _dismantle(self) -> None:
        self.stop()
        if self._backend is not None:
            self._backend = None
            self.health.close(self)  # first: it looks at the wires
            if self._simulation is not None:
                self._simulation.destroy()
                self._simulation = None
            if self._air is not None:
                self._air.destroy(self)
                self._air = None
            self._info.destroy(self)
            self.wires.destroy(self)

    def _run(self, backend: Backend) -> None:
        try:
            self._wait_for_subscribers()
            self.health.mode = "running"
            episode = first_episode(self.robot, self.settings)
            sample = backend.reset(episode, seed=self.settings.seed)
            self.clock.advance(sample.more_ticks * self.robot.timing.physics_dt)
            if self._link is not None:
                self._link.begin(self.settings.seed)
            if self._simulated:
                with self.wires.lock:
                    self.guard.begin_with(episode.command)
            if self.settings.lockstep:
                steps = self._count(1.0 / self.settings.control_rate(self.robot))
                self._lockstep.run(sample, steps, self._stop)
            else:
                # What ends in the air falls; a simulated one is put back at its next start, and an autopilot flies on.
                lands = not (self.robot.kind.rests or self._simulated or isinstance(backend, TakesEnds))
                ticks = self._count(self.robot.timing.physics_dt)
                self._realtime.run(sample, ticks, self._stop, lands=lands)
            self.health.mode = "stopping"
            self.wires.commands.listening = False  # from here on no command is due
            self._make_safe()
            self.health.mode = "inactive" if self._stop.is_set() else "finished"
        except FulmarError as error:
            self._fail(str(error))
        except Exception as error:  # noqa: BLE001 - whatever a backend raises must close the actuators
            self._fail(f"{type(error).__name__}: {error}")

    def _yield_to_older(self, message: DiagnosticArray) -> None:
        """End where an older plant of our name lives that discovery reported late; a younger one ends itself."""
        others = others_in(message, self.get_fully_qualified_name())
        older = [place for began, place in others if began < self._started_ns]
        if older:
            self.get_logger().error(
                f"{older[0]} lives in this ROS domain already. This plant is younger, and ends."
            )
            self._end_watch()
            self._request_exit(FAILED)

    def _end_watch(self) -> None:
        """Look for older plants no more."""
        self._twin_timer.cancel()
        destroy_all(self, [self._twin_reports])

    def _count(self, dt: float) -> int | None:
        """Number of steps of `dt` [s] within the duration; None for no end."""
        return round(self.settings.duration_s / dt) if self.settings.duration_s > 0.0 else None

    def _wait_for_subscribers(self) -> None:
        if not self.settings.wait_for_subscribers:
            return
        while self.wires.subscribers() < self.settings.wait_for_subscribers and not self._stop.wait(0.01):
            pass
        self._stop.wait(SETTLE_S)

    def _fail(self, reason: str) -> None:
        self.health.mode, self.health.reason = "fault", reason
        self.get_logger().error(reason)
        try:
            self._make_safe()
        except Exception as error:  # noqa: BLE001 - a broken backend must not keep the process alive
            self.get_logger().error(f"the backend could not be made safe: {type(error).__name__}: {error}")
        finally:
            self.health.publish()
            self._request_exit(FAILED)

    def _make_safe(self) -> None:
        assert self._backend is not None
        self.wires.commands.expect_no_answers()
        try:
            self._backend.make_safe()
        finally:
            for _ in range(SAFE_REPEATS):
                self.wires.publish_applied(self.robot.actuators.safe_command, self.clock.now_ns)
            self.wires.flush()
