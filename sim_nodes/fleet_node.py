"""The process that simulates a fleet: one MuJoCo world, a plant for each robot, and one owner of the clock."""

from __future__ import annotations

import json
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String

from fulmar_core.config.errors import DONE, FAILED, FulmarError, UnknownNameError
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import CLOCK, DIAGNOSTICS, FLEET_STATUS, SIMULATION_START_NS
from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.simulation.backend import Backend
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from fulmar_ros.convert import stamp_of
from fulmar_ros.operator_subscription import subscribe_every
from fulmar_ros.parameters import read_parameters
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.plant_settings import PlantSettings
from fulmar_ros.plant_wires import CLOCK_PERIOD_NS
from fulmar_ros.qos import publisher_qos
from fulmar_ros.runtime import RequestExit, run_node
from sim_nodes.camera.opengl import check_variable
from sim_nodes.on_air import OnAir

STATUS_S = 0.5  # between two messages of the status


@dataclass(frozen=True)
class FleetSettings:
    """ROS parameters of the fleet's node."""

    # JSON: for each robot, by its name, the ROS arguments of its plant
    plants: str = "{}"
    lockstep: bool = False
    rate: float = 1.0  # simulated seconds a wall-clock second, where not in lock step
    autostart: bool = True  # start every plant; else another node does

    def arguments(self) -> dict[str, list[str]]:
        """ROS arguments of each plant, by the robot's name.

        Raises:
            ValueError: The parameter is not what it must be.
        """
        try:
            found = json.loads(self.plants)
            return {str(name): [str(word) for word in words] for name, words in found.items()}
        except (json.JSONDecodeError, AttributeError, TypeError) as error:
            raise ValueError(f"'plants' is no JSON object of lists of words: {error}.") from error

    def __post_init__(self) -> None:
        if self.rate <= 0.0:
            raise ValueError(f"rate = {self.rate:g} must be greater than 0.")
        self.arguments()


class FleetNode(Node):
    """Owns the world and the clock, and reports the status of every robot.

    Attributes:
        companions: The plants, one for each robot, in the same process.
    """

    def __init__(self, request_exit: RequestExit) -> None:
        """Build the world and the plants.

        Raises:
            FulmarError: A parameter is wrong, or the robots do not fit into one world.
        """
        super().__init__("fleet")
        self._settings = read_parameters(self, FleetSettings)
        self._request_exit, self._lost = request_exit, dict[str, int]()
        self._statuses: dict[str, dict[str, dict[str, Any]]] = {}
        self._clock_wire = self.create_publisher(Clock, CLOCK.name, publisher_qos(CLOCK))
        self._said_ns, self._now_ns, self._losing = 0, SIMULATION_START_NS, threading.Lock()
        self._world: Any = None
        self._members: dict[str, Any] = {}
        self.companions: list[PlantNode] = []
        for name, words in self._settings.arguments().items():
            self.companions.append(self._plant(name, words))
        for plant in self.companions if self._settings.autostart else ():
            for transition in (plant.trigger_configure, plant.trigger_activate):
                if transition() != TransitionCallbackReturn.SUCCESS:
                    name = plant.get_namespace().strip("/")
                    raise FulmarError(f"plant of '{name}' could not start: {plant.health.reason}")
        self._status = self.create_publisher(String, FLEET_STATUS.name, publisher_qos(FLEET_STATUS))
        self._reports = subscribe_every(self, DiagnosticArray, DIAGNOSTICS, self._on_diagnostics)
        self._timer = self.create_timer(STATUS_S, self._publish_status)

    def bring_down(self, _cut_short: object) -> None:
        """Nothing flies in a fleet's world."""

    def stop(self) -> int:
        """Bring every robot to rest; the exit code is the worst of theirs."""
        return stop_together(self.companions)

    def _plant(self, name: str, words: Sequence[str]) -> PlantNode:
        return PlantNode(
            lambda robot, settings: self._backend(name, robot, settings),
            lambda code: self._lose(name, code),
            cli_args=list(words),
        )

    def _backend(self, name: str, robot: Robot, settings: PlantSettings) -> Backend:
        """The backend of one robot; the first that asks builds the world of all."""
        backend = self._make_world().robots[name]
        if robot.air_bearing:
            return OnAir(backend, load_scenario(settings.scenario))
        return backend

    def _make_world(self) -> Any:
        from sim_nodes.fleet_world import FleetWorld, Member

        if self._world is None:
            check_variable()
            members = {}
            for plant in self.companions:
                own = plant.settings
                if own.backend != "mujoco":
                    raise UnknownNameError("backend of a fleet", own.backend, ("mujoco",))
                task, scenario = load_task(own.task, own.thing), load_scenario(own.scenario)
                name = plant.get_namespace().strip("/")
                members[name] = Member(load_robot(own.robot), task, scenario)
            self._world = FleetWorld(
                members,
                lockstep=self._settings.lockstep,
                rate=self._settings.rate,
                on_tick=self._on_tick,
            )
            for plant in self.companions:
                guard = plant.guard
                self._world.robots[plant.get_namespace().strip("/")].is_driven = partial(_is_driven, guard)
        return self._world

    def _on_tick(self, ticks: int) -> None:
        """Publish the clock; by the thread of any robot, one at a time."""
        self._now_ns = SIMULATION_START_NS + round(1e9 * ticks * self._world.tick_s)
        now = time.monotonic_ns()
        if now - self._said_ns >= CLOCK_PERIOD_NS:
            self._said_ns = now
            self._clock_wire.publish(Clock(clock=stamp_of(self._now_ns)))

    def _lose(self, name: str, code: int) -> None:
        """A plant cannot go on: its robot rests, and the others go on; without any the process ends."""
        with self._losing:
            self._lost[name] = code
            over = len(self._lost) == len(self.companions)
        self.get_logger().error(f"the plant of '{name}' does not go on; the others do")
        if over:
            self._request_exit(FAILED)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            robot, _, part = status.name.partition(": ")
            if part in ("plant", "controller"):
                values = {pair.key: pair.value for pair in status.values}
                said = {"message": status.message, "values": values}
                self._statuses.setdefault(robot, {})[part] = said

    def _publish_status(self) -> None:
        names = self._settings.arguments()  # not from the plants, which are destroyed before this node
        robots = {name: status_of(self._statuses.get(name, {})) for name in names}
        text = {"time_s": round((self._now_ns - SIMULATION_START_NS) / 1e9, 3), "robots": robots}
        self._status.publish(String(data=json.dumps(text)))


def stop_together(plants: Sequence[PlantNode]) -> int:
    """Stop plants, each in a thread: none waits until the last states of another are received.

    A plant in lock step waits up to two seconds for that, and who asked them to end waits four for all.

    Returns:
        The worst exit code.

    Raises:
        Exception: What the first of those raised that could not stop; the others have stopped.
    """
    with ThreadPoolExecutor(max(1, len(plants)), "stop") as threads:
        ended = [threads.submit(plant.stop) for plant in plants]
    return max([each.result() for each in ended], default=DONE)


def _is_driven(guard: ActuatorGuard) -> bool:
    """Whether a plant applies what its controller commands; a look without the lock of its thread."""
    return not guard.is_safe


def status_of(parts: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """What the status of a fleet says of one robot.

    Args:
        parts: Newest `message` and `values` of its plant and its controller, as far as they have come.
    """
    plant, controller = (parts.get(part, {"message": "", "values": {}}) for part in ("plant", "controller"))
    distance = controller["values"].get("goal_distance_m", "")
    far = float(distance) if distance not in ("", "nan", "inf") else None
    return {
        "mode": plant["values"].get("mode", "unknown"),
        "message": plant["message"],
        "controller": controller["values"].get("mode", "unknown"),
        "goal_distance_m": far,
        "estop": plant["values"].get("estop", ""),
    }


def main() -> None:
    """Run the node until it is stopped."""
    sys.exit(run_node(FleetNode))


if __name__ == "__main__":
    main()
