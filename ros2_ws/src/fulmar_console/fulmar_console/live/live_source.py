"""Robots of the ROS domain as a `Source`: state that two threads share, and ROS once there is time for it."""

from __future__ import annotations

import contextlib
import logging
import math
import os
import threading
import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from fulmar_console.source import Answer, Expected, Image, RobotSample

if TYPE_CHECKING:
    from fulmar_console.live.fleet import Fleet
    from fulmar_console.live.orders import Orders
    from fulmar_console.live.ros_side import RosSide

STARTS_S = 10.0  # in which ROS has to be there; then the page says what is missing
ENDS_S = 5.0  # for the ROS side to end in order
AGAIN_S = 2.0  # before a ROS side that has failed is started again
LOOK_S = 0.1
SILENT_S = 1.0  # without a sign of life, after which it does nothing that a page asks for
KINDS = {"rgb": 0, "depth": 1, "ids": 2}  # of a camera's images

log = logging.getLogger("fulmar_console")


class LiveSource:
    """Robots that run, or are about to.

    Everything of ROS and of the core is imported by its own thread, so that the page is served meanwhile.
    """

    mode = "live"

    def __init__(self, expected: Expected | None = None) -> None:
        """Know no robot yet.

        Args:
            expected: A robot that is being started, drawn before it answers.
        """
        self._over = threading.Event()
        self._expected = expected
        self._fleet: Fleet | None = None
        self._ros: RosSide | None = None
        self._orders: Orders | None = None
        self._problem = ""
        self._began_s = time.monotonic()
        self._cameras: dict[str, tuple[str, set[int]]] = {}
        self._thread = threading.Thread(target=self._run, name="ros", daemon=True)

    def start(self) -> None:
        """Begin to look for robots."""
        self._thread.start()

    def _run(self) -> None:
        """Keep a ROS side alive: one that fails is started again, and pages see why until it is there."""
        from fulmar_console.live.fleet import Fleet

        self._fleet = Fleet()
        self._expect(self._fleet)
        while not self._over.is_set():
            try:
                self._listen(self._fleet)
            except Exception as error:  # noqa: BLE001 - whatever it is, the page says it
                self._problem = f"the console's ROS side has failed: {type(error).__name__}: {error}"
                log.error(self._problem)
            self._ros = self._orders = None
            self._over.wait(AGAIN_S)

    def _expect(self, fleet: Fleet) -> None:
        """Draw the robot that is being started, from its files; a mistake in them is said by who starts it."""
        if self._expected is None:
            return
        from fulmar_bringup.system_plan import system_plan
        from fulmar_core.config.errors import FulmarError
        from fulmar_core.loop.robot_info import RobotSetup, robot_info
        from fulmar_core.robots.robot_file import load_robot
        from fulmar_core.tasks import load_task

        asked = self._expected
        with contextlib.suppress(FulmarError):
            plan = system_plan(
                asked.system or None,
                robot=asked.robot or None,
                name=asked.name or None,
                task=asked.task or None,
            )
            robot = load_robot(plan.robot)
            task = load_task(plan.task or robot.kind.goal_task or robot.kind.usual_task)
            fleet.find(plan.robot_name, robot_info(robot, task, RobotSetup(name=plan.robot_name)))

    def _listen(self, fleet: Fleet) -> None:
        """Receive and command until the source is closed, or a callback has failed."""
        from fulmar_console.live.orders import Orders
        from fulmar_console.live.ros_side import RosSide
        from fulmar_ros.runtime import ros_node

        failed: list[Exception] = []
        with ros_node(f"console_{os.getpid()}", failed.append) as node:
            ros = RosSide(node, fleet)
            try:
                orders = Orders(node, fleet)
                self._ros, self._orders, self._problem = ros, orders, ""
                self._watch_cameras()
                while not self._over.wait(LOOK_S):
                    if failed:
                        raise failed[0]
                orders.close()
            finally:
                ros.close()

    def hello(self) -> dict[str, Any]:
        """Nothing beside what every page gets."""
        return {}

    def version(self) -> int:
        """As in `Source`."""
        return self._fleet.version if self._fleet is not None else 0

    def robots(self) -> list[dict[str, Any]]:
        """As in `Source`."""
        fleet = self._fleet
        if fleet is None:
            return []
        with fleet.lock:
            return [robot.record for robot in fleet.robots.values()]

    def frame(self) -> tuple[list[RobotSample], float]:
        """As in `Source`; before ROS is there, its silence counts from when that should be."""
        fleet = self._fleet
        if fleet is None:
            return [], self._silent_s()
        with fleet.lock:
            return [robot.sample() for robot in fleet.robots.values()], self._silent_s()

    def _silent_s(self) -> float:
        ros = self._ros
        if ros is not None:
            return time.monotonic() - ros.alive_s
        if self._problem:
            return math.inf
        return max(0.0, time.monotonic() - self._began_s - STARTS_S)

    def health(self) -> Mapping[str, Mapping[str, Any]]:
        """As in `Source`."""
        fleet = self._fleet
        if fleet is None:
            return {}
        from fulmar_console.live.health import health_of

        with fleet.lock:
            health = {name: health_of(robot) for name, robot in fleet.robots.items()}
        if self._problem:
            for each in health.values():
                each.update(level="silent", words=self._problem, stopped=False)
        return health

    def events(self) -> list[dict[str, Any]]:
        """As in `Source`."""
        fleet = self._fleet
        if fleet is None:
            return []
        with fleet.lock:
            return [event for robot in fleet.robots.values() for event in robot.take_events()]

    def images(self) -> list[Image]:
        """As in `Source`."""
        ros = self._ros
        return ros.images.take() if ros is not None else []

    def do(self, command: Mapping[str, Any], answer: Answer, client: str) -> None:
        """As in `Source`."""
        orders = self._orders
        if command["do"] == "look":
            self._look(command, client)
            answer(True, "")
        elif orders is None:
            later = "the console has not found ROS yet. Ask again in a moment"
            words = self._problem or later
            answer(False, f"NOT CONFIRMED: {words}" if command["do"] == "estop" else f"not done: {words}")
        elif command["do"] != "estop" and self._silent_s() > SILENT_S:
            answer(False, f"not done: the console's ROS side is silent for {self._silent_s():.1f} s")
        else:
            orders.do(command, answer, client)

    def _look(self, command: Mapping[str, Any], client: str) -> None:
        kinds = command["camera"] if isinstance(command["camera"], list) else []
        wanted = {KINDS[kind] for kind in kinds if isinstance(kind, str) and kind in KINDS}
        self._cameras[client] = str(command["robot"]), wanted
        self._watch_cameras()

    def _watch_cameras(self) -> None:
        """Receive what some page looks at."""
        wanted: dict[str, set[int]] = {}
        for robot, kinds in list(self._cameras.values()):
            wanted.setdefault(robot, set()).update(kinds)
        ros, orders = self._ros, self._orders
        if ros is not None and orders is not None:
            orders.soon(lambda: ros.watch_cameras(wanted))

    def forget(self, client: str) -> None:
        """As in `Source`: a page that has gone drives no robot any more."""
        orders = self._orders
        if orders is not None:
            orders.forget(client)
        if self._cameras.pop(client, None) is not None:
            self._watch_cameras()

    def file(self, path: str) -> bytes | None:
        """Live robots have no files."""
        return None

    def close(self) -> None:
        """End the ROS side."""
        self._over.set()
        with contextlib.suppress(RuntimeError):
            self._thread.join(ENDS_S)
