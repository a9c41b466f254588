"""The console's node: finds robots, and receives what they publish without being counted before they run."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription
from sensor_msgs.msg import Image as RosImage
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from visualization_msgs.msg import MarkerArray

from fulmar_bags.message_reader import goal_of, obstacles_of, stamp_ns
from fulmar_console.live.camera_images import CameraImages, RawImage
from fulmar_console.live.fleet import Fleet
from fulmar_console.live.places import AT_ORIGIN
from fulmar_console.live.robot_state import RobotState
from fulmar_console.live.wire_bytes import JointReader, UnreadableError, read_odometry
from fulmar_core.robots.topics import (
    ACTUATORS_STATE,
    CAMERA_IMAGES,
    DIAGNOSTICS,
    ENVELOPE_STATE,
    OBSTACLES,
    ODOMETRY,
    ROBOT_INFO,
    SIMULATION_EVENT,
    STATUS,
    goal_wires,
    thing_wire,
)
from fulmar_core.wires.robot_name import check_robot_name, frames_of, namespace_of
from fulmar_ros.goal_messages import TYPES, GoalMessage
from fulmar_ros.operator_subscription import destroy_all, subscribe_every
from fulmar_ros.qos import subscriber_qos
from fulmar_ros.relay import Relay

LOOK_S = 0.25  # between two looks at the graph for robots that have come or gone
BEAT_S = 0.05  # between two signs of life of this thread
STATE_S = 0.04  # between two looks at poses and actuators
AT_ONCE = 30  # states of actuators that may wait, so that no short pulse is missed
INFO_S = 3.0  # for a description to come, before a robot is shown without one
LEVELS = {DiagnosticStatus.OK: "ok", DiagnosticStatus.WARN: "warn"}


class RosSide:
    """Receives for every robot of the domain.

    Attributes:
        alive_s: When the executor came by last, by the monotonic clock [s].
        images: Images of cameras that a page looks at.
    """

    def __init__(self, node: Node, fleet: Fleet) -> None:
        """Listen with a node that spins, or will."""
        self._node, self._fleet = node, fleet
        # Never spun: what it subscribes is taken at the pace of the page, whatever the pace of a plant.
        self._quiet = Node(
            f"{node.get_name()}_states",
            context=node.context,
            start_parameter_services=False,
            enable_rosout=False,
        )
        self._states: dict[str, list[tuple[Subscription, Callable[[bytes], None]]]] = {}
        self.alive_s = time.monotonic()
        self.images = CameraImages()
        self._received: dict[str, list[Any]] = {}  # subscriptions of a robot that runs
        self._found_s: dict[str, float] = {}
        self._infos: set[str] = set()  # namespaces whose description is subscribed
        self._cameras: dict[tuple[str, int], Subscription] = {}
        subscribe_every(node, DiagnosticArray, DIAGNOSTICS, self._on_diagnostics)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(LOOK_S, self._look, clock=steady)
        node.create_timer(BEAT_S, self._beat, clock=steady)
        node.create_timer(STATE_S, self._take_states, clock=steady)
        self._look()

    def _beat(self) -> None:
        self.alive_s = time.monotonic()

    def _look(self) -> None:
        """Subscribe the descriptions of robots that have come; latched, so that nothing is missed."""
        ends = f"/{ROBOT_INFO.name}"
        for topic, _ in self._node.get_topic_names_and_types():
            if topic.endswith(ends):
                self._learn(topic.removesuffix(ends).removeprefix("/"))
        for name, robot in list(self._fleet.robots.items()):
            self._learn(name)
            # A plant that is started anew counts its subscribers again: of one that has died there is none.
            if name in self._received and robot.plant.silent:
                self._leave(name)

    def _learn(self, name: str) -> None:
        if name in self._infos or not _is_name(name):
            return
        self._infos.add(name)
        topic = f"{namespace_of(name)}/{ROBOT_INFO.name}"
        receive = partial(self._on_info, name)
        self._node.create_subscription(String, topic, receive, subscriber_qos(ROBOT_INFO))

    def _on_info(self, name: str, message: String) -> None:
        try:
            info = json.loads(message.data)
            fits = info["name"] == name and isinstance(info["type"], str) and isinstance(info["goal"], dict)
            fits = fits and len(tuple(map(float, info.get("origin", AT_ORIGIN)))) == len(AT_ORIGIN)
        except (ValueError, KeyError, TypeError, RecursionError):
            fits = False
        if not fits:
            self._node.get_logger().warning(
                f"{name}/{ROBOT_INFO.name} does not describe {name}: it is left out"
            )
            return
        robot = self._fleet.find(name)
        if robot is None:
            return
        with self._fleet.lock:
            if robot.see_info(info):
                self._leave(name)
            self._fleet.changed()

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            name, separator, node = status.name.rpartition(": ")
            if not separator or not _is_name(name) or (node != "plant" and name not in self._fleet.robots):
                continue
            robot = self._fleet.find(name)
            if robot is None:
                continue
            self._found_s.setdefault(name, time.monotonic())
            if (
                node != "controller" or robot.controller.silent
            ):  # whose status comes on a wire of its own, too
                self._see(robot, node, status)
            if not robot.running:
                self._leave(name)
            elif name not in self._received and self._is_known(robot):
                self._receive(robot)

    def _is_known(self, robot: RobotState) -> bool:
        """Whether what it publishes is known, or will not be."""
        return robot.info is not None or time.monotonic() - self._found_s[robot.name] > INFO_S

    def _see(self, robot: RobotState, node: str, status: DiagnosticStatus) -> None:
        values = {pair.key: pair.value for pair in status.values}
        with self._fleet.lock:
            robot.see_report(node, LEVELS.get(status.level, "error"), status.message, values)

    def _receive(self, robot: RobotState) -> None:
        """Subscribe what a robot publishes, now that its plant runs and counts subscribers no more."""
        node, space = self._node, namespace_of(robot.name)
        made: list[Any] = []
        self._received[robot.name] = made

        def state(kind: type, wire: Any, callback: Callable[[bytes], None], depth: int) -> None:
            qos = subscriber_qos(wire, reliable=False, latched=False, depth=depth)
            topic = f"{space}/{wire.name}"
            subscription = self._quiet.create_subscription(kind, topic, callback, qos, raw=True)
            self._states.setdefault(robot.name, []).append((subscription, callback))

        def newest(kind: type, wire: Any, callback: Callable[..., None]) -> None:
            qos = subscriber_qos(wire, reliable=False, latched=False)
            made.append([node.create_subscription(kind, f"{space}/{wire.name}", callback, qos)])

        def every(kind: type, wire: Any, callback: Callable[..., None], *, with_info: bool = False) -> None:
            topic = f"{space}/{wire.name}"
            made.append(subscribe_every(node, kind, wire, callback, topic=topic, with_info=with_info))

        state(Odometry, ODOMETRY, partial(self._on_odometry, robot), 1)
        state(JointState, ACTUATORS_STATE, partial(self._on_applied, robot, JointReader()), AT_ONCE)
        for name in (robot.info or {}).get("things", ()):
            newest(PoseStamped, thing_wire(name), partial(self._on_thing, robot, name))
        every(DiagnosticArray, STATUS, partial(self._on_status, robot))
        every(DiagnosticArray, ENVELOPE_STATE, partial(self._on_envelope, robot))
        every(String, SIMULATION_EVENT, partial(self._on_simulation, robot))
        relay = Relay(node)
        topic = (robot.info or {}).get("goal", {}).get("topic", "goal_pose")
        for wire in goal_wires(topic):
            every(TYPES[wire.name], wire, relay.relaying(wire, partial(self._on_goal, robot)), with_info=True)
        seen = relay.relaying(OBSTACLES, partial(self._on_obstacles, robot))
        every(MarkerArray, OBSTACLES, seen, with_info=True)

    def _leave(self, name: str) -> None:
        """Receive no more of a robot whose plant is not running: it may be started anew, and count again."""
        made = self._received.pop(name, None)
        if made is not None:
            destroy_all(self._node, made)
        for subscription, _ in self._states.pop(name, ()):
            self._quiet.destroy_subscription(subscription)

    def _take_states(self) -> None:
        """Take every state that waits: the newest pose, and all that actuators did since."""
        for states in self._states.values():
            for subscription, see in states:
                with subscription.handle:
                    for _ in range(AT_ONCE):
                        taken = subscription.handle.take_message(subscription.msg_type, True)
                        if taken is None:
                            break
                        see(taken[0])

    def _on_odometry(self, robot: RobotState, data: bytes) -> None:
        try:
            placed = read_odometry(data)
        except UnreadableError:
            return
        with self._fleet.lock:
            robot.see_pose(placed.pose, placed.stamp_ns)

    def _on_applied(self, robot: RobotState, reader: JointReader, data: bytes) -> None:
        try:
            values = reader.read(data)
        except UnreadableError:
            return
        with self._fleet.lock:
            robot.see_applied(reader.names, values)

    def _on_thing(self, robot: RobotState, name: str, message: PoseStamped) -> None:
        p, q = message.pose.position, message.pose.orientation
        with self._fleet.lock:
            robot.things[name] = [round(number, 4) for number in (p.x, p.y, p.z, q.x, q.y, q.z, q.w)]

    def _on_status(self, robot: RobotState, message: DiagnosticArray) -> None:
        for status in message.status[:1]:
            self._see(robot, "controller", status)

    def _on_envelope(self, robot: RobotState, message: DiagnosticArray) -> None:
        for status in message.status[:1]:
            with self._fleet.lock:
                robot.see_envelope({pair.key: pair.value for pair in status.values})

    def _on_simulation(self, robot: RobotState, message: String) -> None:
        with self._fleet.lock:
            robot.see_simulation(message.data)

    def _on_goal(self, robot: RobotState, message: GoalMessage, _info: Mapping[str, int]) -> None:
        # A controller that refuses it says why.
        targets, _problem = goal_of(message, frames_of(robot.name, robot.type))
        if targets is not None:
            with self._fleet.lock:
                robot.see_goal(targets.tolist(), stamp_ns(message.header.stamp))

    def _on_obstacles(self, robot: RobotState, message: MarkerArray, _info: Mapping[str, int]) -> None:
        obstacles, _problem = obstacles_of(message, frames_of(robot.name, robot.type))
        if obstacles is not None:
            with self._fleet.lock:
                robot.obstacles = obstacles[:, :3].tolist()

    def watch_cameras(self, wanted: Mapping[str, set[int]]) -> None:
        """Receive these kinds of images of these robots, by name, and of no other: they are large."""
        keys = {
            (name, kind) for name, kinds in wanted.items() for kind in kinds if name in self._fleet.robots
        }
        for key in self._cameras.keys() - keys:
            self._node.destroy_subscription(self._cameras.pop(key))
        for name, kind in keys - self._cameras.keys():
            wire = CAMERA_IMAGES[kind]
            self._cameras[name, kind] = self._node.create_subscription(
                RosImage,
                f"{namespace_of(name)}/{wire.name}",
                partial(self._on_image, self._fleet.robots[name].index, kind),
                subscriber_qos(wire, reliable=False, latched=False, depth=1),
                raw=True,
            )

    def _on_image(self, index: int, kind: int, data: bytes) -> None:
        self.images.offer((index, kind), partial(_read_image, data))

    def close(self) -> None:
        """Encode and take no more."""
        self.images.close()
        self._states.clear()
        self._quiet.destroy_node()


def _read_image(data: bytes) -> RawImage:
    """An image from its serialized bytes."""
    message = deserialize_message(data, RosImage)
    return RawImage(message.encoding, message.height, message.width, bytes(message.data))


def _is_name(name: str) -> bool:
    """Whether a robot can be called so."""
    try:
        check_robot_name(name)
    except ValueError:
        return False
    return True
