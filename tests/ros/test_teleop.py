"""A person's hand on the wires: it goes before the controller, and lets go when the person does."""

from __future__ import annotations

import os
import subprocess
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from rclpy.node import Node
from sensor_msgs.msg import JointState, Joy
from std_srvs.srv import Trigger

from fulmar_core.robots.topics import GIVE_BACK, JOY, TELEOP
from fulmar_ros import teleop_node
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.qos import publisher_qos, subscriber_qos
from fulmar_ros.runtime import spinning
from fulmar_ros.teleop_node import TeleopNode
from tests.conftest import RosDomain
from tests.ros.cli import FULMAR
from tests.ros.neighbour import NAMESPACE, Neighbour, open_valves, until

real_time = pytest.mark.real_time

AHEAD = [0.0, 1.0, 0.0, 0.0]


class Pad:
    """A gamepad in the test's hand."""

    def __init__(self, neighbour: Neighbour) -> None:
        self._publisher = neighbour.node.create_publisher(Joy, JOY.name, publisher_qos(JOY))
        self.neighbour = neighbour

    def say(self, *, held: bool, axes: list[float] = AHEAD, gives_back: bool = False) -> None:
        self._publisher.publish(Joy(axes=axes, buttons=[0, 0, 0, 0, int(held), int(gives_back)]))

    def drives(self, *, held: bool, axes: list[float] = AHEAD) -> bool:
        """Say it, while a controller commands one valve; whether more than that valve is open."""
        self.say(held=held, axes=axes)
        self.neighbour.command(open_valves(self.neighbour.robot))
        time.sleep(0.02)
        return bool(self.neighbour.applied[-1][1:].any())


@pytest.fixture
def pad(neighbour: Neighbour, plant: PlantNode) -> Iterator[Pad]:
    arguments = ["--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", "keyboard:=false"]
    node = TeleopNode(lambda _code: None, cli_args=arguments)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        yield Pad(neighbour)
        node.stop()


@real_time
def test_a_hand_goes_before_the_controller_until_the_person_gives_the_robot_back(pad: Pad) -> None:
    """Without the dead man's button the controller drives; letting go of it stands still."""
    until(lambda: pad.drives(held=False) or bool(pad.neighbour.applied[-1][0]))
    for _ in range(20):
        assert not pad.drives(held=False)
    assert pad.neighbour.applied[-1][0]
    until(lambda: pad.drives(held=True))
    until(lambda: not pad.drives(held=False) and not pad.neighbour.applied[-1].any())
    for _ in range(30):  # the controller goes on commanding without effect
        pad.drives(held=False)
        assert not pad.neighbour.applied[-1].any()

    def given_back() -> bool:
        pad.say(held=False, gives_back=True)
        pad.neighbour.command(open_valves(pad.neighbour.robot))
        time.sleep(0.02)
        return bool(pad.neighbour.applied[-1][0])

    until(given_back)


@real_time
def test_a_plant_that_dies_while_it_is_asked_does_not_keep_the_hand_for_ever(
    neighbour: Neighbour, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first one takes the request and is gone before it answers; the next gives the robot back."""
    monkeypatch.setattr(teleop_node, "ANSWER_S", 0.5)
    asked, answers = threading.Event(), threading.Event()

    def die(_request: Trigger.Request, _response: Trigger.Response) -> Trigger.Response:
        asked.set()
        answers.wait()  # for as long as its node lives
        raise InterruptedError

    first = Node("plant", namespace=NAMESPACE)
    first.create_service(Trigger, GIVE_BACK, die)
    given: list[bool] = []
    driven: list[JointState] = []
    neighbour.node.create_subscription(JointState, TELEOP.name, driven.append, subscriber_qos(TELEOP))

    def give(_request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        given.append(True)
        response.success, response.message = True, "the controller has the robot again"
        return response

    node = TeleopNode(
        lambda _code: None, cli_args=["--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", "keyboard:=false"]
    )
    pad = Pad(neighbour)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        with spinning(first, lambda _error: None):
            until(lambda: pad.say(held=True) or bool(driven))
            until(lambda: pad.say(held=False, gives_back=True) or asked.is_set())
            answers.set()
        second = Node("plant", namespace=NAMESPACE)
        second.create_service(Trigger, GIVE_BACK, give)
        with spinning(second, lambda error: pytest.fail(repr(error))):
            until(lambda: pad.say(held=False, gives_back=True) or bool(given))
        node.stop()


@real_time
def test_without_a_plant_of_the_name_it_lists_the_robots_that_are_received(
    plant: PlantNode, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(teleop_node, "PATIENCE_S", 0.5)
    arguments = ["--ros-args", "-r", "__ns:=/alpha", "-p", "keyboard:=false"]
    said: list[str] = []

    def reported() -> bool:
        said.append(capfd.readouterr().err)
        return "no plant subscribes /alpha/teleop/command. Running robots: floating_platform." in "".join(
            said
        )

    node = TeleopNode(lambda _code: None, cli_args=arguments)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        until(reported)
        node.stop()


@real_time
def test_it_is_not_given_back_while_the_hand_moves_something(pad: Pad) -> None:
    until(lambda: pad.drives(held=True))
    client = pad.neighbour.node.create_client(Trigger, GIVE_BACK)
    assert client.wait_for_service(8.0)
    future = client.call_async(Trigger.Request())
    until(lambda: pad.drives(held=True) and future.done())
    assert not future.result().success


@real_time
def test_a_gamepad_that_dies_closes_the_valves(pad: Pad) -> None:
    until(lambda: pad.drives(held=True))
    since = time.monotonic()
    until(lambda: not pad.neighbour.applied[-1].any())
    assert time.monotonic() - since < 1.0
    time.sleep(0.3)
    pad.neighbour.command(open_valves(pad.neighbour.robot))
    time.sleep(0.2)
    assert not pad.neighbour.applied[-1].any()


@real_time
def test_keys_drive_and_are_the_dead_man_switch(
    neighbour: Neighbour, plant: PlantNode, ros_domain: RosDomain, tmp_path: Path
) -> None:
    """`fulmar teleop` on a terminal of its own: a key opens valves, no key closes them, x ends it."""
    master, slave = os.openpty()
    process = subprocess.Popen(
        [*FULMAR, "teleop", "floating_platform"],
        env=ros_domain.env,
        cwd=tmp_path,
        stdin=slave,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:

        def key(letter: str) -> bool:
            os.write(master, letter.encode())
            time.sleep(0.05)
            return bool(neighbour.applied[-1].any())

        until(lambda: key("w"), 20.0)
        assert (neighbour.applied[-1] != open_valves(neighbour.robot)).any()
        os.write(master, b" ")
        until(lambda: not neighbour.applied[-1].any())
        until(lambda: key("d"))
        until(lambda: not neighbour.applied[-1].any())  # nobody presses anything
        os.write(master, b"x")
        assert process.wait(5.0) == 0
    finally:
        process.kill()
        process.wait()
        os.close(master)
        os.close(slave)


def test_without_a_terminal_the_keyboard_is_refused_in_words(ros_domain: RosDomain, fulmar) -> None:
    code, _, err = fulmar("teleop", "floating_platform")
    assert code == 2
    assert "no terminal" in err
