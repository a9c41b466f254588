"""The plant publishes what its robot is, for a client that comes late, too; and who drives it by hand."""

from __future__ import annotations

import json
import time

import numpy as np
import pytest
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger

from fulmar_core.robots.topics import GIVE_BACK, ROBOT_INFO, TELEOP
from fulmar_ros.convert import VectorWriter
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.qos import publisher_qos, subscriber_qos
from tests.ros.neighbour import ROBOT, Neighbour, until

pytestmark = pytest.mark.real_time


def infos(neighbour: Neighbour) -> list[dict]:
    """What comes from now on, the latched one first."""
    received: list[dict] = []
    neighbour.node.create_subscription(
        String,
        ROBOT_INFO.name,
        lambda message: received.append(json.loads(message.data)),
        subscriber_qos(ROBOT_INFO, reliable=True, latched=True),
    )
    until(lambda: bool(received))
    return received


def test_a_client_that_comes_late_receives_what_the_robot_is(neighbour: Neighbour, plant: PlantNode) -> None:
    info = infos(neighbour)[0]
    assert (info["name"], info["type"], info["backend"], info["simulated"]) == (ROBOT, ROBOT, "mock", True)
    until(lambda: "started_ns" in neighbour.said["plant"][1])
    assert str(info["started_ns"]) == neighbour.said["plant"][1]["started_ns"]


def test_a_person_who_drives_is_named_until_control_is_given_back(
    neighbour: Neighbour, plant: PlantNode
) -> None:
    received = infos(neighbour)
    publisher = neighbour.node.create_publisher(JointState, TELEOP.name, publisher_qos(TELEOP))
    writer = VectorWriter(neighbour.robot.actuators.names)

    def drives() -> bool:
        publisher.publish(writer.write(np.zeros(8), 0))
        time.sleep(0.03)
        return received[-1]["operator"] == f"/{ROBOT}/neighbour"

    until(drives)
    client = neighbour.node.create_client(Trigger, GIVE_BACK)
    assert client.wait_for_service(8.0)
    future = client.call_async(Trigger.Request())
    until(future.done)
    assert future.result().success
    until(lambda: received[-1]["operator"] == "")
