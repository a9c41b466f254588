"""Publishers and subscriptions of a controller: one object for every wire on its side."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.lifecycle import LifecycleNode
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, String
from visualization_msgs.msg import MarkerArray

from fulmar_core.estimators.actuator_health.thruster_health import can_estimate_health
from fulmar_core.loop.swap_request import SwapResult
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.topics import (
    ACTION,
    ACTUATORS_HEALTH,
    ACTUATORS_STATE,
    AIR_BEARING,
    BELIEVED,
    ESTOP,
    ESTOP_RELEASED,
    FLEET_ESTOP,
    METADATA,
    NEIGHBOURS,
    OBSERVATION,
    OBSTACLES,
    ODOMETRY,
    OPERATOR_ACTION,
    STATUS,
    SWAP,
    SWAP_RESULT,
    VELOCITY_COMMAND,
    Wire,
    command_wire,
    goal_wires,
)
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import Task
from fulmar_ros.convert import OdometryWriter, TwistWriter, VectorWriter
from fulmar_ros.goal_givers import GoalGivers
from fulmar_ros.goal_messages import TYPES, GoalMessage
from fulmar_ros.health import Health
from fulmar_ros.operator_subscription import destroy_all, subscribe_every
from fulmar_ros.parameters import name_of, own_frames
from fulmar_ros.qos import FLUSH_S, LAST_WORDS_S, flush, publish_patiently, publisher_qos, subscriber_qos
from fulmar_ros.relay import Receive, Relay, RelayedInputs

APPLIED_DEPTH = 50  # states of the actuators that may wait while this process does something else


class ControllerWires:
    """Publishers and subscriptions of a controller node; callbacks go to their owner."""

    def __init__(
        self,
        node: LifecycleNode,
        robot: Robot,
        task: Task,
        observation_names: tuple[str, ...],
        *,
        on_odometry: Callable[[bytes], None],
        on_goal: Callable[[GoalMessage, dict[str, int]], None],
        on_obstacles: Callable[[MarkerArray], None],
        on_thing: Callable[[str, PoseStamped], None],
        on_estop: Callable[[Bool], None],
        on_estop_released: Callable[[String], None],
        on_swap: Callable[[String], None],
        on_applied: Callable[[bytes], None],
        on_bearing: Callable[[Bool], None] | None,
        believes: bool,
        lockstep: bool,
        goals_streamed: bool = False,
        on_neighbours: Callable[[JointState], None] | None = None,
        fleet: bool = False,
    ) -> None:
        """Create every endpoint.

        Args:
            node: Owner of the endpoints.
            robot: The robot.
            task: Has the topic of the goals.
            observation_names: Of the terms that the controller observes.
            on_odometry: Receives odometry, serialised.
            on_goal: Receives every goal, with the info of its message.
            on_obstacles: Receives all obstacles whenever they change.
            on_thing: Receives the name of a thing and its pose.
            on_estop: Receives whether the e-stop is pressed.
            on_estop_released: Receives each reset of the e-stop.
            on_swap: Receives each request to change the controller.
            on_applied: Receives what the actuators do, serialised.
            on_bearing: Receives whether the air bearing is on; None where there is none.
            believes: Whether a controller has an observer whose state is published.
            lockstep: Ask for lost odometry again, since the plant waits, and wait for readers that lag behind.
            goals_streamed: A goal comes with each odometry.
            on_neighbours: Receives where the other robots of a fleet are; None: nothing depends on it.
            fleet: Whether the e-stop of a fleet counts, too.
        """
        wire = command_wire(robot)
        qos = partial(publisher_qos, lockstep=lockstep)
        self._publish = publish_patiently if lockstep else Publisher.publish
        self._flush_s = FLUSH_S if lockstep else LAST_WORDS_S
        self._by_velocity = wire is VELOCITY_COMMAND
        kind = TwistStamped if self._by_velocity else JointState
        self._command = node.create_publisher(kind, wire.name, qos(wire))
        self._observation = node.create_publisher(JointState, OBSERVATION.name, qos(OBSERVATION))
        self._action = node.create_publisher(JointState, ACTION.name, qos(ACTION))
        self._health = None
        if can_estimate_health(robot):
            self._health = node.create_publisher(JointState, ACTUATORS_HEALTH.name, qos(ACTUATORS_HEALTH))
        self._believed = node.create_publisher(Odometry, BELIEVED.name, qos(BELIEVED)) if believes else None
        self._metadata = node.create_publisher(String, METADATA.name, publisher_qos(METADATA))
        self._swapped = node.create_publisher(String, SWAP_RESULT.name, publisher_qos(SWAP_RESULT))
        status = node.create_publisher(DiagnosticArray, STATUS.name, publisher_qos(STATUS))
        self.health = Health(node, f"{name_of(node, robot)}: controller", status)
        self._actuators, self._frames = robot.actuators, own_frames(node, robot)
        streams = (self._command, self._observation, self._action, self._health, self._believed)
        self._streams = [publisher for publisher in streams if publisher is not None]
        self._publishers = (*self._streams, self._metadata, self._swapped, *self.health.publishers)
        self._write_command = self._command_writer()
        self._newest: bytes | None = None
        self._action_size = len(robot.actuators.names)
        self._write_action = VectorWriter(robot.actuators.names)
        self._write_health = VectorWriter(robot.actuators.names)
        self._write_believed = OdometryWriter(None, frame=self._frames.odom, child_frame=self._frames.base)
        self._write_observation = VectorWriter(observation_names, "position")
        odometry_qos = subscriber_qos(ODOMETRY, reliable=lockstep)
        self._node = node
        self._subscriptions: list[list[Subscription]] = []
        # The wires that are subscribed; the values say whether a best-effort publisher is refused.
        self.subscribed: dict[Wire, bool] = {}
        # Subscriptions of what the controller follows, which one node alone may publish.
        self.followed: dict[str, list[Subscription]] = {}
        self.relayed, self._relay = RelayedInputs(node), Relay(node)
        # Before the odometry: of two messages that wait, an executor takes that of the older subscription first.
        if on_bearing is not None:
            self.followed[AIR_BEARING.name] = self._every(Bool, AIR_BEARING, on_bearing)
        if on_neighbours is not None:
            others = subscriber_qos(NEIGHBOURS, reliable=lockstep)
            made = node.create_subscription(JointState, NEIGHBOURS.name, on_neighbours, others)
            self._follow(NEIGHBOURS, made, lockstep=lockstep)
        applied = subscriber_qos(ACTUATORS_STATE, reliable=lockstep, depth=APPLIED_DEPTH)
        made = node.create_subscription(JointState, ACTUATORS_STATE.name, on_applied, applied, raw=True)
        self._follow(ACTUATORS_STATE, made, lockstep=lockstep)
        made = node.create_subscription(Odometry, ODOMETRY.name, on_odometry, odometry_qos, raw=True)
        self._follow(ODOMETRY, made, lockstep=lockstep)
        self._operated(Bool, ESTOP, self._relay.relaying(ESTOP, partial(self._see_estop, on_estop)))
        if fleet:
            self._every(Bool, FLEET_ESTOP, partial(self._see_fleet_estop, on_estop))
        self._every(String, ESTOP_RELEASED, partial(self._see_release, on_estop_released))
        self._every(String, SWAP, on_swap)
        goals = goal_wires(task.goal_topic)
        self.goal_givers = GoalGivers(node, goals, streamed=goals_streamed)
        self.subscribed[OPERATOR_ACTION] = False
        for goal in goals:
            self._operated(TYPES[goal.name], goal, on_goal)
        if task.sees_obstacles:
            self._operated(MarkerArray, OBSTACLES, lambda message, _info: on_obstacles(message))
        for thing in task.things:
            stream = subscriber_qos(thing.wire, reliable=lockstep)
            on_pose = partial(on_thing, thing.name)
            made = node.create_subscription(PoseStamped, thing.wire.name, on_pose, stream)
            self._follow(thing.wire, made, lockstep=lockstep)

    def _every(
        self, kind: type, wire: Wire, callback: Callable[..., None], *, with_info: bool = False
    ) -> list[Subscription]:
        """Subscribe a wire of which every message counts."""
        made = subscribe_every(self._node, kind, wire, callback, with_info=with_info)
        self._subscriptions.append(made)
        self.subscribed[wire] = False
        return made

    def _see_estop(self, on_estop: Callable[[Bool], None], message: Bool, _info: dict[str, int]) -> None:
        if message.data:
            self.relayed.forget()
        on_estop(message)

    def _see_fleet_estop(self, on_estop: Callable[[Bool], None], message: Bool) -> None:
        if message.data:  # the reset is that of each robot
            self._see_estop(on_estop, message, {})

    def _see_release(self, on_released: Callable[[String], None], message: String) -> None:
        self.relayed.forget()  # what came while the e-stop was pressed is refused, whichever way it comes
        on_released(message)

    def _operated(self, kind: type, wire: Wire, receive: Receive) -> None:
        """Subscribe a wire of an operator, also by way of those who received it first."""
        self._every(kind, wire, self.relayed.receiver(kind, wire, receive), with_info=True)

    def _follow(self, wire: Wire, made: Subscription, *, lockstep: bool) -> None:
        self._subscriptions.append([made])
        self.subscribed[wire] = lockstep
        self.followed[wire.name] = [made]

    def _command_writer(self) -> TwistWriter | VectorWriter:
        return TwistWriter(self._frames) if self._by_velocity else VectorWriter(self._actuators.names)

    def subscribers(self) -> int:
        """Matched subscriptions of the command."""
        return int(self._command.get_subscription_count())

    def state_published(self) -> bool:
        """Whether a plant publishes what its actuators do."""
        return bool(self._node.count_publishers(ACTUATORS_STATE.name))

    def publish_command(self, command: np.ndarray, stamp: int) -> None:
        """Publish a command that answers the observation of this stamp [ns]."""
        self._newest = self._write_command.raw(command, stamp)
        self._publish(self._command, self._newest)

    def repeat_command(self) -> None:
        """Publish the newest command once more, unless there is none since `forget_command`."""
        if self._newest is not None:
            self._publish(self._command, self._newest)

    def forget_command(self) -> None:
        """Repeat no command until the next one."""
        self._newest = None

    def publish_safe(self, stamp: int) -> None:
        """Publish the safe command; with a message of its own, so that any thread may."""
        self._publish(self._command, self._command_writer().raw(self._actuators.safe_command, stamp))

    def destroy(self, node: LifecycleNode) -> None:
        """Destroy every endpoint."""
        destroy_all(node, self._subscriptions)
        self.goal_givers.destroy(node)
        self.relayed.destroy(node)
        self._relay.destroy(node)
        for publisher in self._publishers:
            node.destroy_publisher(publisher)

    def flush(self) -> None:
        """Wait for a limited time until every subscriber has the last messages."""
        flush(self._streams, self._flush_s)

    def publish_reasoning(self, observation: np.ndarray, action: np.ndarray, stamp: int) -> None:
        """Publish the observation and the action of a command, where they have a subscriber.

        An action with another number of values than the robot has actuators fits no message; the reason for which the
        loop refuses it names its shape.
        """
        if self._observation.get_subscription_count():
            self._publish(self._observation, self._write_observation.raw(observation, stamp))
        if len(action) == self._action_size and self._action.get_subscription_count():
            self._publish(self._action, self._write_action.raw(action, stamp))

    @property
    def health_wanted(self) -> bool:
        """Whether the health of the actuators has a subscriber."""
        return self._health is not None and bool(self._health.get_subscription_count())

    def publish_actuators_health(self, effectiveness: np.ndarray, stamp: int) -> None:
        """Publish the estimated effectiveness of each actuator, where `health_wanted`."""
        assert self._health is not None
        self._publish(self._health, self._write_health.raw(effectiveness, stamp))

    @property
    def believed_wanted(self) -> bool:
        """Whether the state that the controller believes has a subscriber."""
        return self._believed is not None and bool(self._believed.get_subscription_count())

    def publish_believed(self, state: RigidBodyState, stamp: int) -> None:
        """Publish the state that the controller acted on, where `believed_wanted`."""
        assert self._believed is not None
        self._publish(self._believed, self._write_believed.raw(state, stamp))

    def publish_metadata(self, text: str) -> None:
        """Publish the metadata of the controller that acts: a JSON object."""
        self._metadata.publish(String(data=text))

    def publish_swap(self, result: SwapResult) -> None:
        """Publish the answer to a request to change the controller."""
        self._swapped.publish(String(data=result.to_text()))
