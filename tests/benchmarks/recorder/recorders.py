"""Recorder processes, the traffic that they record, and the stamps in their bags."""

from __future__ import annotations

import contextlib
import os
import subprocess
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import psutil
import rclpy
from mcap.reader import make_reader
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rosbags.highlevel import AnyReader
from sensor_msgs.msg import JointState

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import stamps_ns
from fulmar_bags.mcap_records import bag_files
from fulmar_bringup.processes import child_environment, command_line
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system_rows import system_rows
from fulmar_core.config.errors import RunFailed
from fulmar_core.config.process import PLANT_PRIORITY, take_priority
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import COMMAND, ODOMETRY
from fulmar_ros.convert import stamp_of
from fulmar_ros.deadline import Deadlines
from fulmar_ros.qos import publisher_qos
from fulmar_ros.runtime import init_ros

START_TIMEOUT_S = 60.0
STOP_TIMEOUT_S = 20.0


class Recorder:
    """One recorder, the very process of `fulmar run`."""

    def __init__(self, plan: RunPlan, bag: Path) -> None:
        """Start it.

        Args:
            plan: Whose wires, and how.
            bag: Folder of the bag; must not exist.
        """
        self.bag = bag
        self._output = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the process
        self.process = psutil.Popen(
            command_line(system_rows(plan, record={"directory": str(bag)})["recorder"]),
            env={**os.environ, **child_environment()},
            stdin=subprocess.DEVNULL,
            stdout=self._output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )

    @property
    def said(self) -> str:
        """Everything that it printed."""
        return os.pread(self._output.fileno(), 1 << 20, 0).decode(errors="replace")

    def wait_until_recording(self) -> None:
        """Wait until the bag is there.

        Raises:
            RunFailed: The recorder ended, or takes too long.
        """
        until = time.monotonic() + START_TIMEOUT_S
        while "recording to" not in self.said:
            if self.process.poll() is not None or time.monotonic() > until:
                raise RunFailed(f"the recorder did not begin: {self.said.strip() or 'it said nothing'}")
            time.sleep(0.02)

    def kill(self) -> None:
        """End it with SIGKILL."""
        self.process.kill()
        self.process.wait()

    def stop(self) -> int:
        """End it in order; returns its exit code."""
        self.process.send_signal(2)
        return int(self.process.wait(STOP_TIMEOUT_S))

    def close(self) -> None:
        """Leave nothing behind."""
        with contextlib.suppress(psutil.NoSuchProcess):
            self.kill()
        self._output.close()


@contextlib.contextmanager
def recorders(plans: dict[Path, RunPlan]) -> Iterator[list[Recorder]]:
    """Recorders that all record; none is left when the context ends."""
    with contextlib.ExitStack() as stack:
        started = []
        for bag, plan in plans.items():
            started.append(Recorder(plan, bag))
            stack.callback(started[-1].close)
        for recorder in started:
            recorder.wait_until_recording()
        yield started


def stamps_by_topic(bag: Path) -> dict[str, list[int]]:
    """Stamps of every message [ns], by topic, as they were recorded; none where there is no message or no header."""
    stamps = {name: stamps_ns(topic) for name, topic in open_bag(bag).topics.items() if len(topic)}
    return defaultdict(list, {name: found.tolist() for name, found in stamps.items() if found is not None})


def opens(bag: Path) -> bool:
    """Whether the readers of `rosbags` and of `mcap` open a bag and find the same number of messages."""
    try:
        return _count_by_rosbags(bag) == _count_by_mcap(bag)
    except Exception:  # noqa: BLE001 - whatever a reader raises is the finding
        return False


def _count_by_rosbags(bag: Path) -> int:
    with AnyReader([bag]) as reader:
        return sum(1 for _ in reader.messages())


def _count_by_mcap(bag: Path) -> int:
    count = 0
    for path in bag_files(bag):
        with path.open("rb") as stream:
            count += sum(1 for _ in make_reader(stream).iter_messages())
    return count


ODOMETRY_HZ, EVERY = 200.0, 4  # commands: every fourth
MATCH_TIMEOUT_S = 30.0
SETTLE_S = 0.5  # a publisher sees a match some milliseconds before the subscriber's side is ready


class Traffic:
    """Publishes until it is stopped; the stamp of a message is its number [ns]."""

    def __init__(self, node: Node, robot: Robot) -> None:
        """Make the publishers."""
        self._odometry = node.create_publisher(Odometry, ODOMETRY.name, publisher_qos(ODOMETRY))
        self._command = node.create_publisher(JointState, COMMAND.name, publisher_qos(COMMAND))
        self._names = list(robot.actuators.names)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="traffic", daemon=True)
        self.sent_s: list[float] = []  # monotonic, by number of the odometry message [s]

    def wait_for(self, recorders: int) -> None:
        """Wait until so many recorders listen.

        Raises:
            RunFailed: They do not.
        """
        until = time.monotonic() + MATCH_TIMEOUT_S
        while min(p.get_subscription_count() for p in (self._odometry, self._command)) < recorders:
            if time.monotonic() > until:
                raise RunFailed(f"the recorder has not subscribed within {MATCH_TIMEOUT_S:g} s.")
            time.sleep(0.02)
        time.sleep(SETTLE_S)

    def start(self) -> None:
        """Begin to publish."""
        self._thread.start()

    def stop(self) -> None:
        """Publish no more."""
        self._stop.set()
        self._thread.join()

    def _run(self) -> None:
        take_priority(PLANT_PRIORITY)
        beat, odometry, command = Deadlines(1.0 / ODOMETRY_HZ), Odometry(), JointState(name=self._names)
        command.effort = [0.0] * len(self._names)
        while beat.wait(self._stop):
            number = len(self.sent_s)
            odometry.header.stamp = command.header.stamp = stamp_of(number)
            self._odometry.publish(odometry)
            if number % EVERY == 0:
                self._command.publish(command)
            self.sent_s.append(time.monotonic())


@contextlib.contextmanager
def traffic(plan: RunPlan) -> Iterator[Traffic]:
    """Traffic that has not begun, in the ROS domain of the environment; it ends with the context."""
    context = rclpy.Context()
    init_ros(context=context)
    node = rclpy.create_node("traffic", namespace=plan.namespace, context=context)
    made = Traffic(node, load_robot(plan.robot))
    try:
        yield made
    finally:
        if made._thread.is_alive():
            made.stop()
        node.destroy_node()
        rclpy.shutdown(context=context)
