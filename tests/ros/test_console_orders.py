"""The console beside a plant: stops, resets, drives, and hangs, as a page sees it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from rclpy.node import Node
from std_msgs.msg import Bool
from std_srvs.srv import Trigger

from fulmar_console.live.fleet import Fleet
from fulmar_console.live.health import health_of
from fulmar_console.live.orders import Orders
from fulmar_console.live.robot_state import RobotState
from fulmar_console.live.ros_side import RosSide
from fulmar_core.robots.topics import ESTOP, ESTOP_RESET
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.qos import subscriber_qos
from fulmar_ros.runtime import spinning
from tests.ros.console_page import Page
from tests.ros.neighbour import NAMESPACE, ROBOT, Neighbour, open_valves, until

pytestmark = pytest.mark.real_time


class Console:
    """The console's node in this process."""

    def __init__(self, node: Node) -> None:
        self.node, self.fleet = node, Fleet()
        self.ros = RosSide(node, self.fleet)
        self.orders = Orders(node, self.fleet)
        self.page = Page(self.orders.do, ROBOT)

    @property
    def robot(self) -> RobotState:
        return self.fleet.robots[ROBOT]

    @property
    def health(self) -> dict:
        with self.fleet.lock:
            return health_of(self.robot)

    def receives(self) -> bool:
        return ROBOT in self.fleet.robots and self.robot.info is not None and self.robot.applied_s > 0.0

    def silent_s(self) -> float:
        return time.monotonic() - self.ros.alive_s


@pytest.fixture
def console(neighbour: Neighbour, plant: PlantNode) -> Iterator[Console]:
    node = Node("console")
    made = Console(node)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        until(made.receives)
        yield made
        made.ros.close()


class Commands:
    """A controller that holds a valve open, 50 times a second, until it is asked to rest."""

    def __init__(self, neighbour: Neighbour) -> None:
        self._neighbour, self._over = neighbour, threading.Event()
        self.values = open_valves(neighbour.robot)
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        while not self._over.wait(0.02):
            self._neighbour.command(self.values)

    def rest(self) -> None:
        """Command what is safe."""
        self.values = [0.0] * len(self.values)

    def end(self) -> None:
        """Fall silent."""
        self._over.set()
        self._thread.join()


@pytest.fixture
def commands(neighbour: Neighbour, console: Console) -> Iterator[Commands]:
    made = Commands(neighbour)
    until(lambda: bool(neighbour.applied[-1].any()))
    yield made
    made.end()


def still(neighbour: Neighbour) -> bool:
    return not neighbour.applied[-1].any()


def test_an_e_stop_while_a_valve_is_open_closes_it_and_is_accepted_once_the_plant_says_so(
    neighbour: Neighbour, console: Console, commands: Commands
) -> None:
    answered = console.page.send("estop")
    until(lambda: still(neighbour), 0.3)
    until(lambda: bool(answered), 1.0)
    assert (answered[0].accepted, answered[0].words) == (True, "stopped")
    assert console.health["stopped"]
    until(lambda: "page 1 of /console" in console.health.get("estop_by", ""))
    assert console.health["words"].startswith("e-stop: pressed")
    # A robot that is stopped already says so again once a second only: that it lives is enough.
    again = console.page.ask("estop")
    assert again.accepted
    assert again.after_s < 0.5


def test_a_reset_is_refused_in_the_interlocks_words_while_a_controller_wants_to_move(
    neighbour: Neighbour, console: Console, commands: Commands
) -> None:
    assert console.page.ask("estop").accepted
    refused = console.page.ask("reset")
    assert not refused.accepted
    assert "refused" in refused.words
    assert console.health["estop"]
    commands.rest()
    released = console.page.ask("reset")
    assert released.accepted, released.words
    until(lambda: not console.health["estop"])
    assert console.health["last_command"]["words"].startswith("reset: ")
    kinds = [event["kind"] for event in console.robot.take_events()]
    assert [kind for kind in kinds if kind in ("estop", "reset")] == ["estop", "reset"]


def test_the_press_is_not_found_by_a_plant_that_starts_after_the_reset(
    neighbour: Neighbour, console: Console, commands: Commands
) -> None:
    commands.rest()
    assert console.page.ask("estop").accepted
    assert console.page.ask("reset").accepted
    until(lambda: not console.health["estop"])
    time.sleep(0.2)
    latched: list[bool] = []
    other = Node("late")
    qos = subscriber_qos(ESTOP, latched=True)
    with spinning(other, lambda error: pytest.fail(repr(error))):
        other.create_subscription(
            Bool, f"{NAMESPACE}/{ESTOP.name}", lambda message: latched.append(message.data), qos
        )
        time.sleep(1.0)
    assert latched == []


def test_a_robot_that_no_plant_answers_for_is_not_confirmed_within_half_a_second(console: Console) -> None:
    answered = Page(console.orders.do, "beta").ask("estop")
    assert not answered.accepted
    assert answered.words.startswith("NOT CONFIRMED: use the button at the robot (beta)")
    assert 0.5 < answered.after_s < 0.8


@pytest.mark.parametrize("name", ["", "Alpha", "a b", "a/b", "../x", "x" * 300, "é"])
def test_a_name_that_ros_cannot_take_is_refused_and_harms_nothing(console: Console, name: str) -> None:
    if name:
        assert not Page(console.orders.do, name).ask("estop").accepted
    assert not Page(console.orders.do, name or "*").ask("goal", targets=[[0.0] * 7]).accepted
    until(lambda: console.silent_s() < 0.2)
    assert console.page.ask("estop").accepted


def test_an_e_stop_reaches_the_plant_while_the_consoles_own_executor_hangs(
    neighbour: Neighbour, console: Console, commands: Commands
) -> None:
    go_on = threading.Event()
    console.orders.soon(lambda: go_on.wait(5.0) and None)
    until(lambda: console.silent_s() > 0.3)
    answered = console.page.send("estop")
    until(lambda: still(neighbour), 0.5)
    late = console.page.send("start")
    time.sleep(1.2)
    assert not answered  # nobody has read what the plant says
    assert console.silent_s() > 1.0  # and pages see that
    go_on.set()
    until(lambda: bool(late) and bool(answered))
    assert not late[0].accepted
    assert "hung" in late[0].words  # a command that has waited is not done any more
    assert console.health["estop"]


def test_a_command_that_fails_answers_and_ends_nothing(
    console: Console, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_arguments: object) -> None:
        raise RuntimeError("broken")

    monkeypatch.setitem(console.orders._ways, "start", fail)
    answered = console.page.ask("start")
    assert (answered.accepted, answered.words) == (False, "RuntimeError: broken")
    assert console.page.ask("estop").accepted


def test_an_e_stop_node_that_hangs_is_not_waited_for_without_end(console: Console) -> None:
    hung = Node("hung")  # its service is found, and no one serves it
    hung.create_service(Trigger, f"{NAMESPACE}/{ESTOP_RESET}", lambda _request, response: response)
    client = console.orders._client(Trigger, f"{NAMESPACE}/{ESTOP_RESET}")
    until(client.service_is_ready)
    answered = console.page.ask("reset")
    assert not answered.accepted
    assert "no answer" in answered.words
    assert answered.after_s < 6.0
    hung.destroy_node()


def drive(page: Page, share: list[float], until_: Callable[[], bool], **more: bool) -> list:
    """Hold a key until something happens."""
    answers = []

    def held() -> bool:
        answers.append(page.send("teleop", share=share, **more))
        time.sleep(0.03)
        return until_()

    until(held, 8.0)
    return [each[0] for each in answers if each]


def test_a_page_that_says_nothing_for_a_third_of_a_second_has_let_go_and_the_person_keeps_the_robot(
    neighbour: Neighbour, console: Console, commands: Commands
) -> None:
    commands.values = open_valves(neighbour.robot)
    ahead: list[float] = [1.0, 0.0, 0.0]
    drive(console.page, ahead, lambda: int(np.count_nonzero(neighbour.applied[-1])) > 1)
    began_s = time.monotonic()
    until(lambda: still(neighbour))
    assert time.monotonic() - began_s < 0.6
    until(lambda: console.health["commanded_by"] == "person")
    for _ in range(20):  # the controller goes on commanding without effect
        time.sleep(0.02)
        assert still(neighbour)
    given = console.page.ask("give_back")
    assert given.accepted, given.words
    until(lambda: bool(neighbour.applied[-1].any()))
    until(lambda: console.health["commanded_by"] == "controller")
    time.sleep(0.5)
    assert neighbour.applied[-1].any()  # the console has taken nothing back


def test_a_page_that_has_gone_drives_no_more_and_another_one_gives_the_robot_back(
    neighbour: Neighbour, console: Console, commands: Commands
) -> None:
    commands.rest()
    until(lambda: still(neighbour))
    drive(console.page, [0.0, 0.0, 1.0], lambda: bool(neighbour.applied[-1].any()))
    other = Page(console.orders.do, ROBOT, "page 2")
    refused = other.ask("teleop", share=[1.0, 0.0, 0.0])
    assert (refused.accepted, refused.words) == (False, "page 1 drives it")
    console.orders.forget("page 1")
    until(lambda: still(neighbour), 0.3)
    until(lambda: other.ask("give_back").accepted)


def test_without_the_dead_man_s_switch_nothing_moves(neighbour: Neighbour, console: Console) -> None:
    for _ in range(20):
        console.page.send("teleop", share=[1.0, 0.0, 0.0], deadman=False)
        time.sleep(0.03)
    assert still(neighbour)


def test_a_plant_that_is_stopped_by_the_page_is_left_and_received_again_once_it_runs(
    console: Console,
) -> None:
    assert console.page.ask("stop").accepted
    until(lambda: console.health["mode"] == "inactive")
    until(lambda: ROBOT not in console.ros._received)
    again = console.page.ask("stop")
    assert not again.accepted
    assert "refuses" in again.words
    assert console.page.ask("start").accepted
    until(lambda: ROBOT in console.ros._received)
    seen_s = console.robot.applied_s
    until(lambda: console.robot.applied_s > seen_s)
