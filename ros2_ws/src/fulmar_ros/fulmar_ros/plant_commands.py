"""What moves a plant: the commands of its controller, also over a radio link, and those of a person by hand."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence

from geometry_msgs.msg import TwistStamped
from rclpy.lifecycle import LifecycleNode
from rclpy.subscription import Subscription
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from fulmar_core.config.process import CONTROL_PRIORITY, take_priority_with_helpers
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.topics import GIVE_BACK, TELEOP, VELOCITY_COMMAND, Wire, command_wire
from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.simulation.disturbances import COMMANDS
from fulmar_ros.convert import TwistReader, VectorReader
from fulmar_ros.deadline import Spread
from fulmar_ros.graph import writers_of
from fulmar_ros.operator_subscription import destroy_all, subscribe_every
from fulmar_ros.parameters import own_frames
from fulmar_ros.plant_clock import SimulatedTime
from fulmar_ros.plant_link import PlantLink, SentCommand
from fulmar_ros.qos import subscriber_qos
from fulmar_ros.sent_states import SentStates


class PlantCommands:
    """Receives commands and offers them to the guard of a plant.

    Attributes:
        lock: Held while the guard, or what follows here, is touched; notified with each command.
        answered_ns: Stamp of the newest command that was taken [ns]; None before the first.
        answers: States that a command has answered.
        latency_ms: From a state to the command that answers it.
        listening: Whether commands of controllers count.
        cuts: Whether messages of one of `disturbances.SIDES` are lost.
        subscribed: The wires that are subscribed; the values say whether a best-effort publisher is refused.
    """

    def __init__(
        self,
        node: LifecycleNode,
        robot: Robot,
        guard: ActuatorGuard,
        *,
        lockstep: bool,
        knows_ages: bool,
        simulated_time: SimulatedTime | None,
        link: PlantLink | None,
    ) -> None:
        """Create the endpoints.

        Args:
            node: Owner of the endpoints.
            robot: The robot.
            guard: Receives the commands.
            lockstep: Whether the plant waits for the controller's answers. By the clock, without it, a person may take
                the actuators, and commands go before other work.
            knows_ages: Whether commands answer states of this plant's own clock.
            simulated_time: Clock of a simulated plant, by which actuators follow commands.
            link: Between plant and controller; None: commands are not late.
        """
        self._node, self._guard, self._lockstep, self._link = node, guard, lockstep, link
        self._simulated_time, self._knows_ages = simulated_time, knows_ages
        self._awaited_ns = -1  # stamp of the odometry over a link that no command has answered yet
        self._prior = lockstep  # whether the threads that commands pass have what priority they need
        self._sent = SentStates(guard.watchdog.timeout_ns)
        self.lock = threading.Condition()
        self.latency_ms = Spread()
        self.answers = 0
        self.answered_ns: int | None = None
        self.listening = True
        self.cuts: Callable[[str], bool] = lambda _side: False
        # By the clock the newest command counts. A reliable reader would hold it back for seconds while a lost one is
        # sent again.
        wire = command_wire(robot)
        by_velocity, names = wire is VELOCITY_COMMAND, robot.actuators.names
        self._reader = TwistReader(names, own_frames(node, robot)) if by_velocity else VectorReader(names)
        self._commands = node.create_subscription(
            TwistStamped if by_velocity else JointState,
            wire.name,
            self._on_command,
            subscriber_qos(wire, reliable=lockstep),
            raw=True,
        )
        self.subscribed: dict[Wire, bool] = {wire: lockstep}
        self._by_hand: list[Subscription] = []
        if not lockstep:
            self._by_hand = subscribe_every(node, JointState, TELEOP, self._on_teleop)
            self.subscribed[TELEOP] = False
        self._give_back = node.create_service(Trigger, GIVE_BACK, self._on_give_back)

    def destroy(self, node: LifecycleNode) -> None:
        """Destroy every endpoint; a command that is on its way counts no more."""
        self.listening = False
        destroy_all(node, ([self._commands], self._by_hand))
        node.destroy_service(self._give_back)

    def note_sent(self, time_ns: int) -> None:
        """Note that a state of a stamp is sent now, which a command may answer [ns]."""
        with self.lock:
            self._sent.note(time_ns, self.steady_ns)

    def expect_no_answers(self) -> None:
        """Accept and time no more commands that answer what was sent so far."""
        with self.lock:
            self._sent.close()

    def wait_for_answer(self, time_ns: int, timeout_s: float) -> bool:
        """Wait until a command answers the odometry of this stamp; call with `lock` held."""
        return self.lock.wait_for(lambda: self.answered_ns == time_ns, timeout_s)

    def await_answer(self, time_ns: int) -> None:
        """Let the first command that answers the odometry of a stamp go over the link, and no repetition [ns]."""
        with self.lock:
            self._awaited_ns = time_ns

    def take_arrived(self) -> None:
        """Take the commands that the link has carried to the plant by now; call with `lock` held."""
        if self._link is not None:
            for command in self._link.commands.arrived(self.now_ns):
                self._offer(command.names, command.values, command.stamp_ns)

    def see_writers(self) -> None:
        """Report to the guard which nodes publish commands."""
        writers = writers_of(self._node, self._commands)
        with self.lock:
            self._guard.publishers.see(writers, time.monotonic_ns())

    @property
    def steady_ns(self) -> int:
        """Steady clock of watchdog and ages: the plant's own where a link loses commands in lock step [ns]."""
        by_plant = self._link is not None and self._lockstep and self._simulated_time is not None
        return self.now_ns if by_plant else time.monotonic_ns()

    @property
    def now_ns(self) -> int:
        """Time on the plant's clock [ns]."""
        return time.time_ns() if self._simulated_time is None else self._simulated_time.now_ns

    @property
    def _plant_ns(self) -> int | None:
        return None if self._simulated_time is None else self._simulated_time.now_ns

    def _on_command(self, data: bytes) -> None:
        command = self._reader.read(data)
        if command is not None:  # what is damaged feeds no watchdog
            self._take(command.names, command.values, command.stamp_ns)

    def _on_teleop(self, message: JointState) -> None:
        with self.lock:
            self._guard.offer_by_hand(
                message.name, message.effort, time.monotonic_ns(), plant_ns=self._plant_ns
            )

    def _on_give_back(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        with self.lock:
            problem = self._guard.give_back(self.steady_ns)
        response.success, response.message = not problem, problem or "the controller has the robot again"
        return response

    def _take(self, names: Sequence[str], values: Sequence[float], stamp: int) -> None:
        if not self.listening or self.cuts(COMMANDS):
            return
        if not self._prior:
            take_priority_with_helpers(CONTROL_PRIORITY)
            self._prior = True
        self.see_writers()  # before the first command of a second publisher is carried out
        with self.lock:
            if self._link is None:
                if self._offer(names, values, stamp):
                    self.answered_ns = stamp
            elif not self._lockstep or stamp == self._awaited_ns:
                self._link.commands.send(SentCommand(names, values, stamp), self.now_ns)
                self._awaited_ns, self.answered_ns = -1, stamp
            self.lock.notify_all()

    def _offer(self, names: Sequence[str], values: Sequence[float], stamp: int) -> bool:
        """Offer a command that has arrived to the guard; returns whether it was taken."""
        now = self.steady_ns
        outdated = self._knows_ages and self._sent.outdated(stamp, now)
        taken = self._guard.offer(
            names, values, now, stamp_ns=stamp, outdated=outdated, plant_ns=self._plant_ns
        )
        latency_ns = self._sent.answered(stamp, now)
        if taken and latency_ns is not None:
            self.latency_ms.add(latency_ns / 1e6)
            self.answers += 1
        return taken
