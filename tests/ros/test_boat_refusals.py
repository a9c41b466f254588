"""A boat with ArduPilot under the driver node: an operator sets HOLD, a stranger speaks, MANUAL comes back."""

from __future__ import annotations

import socket
import time
from collections.abc import Iterator

import pytest
from std_srvs.srv import Trigger

from fulmar_core.config.errors import FulmarError
from fulmar_core.robots.topics import GIVE_BACK
from fulmar_core.robots.wire_check import WARNINGS
from fulmar_ros.runtime import spinning
from hardware_drivers.driver_node import DriverNode
from tests.hardware_drivers.bench import Bench
from tests.hardware_drivers.boat_bench import boat
from tests.ros.neighbour import Neighbour, until

pytestmark = [pytest.mark.real_time, pytest.mark.parametrize("neighbour", ["kingfisher"], indirect=True)]

MANUAL, HOLD, GUIDED = 0, 4, 15
HELD = "the autopilot is in mode 4 (HOLD), not MANUAL: overrides do nothing"


@pytest.fixture
def bench() -> Iterator[Bench]:
    with boat() as made:
        yield made


def driver_node(bench: Bench) -> DriverNode:
    parameters = {
        "robot": "kingfisher",
        "hardware": "kingfisher_ardupilot",
        "port": bench.device.address,
        "arm": "true",
    }
    words = [word for key, value in parameters.items() for word in ("-p", f"{key}:={value}")]
    return DriverNode(lambda _code: None, cli_args=["--ros-args", "-r", "__ns:=/kingfisher", *words])


@pytest.fixture
def node(neighbour: Neighbour, bench: Bench) -> Iterator[DriverNode]:
    node = driver_node(bench)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        yield node
        node.stop()


def ahead(neighbour: Neighbour) -> None:
    """Command the controller's 0.8 on both sides."""
    neighbour.command([0.8, 0.8])
    time.sleep(0.02)


def test_hold_by_an_operator_stops_the_boat_in_words_and_manual_alone_does_not_start_it(
    neighbour: Neighbour, bench: Bench, node: DriverNode
) -> None:
    until(lambda: ahead(neighbour) or bench.command.min() > 0.7)
    bench.device.mode = HOLD
    began = time.monotonic()
    until(lambda: ahead(neighbour) or neighbour.said["plant"][1].get(WARNINGS) == HELD)
    assert time.monotonic() - began < 1.0
    assert neighbour.said["plant"][0].startswith(f"{HELD}: actuators in their safe state until")
    assert neighbour.said["plant"][1]["autopilot_mode"] == "4 (HOLD)"
    assert not neighbour.applied[-1].any()
    bench.device.mode = MANUAL
    until(lambda: ahead(neighbour) or neighbour.said["plant"][1]["autopilot_mode"] == "0 (MANUAL)")
    until_s = time.monotonic() + 0.5
    while time.monotonic() < until_s:
        ahead(neighbour)
        assert not bench.command.any()
    give_back = neighbour.node.create_client(Trigger, GIVE_BACK)
    assert give_back.wait_for_service(5.0)
    assert give_back.call(Trigger.Request()).success
    until(lambda: ahead(neighbour) or bench.command.min() > 0.7)


def test_a_boat_that_denies_manual_ends_the_node_before_anything_moves(
    neighbour: Neighbour, bench: Bench
) -> None:
    bench.device.mode = GUIDED
    bench.device.denied = {176: "Flight mode change failed"}  # MAV_CMD_DO_SET_MODE
    with pytest.raises(
        FulmarError, match=r"refuses mode MANUAL: denied; it is in mode 15 \(GUIDED\)\. It says"
    ):
        driver_node(bench)
    assert not bench.device.armed


def test_a_stranger_moves_neither_the_boat_nor_its_odometry(
    neighbour: Neighbour, bench: Bench, node: DriverNode
) -> None:
    until(lambda: ahead(neighbour) or bench.command.min() > 0.7)
    _, host, number = bench.device.address.split(":")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        for _ in range(200):
            for _ in range(100):
                stranger.sendto(b"\xfd", (host, int(number)))
            neighbour.command([0.8, 0.8])
            assert bench.command.min() > 0.7
    assert node.guard.watchdog.trips == 0
    assert node.guard.held == ""
