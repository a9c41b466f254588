"""A driver of the user's own, from a folder outside the checkout: guarded as the shipped ones are."""

from __future__ import annotations

import importlib
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import yaml
from geometry_msgs.msg import QuaternionStamped
from std_srvs.srv import Trigger

from fulmar_bags.message_reader import stamp_ns
from fulmar_bringup.plant_row import plant_spec
from fulmar_bringup.processes import ProcessGroup
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.config.errors import BAD_USAGE, FAILED
from fulmar_core.config.paths import config_path
from fulmar_core.robots.topics import GIVE_BACK, SENSOR_WIRES
from fulmar_core.robots.wire_check import WARNINGS
from fulmar_ros.qos import subscriber_qos
from fulmar_ros.runtime import spinning
from hardware_drivers.driver_node import DriverNode
from tests.conftest import RosDomain
from tests.own_files import own_folder
from tests.ros.cli import fulmar, json_of
from tests.ros.neighbour import NAMESPACE, Neighbour, until

real_time = pytest.mark.real_time

PAGE = Path(__file__).resolve().parents[2] / "docs" / "own-driver.md"
STARTS_S = 40.0
ATTITUDE = SENSOR_WIRES["star_tracker"]
BOARD = """
import threading
from hardware_drivers.driver import DeviceDriver

SENT, CLOSED, RAISES, REFUSES, HOLD = [], [], [], [], threading.Event()
HOLD.set()

class Board(DeviceDriver):
    def __init__(self, robot, settings, *, patience_s):
        settings.options.get("pins", {})["first"]
    def write(self, command):
        HOLD.wait()
        SENT.append(command.tolist())
        if RAISES and command.any():
            raise OSError("relay 3 does not answer")
    def refusal(self):
        return REFUSES[-1] if REFUSES else ""
    def close(self):
        CLOSED.append(True)
"""
FILE = "title: own board\nrobot: floating_platform\ndriver:\n  kind: own_board:Board\n"
CLOSED = [0.0] * 8


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    with own_folder(tmp_path, monkeypatch):
        (tmp_path / "own_board.py").write_text(BOARD)
        (tmp_path / "own.yaml").write_text(FILE + "  options: {pins: {first: 1}}\n")
        yield tmp_path


@pytest.fixture
def exits() -> list[int]:
    """Exit codes that the node has asked for."""
    return []


@pytest.fixture
def node(neighbour: Neighbour, folder: Path, exits: list[int]) -> Iterator[DriverNode]:
    """A driver node whose driver is the user's `Board`, in this process."""
    parameters = {"robot": "floating_platform", "hardware": str(folder / "own.yaml"), "control_hz": "10.0"}
    words = [word for key, value in parameters.items() for word in ("-p", f"{key}:={value}")]
    node = DriverNode(exits.append, cli_args=["--ros-args", "-r", f"__ns:={NAMESPACE}", *words])
    with spinning(node, lambda error: pytest.fail(repr(error))):
        yield node
        node.stop()


@pytest.fixture
def board(node: DriverNode) -> ModuleType:
    """The user's module: what was sent, and what it is to do wrong."""
    return importlib.import_module("own_board")


STARS = """
    def read(self):
        import time
        from fulmar_core.wires.reading import Reading
        from hardware_drivers.feedback import Report
        now_ns = time.time_ns()
        measured_ns = now_ns // 200_000_000 * 200_000_000  # five times a second
        attitude = (0.0, 0.0, 1.0, 0.0) if measured_ns // 200_000_000 % 2 else (0.0, 0.0, 0.0, 1.0)
        return Report(None, None, now_ns, {"star_tracker": Reading(attitude, measured_ns)})
"""


@real_time
def test_a_star_tracker_of_the_device_is_published_once_a_reading_with_its_own_stamp(
    neighbour: Neighbour, folder: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    """The robot's YAML, outside of the checkout, names the sensor; the class reports it."""
    robot = yaml.safe_load(config_path("robots", "floating_platform").read_text(encoding="utf-8"))
    robot["sensors"]["star_tracker"] = {"rate_hz": 5.0}
    (folder / "robots").mkdir()
    (folder / "robots" / "floating_platform.yaml").write_text(yaml.safe_dump(robot))
    monkeypatch.setenv("FULMAR_CONFIGS", str(folder))
    (folder / "own_board.py").write_text(BOARD + STARS)
    found: list[tuple[str, int, float]] = []
    neighbour.node.create_subscription(
        QuaternionStamped,
        ATTITUDE.name,
        lambda message: found.append(
            (message.header.frame_id, stamp_ns(message.header.stamp), message.quaternion.w)
        ),
        subscriber_qos(ATTITUDE, reliable=True, depth=50),
    )
    request.getfixturevalue("node")
    until(lambda: len(found) >= 4)
    stamps = [stamp for _, stamp, _ in found]
    assert np.diff(stamps).tolist() == [200_000_000] * (len(stamps) - 1)
    assert all(frame == "inertial" for frame, *_ in found)
    assert [w for *_, w in found] == [0.0 if stamp // 200_000_000 % 2 else 1.0 for stamp in stamps]


def open_first(neighbour: Neighbour) -> None:
    neighbour.command([1.0] + [0.0] * 7)
    time.sleep(0.02)


@real_time
def test_silence_closes_it_and_a_write_that_raises_ends_it_closed(
    neighbour: Neighbour, board: ModuleType, node: DriverNode, exits: list[int]
) -> None:
    """The watchdog of 0.2 s; then a fault with its reason and the user's line, after the safe command."""
    until(lambda: bool(board.SENT))
    until(lambda: open_first(neighbour) or board.SENT[-1] != CLOSED)
    silent = time.monotonic()
    until(lambda: board.SENT[-1] == CLOSED)
    assert time.monotonic() - silent < 0.2 + 0.02 + 0.15
    until(lambda: not neighbour.applied[-1].any())
    assert node.guard.watchdog.trips == 1
    board.RAISES.append(True)
    until(lambda: open_first(neighbour) or bool(exits))
    assert exits == [FAILED]
    assert board.SENT[-1] == CLOSED
    reason = neighbour.said["plant"][0]
    assert reason.startswith("driver 'own_board:Board': write raised OSError: relay 3 does not answer (")
    assert "own_board.py:15)" in reason
    node.stop()
    assert board.CLOSED == [True]


@real_time
def test_a_device_that_refuses_is_held_until_a_person_gives_control_back(
    neighbour: Neighbour, board: ModuleType, node: DriverNode
) -> None:
    """Also after it obeys again, while its controller goes on: an operator may stand beside it."""
    until(lambda: open_first(neighbour) or any(any(sent) for sent in board.SENT))
    board.REFUSES.append("mode HOLD: commands do nothing")
    until(lambda: open_first(neighbour) or "mode HOLD" in neighbour.said["plant"][0])
    words, values = neighbour.said["plant"]
    assert "until `fulmar teleop ROBOT --give-back`" in words
    assert values[WARNINGS] == "mode HOLD: commands do nothing"
    give_back = neighbour.node.create_client(Trigger, GIVE_BACK)
    assert give_back.wait_for_service(5.0)
    refused = give_back.call(Trigger.Request())
    assert (refused.success, refused.message) == (False, "refused: mode HOLD: commands do nothing")
    board.REFUSES.clear()
    sent = len(board.SENT)
    until(lambda: open_first(neighbour) or len(board.SENT) > sent + 30)
    assert not any(any(command) for command in board.SENT[sent + 2 :])
    assert give_back.call(Trigger.Request()).success
    until(lambda: open_first(neighbour) or any(board.SENT[-1]))
    node.stop()


@real_time
def test_a_write_that_hangs_is_reported_and_does_not_hold_up_the_end(
    neighbour: Neighbour, board: ModuleType, node: DriverNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing but the device's own watchdog can stop it meanwhile; the node ends before a launcher would kill it."""
    monkeypatch.setattr("fulmar_ros.plant_node.PATIENCE_S", 0.5)
    until(lambda: bool(board.SENT) and "plant" in neighbour.said)
    board.HOLD.clear()
    try:
        until(lambda: "the backend has not finished a step for" in neighbour.said["plant"][0])
        began = time.monotonic()
        with pytest.raises(Exception, match="has not finished a write: it hangs"):
            node.stop()
        assert time.monotonic() - began < 4.0
        assert board.CLOSED == [True]
    finally:
        board.HOLD.set()


def test_a_constructor_that_raises_ends_the_node_with_one_line_and_exit_code_2(
    ros_domain: RosDomain, folder: Path
) -> None:
    (folder / "own.yaml").write_text(FILE)
    group = ProcessGroup()
    plan = RunPlan("floating_platform", "go_to_position", "lqr", "hardware", 10.0, hardware="own.yaml")
    group.start(plant_spec(plan))
    try:
        until(lambda: group.ended() is not None, STARTS_S)
        assert group.ended().returncode == BAD_USAGE
        raised = f"Board(robot, settings, patience_s=10) raised KeyError: 'first' ({folder}/own_board.py:10)."
        said = f"plant of 'floating_platform' could not start: driver 'own_board:Board': {raised}"
        until(lambda: group.last_words("plant") == said)
    finally:
        group.stop_all()


@real_time
@pytest.mark.slow
def test_a_constructor_that_raises_ends_a_run_with_one_line_and_exit_code_2(
    ros_domain: RosDomain, folder: Path
) -> None:
    (folder / "own.yaml").write_text(FILE)
    asked = (
        "run",
        "floating_platform",
        "--controller",
        "lqr",
        "--backend",
        "hardware",
        "--hardware",
        "own.yaml",
    )
    done = fulmar(*asked, "--goal", "1,0,0", "--record", "bag", env=ros_domain.env, cwd=folder)
    assert done.returncode == BAD_USAGE, done.stderr
    assert done.stdout == ""
    ours = [line for line in done.stderr.splitlines() if line.startswith("fulmar: ")]
    assert len(ours) == 1
    assert (
        "driver 'own_board:Board': Board(robot, settings, patience_s=10) raised KeyError: 'first'" in ours[0]
    )
    assert ours[0].endswith(f"({folder}/own_board.py:10).")
    assert "Traceback" not in done.stderr
    assert not (folder / "bag").exists()


class Relays:
    """The emulated relay board of the page, and the relays that it has shown to be on, newest last."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "board.py"], stdout=subprocess.PIPE, text=True, stderr=subprocess.PIPE
        )
        assert self._process.stdout is not None
        assert self._process.stdout.readline() == "ready\n", self._process.communicate()[1]

    def next(self) -> str:
        """Wait for the next change; give the relays that are on then."""
        assert self._process.stdout is not None
        return self._process.stdout.readline().strip()

    def close(self) -> None:
        self._process.kill()
        self._process.communicate()


@pytest.fixture
def relays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Relays]:
    """The page's three files in a folder outside the checkout, with its emulated board running."""
    monkeypatch.chdir(tmp_path)
    page = PAGE.read_text(encoding="utf-8")
    for name, code in re.findall(r"`(\w+\.\w+)`[^`]*\n```\w+\n(.*?)^```", page, re.MULTILINE | re.DOTALL):
        (tmp_path / name).write_text(code)
    board = Relays()
    yield board
    board.close()


def test_the_class_of_the_page_is_short() -> None:
    (code,) = re.findall(r"^(class RelayBoard.*?)^```", PAGE.read_text(), re.MULTILINE | re.DOTALL)
    assert len(code.splitlines()) <= 40


@real_time
@pytest.mark.timeout(120)
def test_the_relay_board_of_the_page_opens_a_valve_and_is_closed_by_watchdog_and_sigterm(
    neighbour: Neighbour, relays: Relays, tmp_path: Path
) -> None:
    """The driver node as a process of its own in that folder; thruster 5 hangs on relay 1 by the file's order."""
    plan = RunPlan(
        "floating_platform", "go_to_position", "lqr", "hardware", 10.0, hardware="relay_board.yaml"
    )
    group = ProcessGroup()
    group.start(plant_spec(plan))
    command = [0.0] * 8
    command[5] = 1.0
    try:
        assert relays.next() == ""  # the safe command at the start
        until(
            lambda: neighbour.command(command) or any(applied.any() for applied in neighbour.applied),
            STARTS_S,
        )
        assert relays.next() == "1"
        silent = time.monotonic()
        assert relays.next() == ""
        assert time.monotonic() - silent < 0.2 + 0.02 + 0.15
        until(lambda: neighbour.command(command) or neighbour.applied[-1].any())
        assert relays.next() == "1"
        driver = group.process("plant")
        driver.send_signal(signal.SIGTERM)
        assert relays.next() == ""
        assert driver.wait(10.0) == 0
        assert int(neighbour.said["plant"][1]["sent"]) > 10
    finally:
        group.stop_all()


@real_time
@pytest.mark.slow
@pytest.mark.timeout(120)
def test_commission_clicks_each_relay_of_the_page_in_the_order_of_its_channels(
    ros_domain: RosDomain, relays: Relays, tmp_path: Path
) -> None:
    done = fulmar("commission", "relay_board.yaml", "--json", env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert json_of(done.stdout)["clicked"] == [f"channel {number}" for number in range(8)]
    assert relays.next() == ""
    for number in range(8):
        assert relays.next() == str(number)
        assert relays.next() == ""
