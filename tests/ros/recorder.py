"""A recorder process as tests see it from outside, and odometry for it to receive."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from nav_msgs.msg import Odometry
from rosbags.highlevel import AnyReader

from fulmar_core.robots.topics import ODOMETRY
from fulmar_ros.qos import publisher_qos

ROBOT = "/floating_platform"


class Recorder:
    """A recorder process, its output, and a publisher that it receives."""

    def __init__(self, directory: Path, env: dict[str, str], *parameters: str) -> None:
        options = [f"directory:={directory}", *parameters]
        command = [sys.executable, "-m", "fulmar_ros.recorder_node", "--ros-args", "-r", f"__ns:={ROBOT}"]
        command += [word for option in options for word in ("-p", option)]
        self.directory = directory
        self.process = subprocess.Popen(
            command, env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )

    def wait_until_recording(self, words: str = "recording to") -> None:
        assert self.process.stdout.readline() == f"{words} {self.directory}\n"

    def pause(self) -> None:
        """Stop the process and wait until each of its threads has stopped: the signal alone returns before."""
        self.process.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, self.process.pid, os.WSTOPPED | os.WNOWAIT)

    def end(self, number: signal.Signals) -> tuple[int, str, str]:
        self.process.send_signal(number)
        out, err = self.process.communicate(timeout=20)
        return self.process.returncode, out, err

    def file(self) -> Path:
        return next(self.directory.glob("*.mcap"))

    def stamps_by_rosbags(self) -> list[int]:
        with AnyReader([self.directory]) as reader:
            connections = [c for c in reader.connections if c.topic == f"{ROBOT}/odom"]
            messages = reader.messages(connections=connections)
            return [reader.deserialize(raw, c.msgtype).header.stamp.sec for c, _, raw in messages]

    def stamps_by_mcap(self) -> list[int]:
        with self.file().open("rb") as stream:
            reader = make_reader(stream, decoder_factories=[DecoderFactory()])
            messages = reader.iter_decoded_messages(topics=[f"{ROBOT}/odom"])
            return [message.header.stamp.sec for *_, message in messages]


def odometry(node, *, lockstep: bool = False):
    publisher = node.create_publisher(Odometry, ODOMETRY.name, publisher_qos(ODOMETRY, lockstep=lockstep))
    deadline = time.monotonic() + 10.0
    while not publisher.get_subscription_count():
        assert time.monotonic() < deadline, "the recorder never subscribed to the odometry"
        time.sleep(0.01)
    time.sleep(0.5)  # a publisher knows of a match a moment before the subscriber does
    return publisher


def publish(publisher, stamps, period_s: float = 0.002) -> None:
    message = Odometry()
    for stamp in stamps:
        message.header.stamp.sec = stamp
        publisher.publish(message)
        time.sleep(period_s)


def wait_for(true, timeout_s: float = 20.0) -> None:
    until = time.monotonic() + timeout_s
    while not true():
        assert time.monotonic() < until
        time.sleep(0.02)
