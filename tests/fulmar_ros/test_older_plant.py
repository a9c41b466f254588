"""Of two plants of one name the younger one ends itself, as soon as it receives the older one's reports."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.signals import SignalHandlerOptions

from fulmar_core.config.errors import FAILED
from fulmar_ros.living_plant import living_plants
from fulmar_ros.plant_node import PlantNode
from sim_nodes.sim_node import make_backend
from tests.conftest import RosDomain
from tests.ros.neighbour import NAMESPACE

NAME = f"{NAMESPACE}/plant"
MINUTE_NS = 60_000_000_000


@pytest.fixture
def plant(ros_domain: RosDomain) -> Iterator[tuple[Any, list[int]]]:
    """A plant that nobody serves, and the codes with which it asks to end."""
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    codes: list[int] = []
    arguments = ["--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", "backend:=mock", "-p", "lockstep:=true"]
    node = PlantNode(make_backend, codes.append, cli_args=arguments)
    yield node, codes
    node.stop()
    node.destroy_node()
    rclpy.try_shutdown()


def report(started_ns: int, *, name: str = NAME, host: str = "elsewhere") -> DiagnosticArray:
    """Diagnostics of a plant of another process."""
    values = {"node": name, "pid": "1", "host": host, "started_ns": str(started_ns)}
    status = DiagnosticStatus(values=[KeyValue(key=key, value=value) for key, value in values.items()])
    return DiagnosticArray(status=[status])


def test_it_ends_where_an_older_plant_of_its_name_reports(plant, capfd) -> None:
    node, codes = plant
    node._yield_to_older(report(node._started_ns - MINUTE_NS))
    assert codes == [FAILED]
    assert f"{NAME}, process 1 on host elsewhere lives in this ROS domain already" in capfd.readouterr().err


def test_it_goes_on_beside_a_younger_one_and_beside_one_of_another_name(plant) -> None:
    node, codes = plant
    node._yield_to_older(report(node._started_ns + MINUTE_NS))
    node._yield_to_older(report(node._started_ns - MINUTE_NS, name="/another/plant"))
    assert codes == []


def test_a_plant_of_its_name_that_publishes_nothing_yet_counts(plant) -> None:
    node, _ = plant
    assert living_plants(node, NAMESPACE) == []
    twin = rclpy.create_node("plant", namespace=NAMESPACE)
    assert living_plants(node, NAMESPACE) == [NAME]
    twin.destroy_node()
