"""The node that owns a controller: one class for policies and classical laws."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from functools import partial

import numpy as np
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, String
from visualization_msgs.msg import MarkerArray

from fulmar_core.controllers.controller import Controller
from fulmar_core.errors import FulmarError
from fulmar_core.exit_codes import FAILED
from fulmar_core.health.beliefs import BeliefReader, Beliefs
from fulmar_core.health.observer import AppliedFeed, health_of, report_applied
from fulmar_core.health.thruster_health import can_be_watched
from fulmar_core.observation import slewed
from fulmar_core.robot import load_robot
from fulmar_core.safety.arbiter import Decision, Mode
from fulmar_core.safety.command_gate import command_problem
from fulmar_core.safety.input_gate import Measurement
from fulmar_core.tasks import load_task
from fulmar_ros.control_beat import ControlBeat
from fulmar_ros.controller_inputs import ControllerInputs
from fulmar_ros.controller_settings import ControllerSettings
from fulmar_ros.controller_status import PERIOD_S, ControllerStatus
from fulmar_ros.controller_wires import ControllerWires
from fulmar_ros.goal_messages import GoalMessage
from fulmar_ros.line_up import MakeController, line_up, load_other
from fulmar_ros.message_reader import measurement_of, stamp_ns
from fulmar_ros.parameters import read_parameters
from fulmar_ros.policy_swap import PolicySwap
from fulmar_ros.runtime import RequestExit, settle_memory
from fulmar_ros.standby import Standby
from fulmar_ros.wire_watch import WireWatch

DONE, REFUSED = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE
SAFE_REPEATS = 5


class ControllerNode(LifecycleNode):
    """Turns odometry and a goal into commands, by the clock or in lock step with a simulator."""

    def __init__(
        self,
        make_controller: MakeController,
        request_exit: RequestExit,
        *,
        cli_args: list[str] | None = None,
        learned: bool = False,
    ) -> None:
        """Read the parameters and, unless told otherwise, start.

        Args:
            make_controller: Loads the controller; called at configuration.
            request_exit: Ends the process.
            cli_args: ROS arguments of this node alone, where it shares a process.
            learned: Whether `make_controller` loads a policy, which another may follow while the node runs.

        Raises:
            FulmarError: If a parameter, a configuration file or a policy is wrong.
        """
        super().__init__("controller", cli_args=cli_args)
        self.settings = read_parameters(self, ControllerSettings)
        self.robot = load_robot(self.settings.robot)
        self.task = load_task(self.settings.task)
        self._make_controller, self._request_exit = make_controller, request_exit
        self._speaking = threading.Lock()  # held from the look at whether commands may go out until one has
        hz = self.settings.control_rate(self.robot)
        self.inputs = ControllerInputs(self.robot, self.task, self.settings)
        self._swap = PolicySwap(
            self._load if learned else None,
            propose=lambda candidate: self._succession.propose(candidate),
            warn=self.get_logger().warning,
        )
        self._late: Odometry | None = None  # waits in lock step for the block or the goal of the same stamp
        self._answered_ns, self._answer = -1, self.robot.actuators.safe_command
        self._control_ns = round(1e9 / hz)
        self._pause_ns = self.settings.pause_ns(self.robot)
        self._applied = AppliedFeed(self._pause_ns, self.settings.hold_ns(self.robot))
        self._belief_reader = BeliefReader(self.robot) if can_be_watched(self.robot) else None
        self._beliefs = Beliefs()
        self._beat = ControlBeat(
            1.0 / (hz * self.settings.rate), rate=self.settings.rate, copies=self.settings.copies
        )
        self._status = ControllerStatus(
            self.inputs.mission, self._swap, goals_streamed=self.settings.goals_streamed
        )
        if self.settings.autostart:
            for transition in (self.trigger_configure, self.trigger_activate):
                if transition() != DONE:
                    raise FulmarError(self._refusal)

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Load, validate and warm up the controller; refuse it if anything is wrong."""
        try:
            self._succession = line_up(
                self._make_controller, self.robot, self.task, self.settings, self.get_logger().error
            )
        except (FulmarError, ImportError) as error:
            self._refusal = str(error)
            self.get_logger().error(f"not configured: {error}")
            return REFUSED
        self._applied.forget()
        self.wires = ControllerWires(
            self,
            self.robot,
            self.task,
            self.controller,
            on_odometry=self._on_odometry,
            on_goal=self._on_goal,
            on_obstacles=self._on_obstacles,
            on_block=self._on_block,
            on_estop=self._on_estop,
            on_estop_released=self._on_estop_released,
            on_swap=self._on_swap,
            on_applied=self._on_applied,
            on_bearing=self._on_bearing if self.settings.has_bearing(self.robot) else None,
            lockstep=self.settings.lockstep,
        )
        self.wires.publish_metadata(self._succession.current.metadata)
        self._wire_watch = WireWatch(self, self.wires.subscribed)
        # Lock step has no beat of its own; a wall-clock timer keeps the status alive between messages.
        self._status_timer = self.create_timer(PERIOD_S / 4, self._tell_idle_status)
        self.inputs.set(configured=True, latched_fault="")
        return DONE

    @property
    def controller(self) -> Controller:
        """Whose turn it is."""
        return self._succession.current.controller

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Begin to answer, from fresh measurements on; not while the controller still hangs from the last time."""
        if self._beat.hangs:
            self._refusal = "the controller still hangs in the step that it was in when it was deactivated"
            self.get_logger().error(f"not activated: {self._refusal}")
            return REFUSED
        self.inputs.activate()
        self._beat.renew()
        settle_memory()
        if not self.settings.lockstep:
            self._beat.start(self._step, lambda: self._speak(self.wires.repeat_command), self._fail)
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
        if self.inputs.flags.configured:
            self._fall_silent()
            self._status.repeat()
            self._tell_status(self.inputs.decide())

    def _fall_silent(self) -> None:
        self.inputs.set(activated=False)
        self._beat.halt()
        newest = self.inputs.newest
        with self._speaking:
            for _ in range(SAFE_REPEATS):
                self.wires.publish_safe(newest.stamp_ns if newest else 0)
        self.wires.flush()

    def _dismantle(self) -> None:
        if self.inputs.flags.configured:
            self._fall_silent()
            self.inputs.set(configured=False)
            self.destroy_timer(self._status_timer)
            self.wires.destroy(self)

    def _on_estop(self, message: Bool) -> None:
        self.inputs.hear_estop(message)
        self._tell_status(self.inputs.decide())

    def _on_estop_released(self, _message: String) -> None:
        self.inputs.release_estop()
        self._tell_status(self.inputs.decide())

    def _on_swap(self, message: String) -> None:
        self._swap.ask(message.data)
        self._tell_status(self.inputs.decide())  # at once: who asked repeats it until then

    def _load(self, folder: str) -> Standby:
        return load_other(
            self._make_controller, self.robot, self.task, self.settings, folder, like=self.controller
        )

    def _take_turns(self) -> None:
        """Between two control steps: let a new policy take over, and say so."""
        if self._succession.turn():
            self._swap.took_over()
            self._announce()

    def _announce(self) -> None:
        """Say who controls now; what is known of the actuators begins anew."""
        self._applied.forget()
        self._beliefs = Beliefs()
        self.wires.publish_metadata(self._succession.current.metadata)

    def _on_goal(self, message: GoalMessage) -> None:
        if problem := self.inputs.take_goal(message):
            self.get_logger().warning(f"goal refused: {problem}")
        self._tell_status(self.inputs.decide())
        self._go_on()

    def _on_obstacles(self, message: MarkerArray) -> None:
        if problem := self.inputs.take_obstacles(message):
            self.get_logger().warning(f"obstacles refused: {problem}")
            return
        self._tell_status(self.inputs.decide())

    def _on_block(self, message: PoseStamped) -> None:
        if problem := self.inputs.take_block(message):
            self.get_logger().warning(f"place of the block refused: {problem}")
            return
        self._go_on()

    def _on_applied(self, message: JointState) -> None:
        if tuple(message.name) == self.robot.actuators.names and len(message.effort) == len(message.name):
            self._applied.history.add(stamp_ns(message.header.stamp), np.array(message.effort))
        self._go_on()

    def _on_bearing(self, message: Bool) -> None:
        self.inputs.take_bearing(bool(message.data))
        self._tell_status(self.inputs.decide())
        self._go_on()

    def _go_on(self) -> None:
        """Take the odometry that has waited."""
        late, self._late = self._late, None
        if late is not None:
            self._take_odometry(late, again=False)

    def _on_odometry(self, message: Odometry) -> None:
        # A plant in lock step asks again: what has not come by then got lost.
        again = self._late is not None and self._late.header.stamp == message.header.stamp
        self._take_odometry(message, again=again)

    def _take_odometry(self, message: Odometry, *, again: bool) -> None:
        if self.settings.lockstep and self.wires.subscribers() < self.settings.wait_for_subscribers:
            return  # the plant asks again
        measurement = measurement_of(message)
        if self.settings.lockstep and self._lacks_something_of(measurement.stamp_ns, again=again):
            self._late = message
            return
        if self.settings.lockstep and measurement.stamp_ns == self._answered_ns:
            self.wires.publish_command(self._answer, self._answered_ns)  # the answer got lost
            return
        usable = self.inputs.take(measurement)
        if self.settings.lockstep:
            self._control(measurement)
            return
        if usable:
            self._beat.follow(measurement.stamp_ns)
        self._beat.wake()

    def _lacks_something_of(self, stamp: int, *, again: bool) -> bool:
        """Whether something is on its way in lock step that belongs to a measurement."""
        if self.inputs.mission.lacks_something_of(stamp) or not self.inputs.bearing_known:
            return True
        if again or self._belief_reader is None or not self._applied.lacks(stamp, self._answered_ns):
            return False
        return self.wires.state_published()

    def _step(self) -> None:
        """One beat of the clock."""
        limit = self.settings.overruns_to_stop
        if limit and self._beat.deadlines.late_in_a_row >= limit:
            self.inputs.set(latched_fault=f"{limit} beats in a row came late: this computer is too slow")
        self.wires.forget_command()
        self._control(self.inputs.newest)

    def _control(self, measurement: Measurement | None) -> None:
        """One control step on one measurement: decide, act, publish."""
        self._take_turns()
        stamp = measurement.stamp_ns if measurement else 0
        command, action = self.robot.actuators.safe_command, None
        try:
            with self.inputs.lock:
                decision = self.inputs.arbitrate()
                self._begin_anew()
                observation = self._observe(measurement) if decision.may_act and measurement else None
            if observation is not None:
                command, action, problem = self._act(observation)
        except Exception as error:  # noqa: BLE001 - whatever a controller raises, the robot stops
            self._give_up(f"the controller raised {type(error).__name__}: {error}", stamp)
            return
        speaks = action is not None or decision.mode is not Mode.IDLE
        if speaks and not self._speak(partial(self.wires.publish_command, command, stamp)):
            return
        self._answered_ns, self._answer = stamp, command
        self._status.steps += 1
        if observation is not None and action is not None:
            self.wires.publish_reasoning(observation, action, stamp)
            self._report_health(stamp)
            self._judge(problem)
            self.inputs.acted += 1
        self._tell_status(decision)

    def _speak(self, publish: Callable[[], None]) -> bool:
        """Publish a command, and say so, if commands may still go out.

        What a controller that hung comes up with after all must not follow the safe command of the end.
        """
        with self._speaking:
            if self.inputs.flags.activated:
                publish()
            return self.inputs.flags.activated

    def _begin_anew(self) -> None:
        """Let the controller forget what was before a new goal or a jump; call with the lock held."""
        jumped, anew = self.inputs.news()
        if jumped:
            self._applied.forget()  # no motion of the body was behind it
        if jumped or anew:
            self.controller.reset()

    def _report_health(self, stamp: int) -> None:
        """Publish the estimate of the actuators' health that the controller used; the status says what is wrong."""
        health = health_of(self.controller)
        if self._belief_reader is None or health is None:
            return
        if self.wires.health_wanted:
            self.wires.publish_actuators_health(health.effectiveness, stamp)
        self._beliefs = self._belief_reader.read(health)

    def _observe(self, measurement: Measurement) -> np.ndarray:
        """What the controller sees of a measurement; targets that are reached give way to the next."""
        if measurement.stamp_ns - self._answered_ns > self._pause_ns:
            self._answer = self.robot.actuators.safe_command
            self.controller.reset()
        mission = self.inputs.mission
        observation = mission.observe(measurement.state, measurement.stamp_ns, self._answer)
        report_applied(self.controller, self._applied.since_observation(measurement.stamp_ns))
        return observation

    def _act(self, observation: np.ndarray) -> tuple[np.ndarray, np.ndarray, str | None]:
        """The command, the controller's action that it is made of, and why it is the safe one instead."""
        began = time.perf_counter_ns()
        action = np.asarray(self.controller.act(observation), dtype=float)
        problem = command_problem(action, len(self.robot.actuators.names))
        command = self.robot.actuators.safe_command
        if not problem:
            wanted = self.robot.actuators.limited(action)
            command = slewed(wanted, self._answer, self.robot, self._control_ns / 1e9)
        self._status.inference_ms.add((time.perf_counter_ns() - began) / 1e6)
        return command, action, problem

    def _judge(self, problem: str | None) -> None:
        """Count refused actions: several in a row are the fallback's turn, or a fault."""
        before = self._succession.current
        fault = self._succession.judge(problem)
        if fault:
            self.inputs.set(latched_fault=fault)
        elif self._succession.current is not before:
            self._announce()

    def _give_up(self, reason: str, stamp: int) -> None:
        """Command what is safe; let the fallback go on, or, where there is none, latch a fault and end the process."""
        self._answered_ns, self._answer = stamp, self.robot.actuators.safe_command
        if not self._speak(partial(self.wires.publish_command, self._answer, stamp)):
            return
        if self._succession.fall_back(reason):
            self.get_logger().error(reason)
            self._announce()
        else:
            self._fail(reason)
        self._tell_status(self.inputs.decide())

    def _fail(self, reason: str) -> None:
        """Latch a fault and end the process; its last words are what is safe."""
        self.get_logger().error(reason)
        self.inputs.set(latched_fault=reason)
        self._request_exit(FAILED)

    def _tell_idle_status(self) -> None:
        """Where no control step does it."""
        self._status.wire_problems = self._wire_watch.look()
        if self.settings.lockstep or not self.inputs.flags.activated or self.inputs.flags.latched_fault:
            self._tell_status(self.inputs.decide())

    def _tell_status(self, decision: Decision) -> None:
        self._status.tell(
            self.wires.health,
            decision,
            self._succession,
            self._beat.deadlines,
            epoch=self.inputs.epoch,
            last_input_ns=self.inputs.flags.last_input_ns,
            refusal=self.inputs.refusal,
            beliefs=self._beliefs,
        )
