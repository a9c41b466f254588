"""The wire `robot_info`: what a robot is and does, latched by its plant for every client."""

from __future__ import annotations

from dataclasses import replace

from rclpy.clock import Clock, ClockType
from rclpy.lifecycle import LifecycleNode
from std_msgs.msg import String

from fulmar_core.loop.robot_info import HARDWARE, RobotSetup, as_json, robot_info
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.topics import ROBOT_INFO, TELEOP
from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.tasks import load_task
from fulmar_ros.operator_actions import publishers_of
from fulmar_ros.parameters import name_of
from fulmar_ros.plant_settings import PlantSettings
from fulmar_ros.qos import publisher_qos

LOOK_S = 0.2  # between two looks at who drives


class RobotInfoWire:
    """Publishes what a robot is and does at once, and again when that changes."""

    def __init__(
        self,
        node: LifecycleNode,
        robot: Robot,
        settings: PlantSettings,
        guard: ActuatorGuard,
        *,
        started_ns: int,
    ) -> None:
        """Publish.

        Args:
            node: The plant.
            robot: The robot.
            settings: Parameters of the plant.
            guard: Knows whether a person has the actuators.
            started_ns: When the plant was created, by the wall clock [ns].
        """
        self._node, self._guard = node, guard
        self._robot, self._task = robot, load_task(settings.task, settings.thing)
        self._setup = RobotSetup(
            name=name_of(node, robot),
            backend=settings.backend,
            emulated=settings.emulated,
            scenario=settings.scenario if settings.backend != HARDWARE else "",
            controller=settings.controller,
            fallback=settings.fallback,
            bundle=settings.bundle,
            origin=settings.origin,
            area=settings.area,
            control_hz=settings.control_rate(robot),
            lockstep=settings.lockstep,
            rate=settings.rate,
            started_ns=started_ns,
        )
        self._publisher = node.create_publisher(String, ROBOT_INFO.name, publisher_qos(ROBOT_INFO))
        self._publish()
        self._timer = node.create_timer(LOOK_S, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _look(self) -> None:
        """Publish again where another person drives, or none any more."""
        names = publishers_of(self._node, (TELEOP.name,))[0] if self._guard.person else []
        operator = ", ".join(names)
        # The names of a person's nodes may go before the person gives the robot back.
        if operator != self._setup.operator and not (self._guard.person and not names):
            self._setup = replace(self._setup, operator=operator)
            self._publish()

    def destroy(self, node: LifecycleNode) -> None:
        """Destroy timer and publisher."""
        node.destroy_timer(self._timer)
        node.destroy_publisher(self._publisher)

    def _publish(self) -> None:
        self._publisher.publish(String(data=as_json(robot_info(self._robot, self._task, self._setup))))
