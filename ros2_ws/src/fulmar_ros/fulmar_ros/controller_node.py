"""The node that owns a controller: one class for policies and classical laws."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from functools import partial

import numpy as np
from geometry_msgs.msg import PoseStamped
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, String
from visualization_msgs.msg import MarkerArray

from fulmar_core.config.errors import FAILED, FulmarError, TaskError
from fulmar_core.controllers.controller import Controller, Inputs
from fulmar_core.estimators.actuator_health.applied import AppliedHistory
from fulmar_core.estimators.actuator_health.beliefs import DEAD, Beliefs
from fulmar_core.loop.control_loop import readings_for
from fulmar_core.loop.controller_settings import ControllerSettings
from fulmar_core.loop.fallback import Standby
from fulmar_core.loop.guarded_loop import GuardedLoop
from fulmar_core.loop.swap_request import SwapRequest
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import ODOMETRY
from fulmar_core.safety.arbiter import Decision, Mode
from fulmar_core.safety.estop import EstopMonitor
from fulmar_core.safety.input_gate import Measurement
from fulmar_core.tasks import load_task
from fulmar_ros.actuator_beliefs import ActuatorBeliefs
from fulmar_ros.controller_loading import ControllerLoader, MakeController
from fulmar_ros.controller_status import PERIOD_S, ControllerStatus
from fulmar_ros.controller_swap import ControllerSwap
from fulmar_ros.controller_wires import ControllerWires
from fulmar_ros.convert import OdometryReader, VectorReader
from fulmar_ros.deadline import ControlBeat
from fulmar_ros.envelope_wire import EnvelopeWire
from fulmar_ros.fallback import controllers_of
from fulmar_ros.goal_messages import GoalMessage
from fulmar_ros.graph import WireWatch, WriterWatch
from fulmar_ros.mission_inputs import MissionInputs
from fulmar_ros.neighbour_messages import NeighbourInputs
from fulmar_ros.node_identity import identity_of
from fulmar_ros.parameters import name_of, own_frames, read_parameters
from fulmar_ros.qos import SAFE_REPEATS
from fulmar_ros.reading_inputs import ReadingInputs
from fulmar_ros.runtime import RequestExit, settle_memory
from fulmar_ros.while_configured import while_configured

DONE, REFUSED = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE


class ControllerNode(LifecycleNode):
    """Turns odometry and a goal into commands, by the clock or in lock step with a simulator."""

    def __init__(
        self,
        make_controller: MakeController,
        request_exit: RequestExit,
        *,
        cli_args: list[str] | None = None,
    ) -> None:
        """Read the parameters and, unless `autostart` is off, start.

        Args:
            make_controller: Loads the controller; called at configuration.
            request_exit: Ends the process.
            cli_args: ROS arguments of this node alone, where it shares a process.

        Raises:
            FulmarError: If a parameter, a configuration file or a policy is wrong.
        """
        super().__init__("controller", cli_args=cli_args)
        self.settings = read_parameters(self, ControllerSettings)
        self.robot = load_robot(self.settings.robot)
        self.task = load_task(self.settings.task, self.settings.thing)
        self._make_controller, self._request_exit = make_controller, request_exit
        self._sending = threading.Lock()  # held from the look at whether commands may go out until one has
        hz = self.settings.control_rate(self.robot)
        self.guard: GuardedLoop | None = None  # while configured
        self._estop = EstopMonitor(required=self.settings.estop)  # a press outlives a new configuration
        self._loader = ControllerLoader(make_controller, self.robot, self.task, self.settings)
        self._swap = ControllerSwap(
            self._load,
            propose=lambda candidate: self._guarded.switch.propose(candidate),
            warn=self.get_logger().warning,
            answer=lambda result: self.wires.publish_swap(result),
        )
        self._names, self._safe = self.robot.actuators.names, self.robot.actuators.safe_command
        frames = own_frames(self, self.robot)
        self._mission_inputs = MissionInputs(
            frames, self.get_logger().warning, refuses_old_goals=self.settings.unattended
        )
        self._read_odometry, self._read_applied = OdometryReader(frames), VectorReader(self._names)
        self._neighbours = NeighbourInputs(self.settings.others)
        self._late: Measurement | None = (
            None  # waits in lock step for the things or the goal of the same stamp
        )
        self._pause_ns = self.settings.pause_ns(self.robot)
        self._applied = AppliedHistory(self.settings.hold_ns(self.robot))
        self._actuator_beliefs = ActuatorBeliefs(self.robot, self.settings, self._applied)
        self._beliefs = Beliefs()
        self._beat = ControlBeat(
            1.0 / (hz * self.settings.rate), rate=self.settings.rate, copies=self.settings.copies
        )
        identity = identity_of(
            self,
            started_ns=time.time_ns(),
            robot=self.settings.robot,
            task=self.settings.task,
            control_hz=hz,
            rate=self.settings.rate,
        )
        self._status = ControllerStatus(self._swap, identity, goals_streamed=self.settings.goals_streamed)
        if self.settings.autostart:
            for transition in (self.trigger_configure, self.trigger_activate):
                if transition() != DONE:
                    raise FulmarError(self._refusal)

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Load, validate and warm up the controller; refuse it if anything is wrong."""
        try:
            switch = controllers_of(
                self._make_controller, self.robot, self.task, self.settings, self.get_logger().error
            )
            self._readings = ReadingInputs(
                self,
                self.robot,
                readings_for(self.robot, self.task, [each.controller for each in switch.known]),
                self._go_on,
                frames=own_frames(self, self.robot),
                lockstep=self.settings.lockstep,
            )
        except (FulmarError, ImportError) as error:
            self._refusal = str(error)
            self.get_logger().error(f"not configured: {error}")
            return REFUSED
        self.guard = GuardedLoop(
            self.robot, self.task, self.settings, switch, self._estop, applied=self._applied
        )
        self.wires = ControllerWires(
            self,
            self.robot,
            self.task,
            self.guard.loop.observer.names,
            on_odometry=self._on_odometry,
            on_goal=self._on_goal,
            on_obstacles=self._on_obstacles,
            on_thing=self._on_thing,
            on_estop=self._on_estop,
            on_estop_released=self._on_estop_released,
            on_swap=self._on_swap,
            on_applied=self._on_applied,
            on_bearing=self._on_bearing if self.settings.has_bearing(self.robot) else None,
            believes=any(each.controller.observer is not None for each in switch.known),
            lockstep=self.settings.lockstep,
            goals_streamed=self.settings.goals_streamed,
            on_neighbours=self._on_neighbours if self._keeps_apart else None,
            fleet=self.settings.fleet,
        )
        envelope = self.guard.loop.envelope
        self._envelope_wire = None
        if envelope is not None and envelope.watches:
            self._envelope_wire = EnvelopeWire(self, name_of(self, self.robot), envelope)
        self.wires.publish_metadata(switch.current.metadata)
        self._wire_watch = WireWatch(self, self.wires.subscribed | self._readings.subscribed)
        followed = self.wires.followed | self._readings.followed
        self._writer_watch = WriterWatch(self, followed, restarted=self._readings.images)
        # Lock step has no beat of its own; a wall-clock timer keeps the status alive between messages.
        self._status_timer = self.create_timer(PERIOD_S / 4, self._publish_idle_status)
        return DONE

    @property
    def controller(self) -> Controller:
        """The controller that acts."""
        return self._guarded.loop.controller

    @property
    def _guarded(self) -> GuardedLoop:
        assert self.guard is not None, "the node is not configured"
        return self.guard

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Begin to answer, from fresh measurements on; not while the controller still hangs from the last time."""
        if self._beat.hangs:
            self._refusal = "the controller still hangs in the step that it was in when it was deactivated"
            self.get_logger().error(f"not activated: {self._refusal}")
            return REFUSED
        self._guarded.activate()
        self._beat.renew()
        settle_memory()
        if not self.settings.lockstep:
            self._beat.start(self._step, lambda: self._send(self.wires.repeat_command), self._fail)
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Answer no more; the last word is the safe command."""
        self._fall_silent()
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Let go of the controller and every endpoint."""
        self._dismantle()
        return DONE

    # From whatever state, and after an error too: no command is left standing.
    on_shutdown = on_error = on_cleanup

    def stop(self) -> None:
        """Last words before the process ends: the safe command, several times, and the figures of the run."""
        if self.guard is not None:
            self._fall_silent()
            self._status.repeat()
            self._publish_status()

    def _fall_silent(self) -> None:
        self._guarded.set(activated=False)
        self._beat.halt()
        newest = self._guarded.newest
        with self._sending:
            for _ in range(SAFE_REPEATS):
                self.wires.publish_safe(newest.stamp_ns if newest else 0)
        self.wires.flush()

    def _dismantle(self) -> None:
        if self.guard is not None:
            self._fall_silent()
            self.guard = None
            self.destroy_timer(self._status_timer)
            self._readings.destroy(self)
            self.wires.destroy(self)
            if self._envelope_wire is not None:
                self._envelope_wire.destroy()

    def _on_estop(self, message: Bool) -> None:
        self._estop.receive(bool(message.data), time.monotonic_ns())
        self._publish_status()

    def _on_estop_released(self, _message: String) -> None:
        self._mission_inputs.goal_age.reset()
        self._estop.release(time.monotonic_ns())
        self._publish_status()

    @while_configured
    def _on_swap(self, message: String) -> None:
        self._swap.ask(message.data)
        self._publish_status()  # at once: an operator repeats the request until then

    def _load(self, request: SwapRequest) -> Standby:
        return self._loader.load(request, self._guarded.switch, self._readings.newest.kinds)

    def _announce(self) -> None:
        """Publish the identity of the controller that acts from now on; estimates begin anew."""
        self._actuator_beliefs.forget_estimate()
        self._beliefs = Beliefs()
        self.wires.publish_metadata(self._guarded.switch.current.metadata)

    @while_configured
    def _on_goal(self, message: GoalMessage, info: dict[str, int]) -> None:
        self._mission_inputs.take_goal(self._guarded, message, info)
        self._publish_status()
        self._go_on()

    @while_configured
    def _on_obstacles(self, message: MarkerArray) -> None:
        if self._mission_inputs.take_obstacles(self._guarded, message):
            self._publish_status()

    @while_configured
    def _on_thing(self, name: str, message: PoseStamped) -> None:
        if self._mission_inputs.take_thing(self._guarded, name, message):
            self._go_on()

    @while_configured
    def _on_applied(self, data: bytes) -> None:
        applied = self._read_applied.read(data)
        names = self._names
        if applied is not None and tuple(applied.names) == names and len(applied.values) == len(names):
            self._applied.add(applied.stamp_ns, np.array(applied.values))
        self._go_on()

    @while_configured
    def _on_bearing(self, message: Bool) -> None:
        self._guarded.take_bearing(bool(message.data))
        self._publish_status()
        self._go_on()

    @property
    def _keeps_apart(self) -> bool:
        """Whether a guard keeps the robot apart from others."""
        return self._guarded.loop.keep_apart is not None

    @while_configured
    def _on_neighbours(self, message: JointState) -> None:
        self._neighbours.take(message)
        self._go_on()

    @while_configured
    def _go_on(self) -> None:
        """Take the odometry that has waited."""
        late, self._late = self._late, None
        if late is not None:
            self._take_odometry(late, again=False)

    @while_configured
    def _on_odometry(self, data: bytes) -> None:
        measurement = self._read_odometry.read(data)
        if measurement is None:
            self.get_logger().warning(f"a message on {ODOMETRY.name} is damaged: {len(data)} bytes, left out")
            return
        # A plant in lock step asks again: what has not come by then got lost.
        again = self._late is not None and self._late.stamp_ns == measurement.stamp_ns
        self._take_odometry(measurement, again=again)

    def _take_odometry(self, measurement: Measurement, *, again: bool) -> None:
        lockstep, awaited, guard = self.settings.lockstep, self.settings.wait_for_subscribers, self._guarded
        if lockstep and awaited and self.wires.subscribers() < awaited:
            return  # the plant asks again
        if lockstep and self._lacks_something_of(measurement.stamp_ns, again=again):
            self._late = measurement
            return
        if lockstep and measurement.stamp_ns == guard.loop.answered_ns:
            self.wires.publish_command(guard.loop.previous[0], measurement.stamp_ns)  # the answer got lost
            return
        self._see_writers()
        usable = guard.take(measurement, time.monotonic_ns())
        if lockstep:
            self._control(measurement)
            return
        if usable:
            self._beat.follow(measurement.stamp_ns)
        self._beat.wake()

    def _lacks_something_of(self, stamp: int, *, again: bool) -> bool:
        """Whether something is on its way in lock step that belongs to a measurement."""
        guard, answered_ns = self._guarded, self._guarded.loop.answered_ns
        if guard.mission.lacks_something_of(stamp) or not guard.bearing_known:
            return True
        if self._keeps_apart and self._neighbours.stamp_ns < stamp:
            return True
        reads = bool(self._readings.subscribed)
        if reads and answered_ns < 0 and self._readings.lacks_the_first(again=again):
            return True
        if reads and not again and self._readings.lacks_something_of(stamp):
            return True
        if again or not guard.loop.estimates or not 0 < stamp - answered_ns <= self._pause_ns:
            return False
        return self._applied.newest_ns < answered_ns and self.wires.state_published()

    def _step(self) -> None:
        """One beat of the clock."""
        limit = self.settings.overruns_to_stop
        if limit and self._beat.deadlines.late_in_a_row >= limit:
            self._guarded.set(latched_fault=f"{limit} beats in a row came late: this computer is too slow")
        self.wires.forget_command()
        self._control(self._guarded.newest)

    def _control(self, measurement: Measurement | None) -> None:
        """One control step on one measurement: decide, act, publish."""
        guard, stamp = self._guarded, measurement.stamp_ns if measurement else 0
        if guard.switch_controller():
            self._swap.took_over(stamp)
            self._announce()
        if self._readings.subscribed:
            guard.readings = self._readings.newest.at(stamp)
            taken = guard.loop.controller.readings
            guard.set(image_problem=self._readings.newest.image_problem(taken, stamp))
        if self._keeps_apart:
            guard.readings = {**guard.readings, **self._neighbours.at(stamp)}
        command, step, took_ns = self._safe, None, 0
        try:
            decision, inputs = guard.begin_step(measurement, time.monotonic_ns())
            if inputs is not None:
                began_ns = time.perf_counter_ns()
                step = guard.act(inputs)
                took_ns = time.perf_counter_ns() - began_ns
            command = guard.loop.previous[0]
        except TaskError as error:
            self._give_up(str(error), stamp)
            return
        except Exception as error:  # noqa: BLE001 - whatever a controller raises, the robot stops
            guard.loop.rest(stamp)
            self._give_up(f"the controller raised {type(error).__name__}: {error}", stamp)
            return
        speaks = step is not None or decision.mode is not Mode.IDLE
        if speaks and not self._send(partial(self.wires.publish_command, command, stamp)):
            return
        if self._envelope_wire is not None:
            self._envelope_wire.publish()
        self._status.steps += 1
        if inputs is not None and step is not None:
            self._status.inference_ms.add(took_ns / 1e6)
            try:
                guard.watch(inputs, step)
            except Exception as error:  # noqa: BLE001 - as above; the safe command follows that of the controller
                guard.loop.rest(stamp)
                self._give_up(f"progress cannot be seen: {error}", stamp)
                return
            self.wires.publish_reasoning(step.observation[0], step.action.ravel(), stamp)
            self._publish_believed(inputs, stamp)
            self._publish_estimate(stamp)
        self._watch_actuators(measurement, decision)
        if step is not None and guard.note(step.refusal):
            self._announce()
        self._publish_status(decision)

    def _send(self, publish: Callable[[], None]) -> bool:
        """Publish a command, and say so, if commands may still go out.

        What a controller that hung comes up with after all must not follow the safe command of the end.
        """
        with self._sending:
            activated = self.guard is not None and self.guard.flags.activated  # a step may outlive its guard
            if activated:
                publish()
            return activated

    def _publish_believed(self, inputs: Inputs | None, stamp: int) -> None:
        """Publish the state that the controller acted on, where it has an observer of its own."""
        if inputs is not None and inputs.believed is not None and self.wires.believed_wanted:
            self.wires.publish_believed(inputs.believed[0].to_rigid(), stamp)

    def _publish_estimate(self, stamp: int) -> None:
        """Publish the estimate of valves and push that the controller received."""
        estimate = self._guarded.loop.estimate
        if estimate is None:
            return
        health = estimate.health[0]
        self._actuator_beliefs.take_estimate(health)
        if self.wires.health_wanted:
            self.wires.publish_actuators_health(health.effectiveness, stamp)

    def _watch_actuators(self, measurement: Measurement | None, decision: Decision) -> None:
        """Keep what is believed of actuators that measure nothing; one that is stuck open ends a robot's control."""
        if measurement is None:
            return
        guard = self._guarded
        self._beliefs = self._actuator_beliefs.of(
            measurement, epoch=guard.epoch, stands=guard.flags.bearing_off
        )
        dead = [word for word in self._beliefs.warnings if word.endswith(DEAD)]
        guard.suspect(", ".join(dead), hopeless=self._actuator_beliefs.hopeless)
        # A controller that excites a robot is there to learn how far its file is wrong.
        acts = decision.may_act and guard.strives and not guard.flags.latched_fault
        if self._beliefs.open and acts:
            self._fail(f"{self._beliefs.words[0]}. Close its supply.")

    def _give_up(self, reason: str, stamp: int) -> None:
        """Command what is safe; let the fallback go on, or, where there is none, latch a fault and end the process."""
        if not self._send(partial(self.wires.publish_command, self.robot.actuators.safe_command, stamp)):
            return
        if self._guarded.fall_back(reason):
            self.get_logger().error(reason)
            self._announce()
        else:
            self._fail(reason)
        self._publish_status()

    def _fail(self, reason: str) -> None:
        """Latch a fault and end the process; its last words are what is safe."""
        self.get_logger().error(reason)
        self._guarded.set(latched_fault=reason)
        self._request_exit(FAILED)

    @while_configured
    def _publish_idle_status(self) -> None:
        """Publish the status where no control step does it."""
        self.wires.relayed.look()
        self._see_goal_giver()
        self._swap.look()
        self._status.wire_problems = self._wire_watch.look()
        self._see_writers()
        self._status.inputs_refused = self._readings.newest.refused, self._readings.newest.refusal
        flags = self._guarded.flags
        if self.settings.lockstep or not flags.activated or flags.latched_fault:
            self._publish_status()

    def _see_goal_giver(self) -> None:
        """Find out who gave the goal that counts."""
        stamp_ns = self._guarded.mission.goal_stamp_ns
        self.wires.goal_givers.look(stamp_ns)
        self._status.goal_by = self.wires.goal_givers.by(stamp_ns)

    def _see_writers(self) -> None:
        """Follow no odometry while more than one node publishes an input."""
        contested = self._writer_watch.look(time.monotonic_ns())
        self._status.contested = self._writer_watch.alarm
        self._status.two_cameras = self._writer_watch.warning
        if contested != self._guarded.flags.contested:
            self._guarded.contest(contested)

    @while_configured
    def _publish_status(self, decision: Decision | None = None) -> None:
        guard = self._guarded
        self._status.publish(
            self.wires.health,
            decision or guard.decide(time.monotonic_ns()),
            guard,
            self._beat.deadlines,
            beliefs=self._beliefs,
        )
