"""Losing the console changes nothing on a robot, except that one that a page drives by hand stops."""

from __future__ import annotations

import contextlib
import json
import re
import subprocess
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import psutil
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from fulmar_ros.plant_node import PlantNode
from tests.conftest import RosDomain
from tests.ros.cli import FULMAR
from tests.ros.neighbour import ROBOT, Neighbour, open_valves, until

pytestmark = [pytest.mark.real_time, pytest.mark.slow]

FOUND_S = 40.0
PLANT_STOPS_S = 1.5  # for the plant's own limit, on a busy machine [s]


class Browser:
    """A page without a browser: what comes, and the commands that it sends."""

    def __init__(self, address: str) -> None:
        host = re.sub(r"^http://|/$", "", address)
        self.connection: ClientConnection = connect(f"ws://{host}/socket", origin=f"http://{host}")
        self.session, self.health, self.answers, self._number = "", {}, {}, 0
        self.robots: list[str] = []
        threading.Thread(target=self._read, daemon=True).start()
        until(lambda: bool(self.session))

    def _read(self) -> None:
        with contextlib.suppress(ConnectionClosed):
            self._take_all()

    def _take_all(self) -> None:
        for text in self.connection:
            if isinstance(text, bytes):
                continue
            message = json.loads(text)
            if message["type"] == "hello":
                self.session = message["session"]
            elif message["type"] == "health":
                self.health = message["robots"]
            elif message["type"] == "robots":
                self.robots = [each["name"] for each in message["robots"]]
            elif message["type"] == "answer":
                self.answers[message["id"]] = message

    def send(self, do: str, **fields: object) -> int:
        self._number += 1
        command = {
            "id": self._number,
            "session": self.session,
            "at": time.time(),
            "do": do,
            "robot": ROBOT,
            **fields,
        }
        self.connection.send(json.dumps(command))
        return self._number

    def ask(self, do: str, **fields: object) -> dict:
        number = self.send(do, **fields)
        until(lambda: number in self.answers, 10.0)
        return self.answers[number]


class Console:
    """`fulmar console` in a process of its own."""

    def __init__(self, domain: RosDomain, folder: Path) -> None:
        self.process = psutil.Popen(
            [*FULMAR, "console", "--port", "0"], env=domain.env, cwd=folder, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        )  # fmt: skip
        for line in self.process.stdout:
            found = re.search(r"http://\S+/", line)
            if found:
                self.address = found.group()
                break
        self.page = Browser(self.address)


@pytest.fixture
def console(
    neighbour: Neighbour, plant: PlantNode, ros_domain: RosDomain, tmp_path: Path
) -> Iterator[Console]:
    made = Console(ros_domain, tmp_path)
    until(lambda: made.page.health.get(ROBOT, {}).get("plant_mode") == "running", FOUND_S)
    yield made
    made.process.kill()
    made.process.wait()


@pytest.fixture
def driven(neighbour: Neighbour, console: Console) -> Iterator[Console]:
    """A console whose page drives the robot, all the time."""
    over = threading.Event()

    def drive() -> None:
        while not over.wait(0.05):
            try:
                console.page.send("teleop", share=[1.0, 0.0, 0.0], deadman=True)
            except Exception:  # noqa: BLE001 - the console has gone, as the test wants
                return

    thread = threading.Thread(target=drive)
    thread.start()
    until(lambda: bool(neighbour.applied[-1].any()), 15.0)
    yield console
    over.set()
    thread.join()


def rests(neighbour: Neighbour) -> bool:
    return not neighbour.applied[-1].any()


def test_a_robot_that_is_driven_by_hand_stops_when_the_console_is_killed(
    neighbour: Neighbour, driven: Console
) -> None:
    driven.process.kill()
    until(lambda: rests(neighbour), PLANT_STOPS_S)
    for _ in range(20):  # a controller that goes on does not get it: a person has it
        neighbour.command(open_valves(neighbour.robot))
        time.sleep(0.02)
        assert rests(neighbour)
    until(lambda: neighbour.said["plant"][1]["commanded_by"] == "person")


def test_a_robot_that_is_driven_by_hand_stops_when_the_console_is_halted(
    neighbour: Neighbour, driven: Console
) -> None:
    driven.process.suspend()
    until(lambda: rests(neighbour), PLANT_STOPS_S)
    driven.process.resume()


def test_a_robot_that_is_driven_by_hand_stops_when_its_page_is_closed(
    neighbour: Neighbour, driven: Console
) -> None:
    driven.page.connection.close()
    until(lambda: rests(neighbour), PLANT_STOPS_S)
    other = Browser(driven.address)
    until(lambda: other.health.get(ROBOT, {}).get("commanded_by") == "person")
    until(lambda: bool(other.ask("give_back")["accepted"]), 15.0)


@pytest.mark.parametrize("how", ["kill", "suspend"])
def test_a_robot_that_its_controller_drives_goes_on_without_the_console(
    neighbour: Neighbour, console: Console, how: str
) -> None:
    valves = open_valves(neighbour.robot)

    def commanded() -> bool:
        neighbour.command(valves)
        time.sleep(0.02)
        return bool(neighbour.applied[-1].any())

    until(commanded)
    getattr(console.process, how)()
    for _ in range(75):
        commanded()
    assert np.array_equal(neighbour.applied[-1], valves)
    assert neighbour.said["plant"][1]["watchdog_trips"] == "0"
    assert neighbour.said["plant"][1]["estop"] == "false"
    console.process.resume()


def test_a_stop_through_the_socket_closes_an_open_valve_and_is_confirmed(
    neighbour: Neighbour, driven: Console
) -> None:
    number = driven.page.send("estop", robot="*")
    until(lambda: rests(neighbour), 0.5)
    until(lambda: number in driven.page.answers, 1.0)
    assert driven.page.answers[number]["accepted"]
    until(lambda: driven.page.health[ROBOT]["stopped"], 1.0)
