"""`fulmar commission`: wires of a file, the line that is written, and sessions that must end safely."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest
import rclpy
import yaml
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseStamped
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool

from fulmar_bringup.commissioning.by_kind import PULSED
from fulmar_bringup.commissioning.commission import WIRINGS, Request, commission, is_right, rewired
from fulmar_bringup.commissioning.hardware_file import line_of, wires_of, with_line, write_line
from fulmar_bringup.commissioning.session import Session
from fulmar_core.config.errors import ConfigError, RunFailed
from fulmar_core.config.paths import OWN_FOLDERS, config_names
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import ACTUATORS_STATE, AIR_BEARING, COMMAND, DIAGNOSTICS, MOCAP
from fulmar_ros.convert import VectorWriter, stamp_of
from fulmar_ros.qos import publisher_qos, subscriber_qos
from fulmar_ros.runtime import spinning
from hardware_drivers.hardware import hardware_path, load_hardware
from hardware_drivers.valves import to_message
from hardware_drivers.wiring import channels
from tests.new_robots import write_new_robots

ROBOT = load_robot("floating_platform")


def test_a_family_that_no_procedure_moves_is_refused_before_anything_starts(tmp_path, monkeypatch):
    write_new_robots(tmp_path)
    monkeypatch.setenv(OWN_FOLDERS, str(tmp_path))
    path = tmp_path / "fans.yaml"
    path.write_text("title: t\nrobot: fan_disc\ndriver:\n  kind: my_fans:Board\n", encoding="utf-8")
    with pytest.raises(
        ConfigError, match=r"no pulses are known for 'fan_disc', which has fans; there are some for"
    ):
        commission(Request(str(path), pulses=True), print)


def test_an_aircraft_has_no_wires_to_pulse():
    with pytest.raises(ConfigError, match="no pulses are known for 'airship_v7', which has control_surfaces"):
        commission(Request("xplane", pulses=True), print)


def pulsed(name: str) -> bool:
    """Whether a hardware file is of a robot that commissioning moves."""
    return load_robot(load_hardware(name).robot).actuators.kind in PULSED


@pytest.mark.parametrize("name", [name for name in config_names("hardware") if pulsed(name)])
def test_a_wire_s_command_reaches_that_wire_alone(name):
    hardware = load_hardware(name)
    robot = load_robot(hardware.robot)
    for number, wire in enumerate(wires_of(hardware)):
        command = PULSED[robot.actuators.kind].command(robot.actuators, wire, 0.5)
        order = getattr(hardware.driver, "order", None)
        if order is not None:
            sent = np.array(to_message(command, bearing=False, order=order)[1:], dtype=float)
        elif robot.name == "turtlebot2":
            rims = robot.actuators.wheel_speeds(command)
            sent = np.array(channels(hardware.driver.wiring, *rims))
        else:
            sent = np.array(channels(hardware.driver.wiring, *command))
        assert sent[number] > 0.0
        assert np.count_nonzero(np.abs(sent) > 1e-9) == 1


@pytest.mark.parametrize("name", ["zero_g_lab", "zero_g_lab_roboran_valve_node"])
def test_the_order_is_replaced_in_its_line_and_all_else_stays(name, tmp_path):
    order = [7, 6, 5, 4, 3, 2, 1, 0]
    write_line(hardware_path(name), tmp_path / "mine.yaml", "order", order)
    old, new = hardware_path(name).read_text().splitlines(), (tmp_path / "mine.yaml").read_text().splitlines()
    changed = [(a, b) for a, b in zip(old, new, strict=True) if a != b]
    assert [b for _, b in changed] == ["  order: [7, 6, 5, 4, 3, 2, 1, 0]"]
    assert load_hardware(str(tmp_path / "mine.yaml")).driver.order == tuple(order)


@pytest.mark.parametrize(
    "text",
    [
        "driver:\n  kind: kobuki # the base\n  port: /dev/ttyUSB0\n",
        "driver:\n  kind: kobuki\n  port: /dev/ttyUSB0\n  wiring: [left, right] # as delivered\n  # wiring: no\n",
        "driver: {kind: kobuki, port: /dev/ttyUSB0, wiring: [left, right]}\n",
    ],
)
def test_a_wiring_is_added_or_replaced_and_read_back(text):
    new = with_line(text, "wiring", ["right", "-left"])
    assert yaml.safe_load(new)["driver"] == {
        "kind": "kobuki",
        "port": "/dev/ttyUSB0",
        "wiring": ["right", "-left"],
    }
    assert "# the base" in new or "# the base" not in text


@pytest.mark.parametrize(
    "text", ["driver:\n  kind: v\n  order:\n    - 1\n    - 0\n", "order: [1]\norder: [2]\n"]
)
def test_a_file_without_such_a_line_is_left_and_the_line_printed(text):
    with pytest.raises(ConfigError, match=r"Write into it: order: \[1, 0\]"):
        with_line(text, "order", [1, 0])


def test_a_named_order_is_replaced_by_a_list():
    assert with_line("  order: roboran # theirs\n", "order", [1, 0]) == "  order: [1, 0]\n"
    assert line_of("wiring", ["-left", "right"]) == "wiring: [-left, right]"


@pytest.mark.parametrize("wiring", WIRINGS)
def test_emulated_wirings_differ_by_their_seed_and_are_recognised(wiring):
    hardware = load_hardware("turtlebot2")
    emulated = {"sides": ["left", "right"], **rewired(hardware, wiring, 1)}
    if wiring == "shuffled":
        assert len({str(rewired(hardware, wiring, seed)) for seed in range(20)}) > 4
    dead = emulated.get("dead", [])
    names = {"left": "left wheel", "right": "right wheel", "-left": "-left wheel", "-right": "-right wheel"}
    wires = [
        {"name": f"{side} channel", "drives": None if number in dead else names[emulated["sides"][number]]}
        for number, side in enumerate(("left", "right"))
    ]
    found = {"wires": wires, "dead": [wires[number]["name"] for number in dead], "inverted": False}
    assert is_right(hardware, emulated, found)
    wires[1]["drives"] = "left wheel"
    assert not is_right(hardware, emulated, found)


class FakeDriver:
    """A driver node's wires: echoes commands as applied, and reports poses, air and health."""

    def __init__(self, node) -> None:
        self.message, self.mode, self.x, self.posing = "running", "running", 0.0, True
        self.commands: list[np.ndarray] = []
        self._state = node.create_publisher(JointState, ACTUATORS_STATE.name, publisher_qos(ACTUATORS_STATE))
        self._poses = node.create_publisher(PoseStamped, MOCAP.name, publisher_qos(MOCAP))
        self._health = node.create_publisher(DiagnosticArray, DIAGNOSTICS.name, publisher_qos(DIAGNOSTICS))
        air = node.create_publisher(Bool, AIR_BEARING.name, publisher_qos(AIR_BEARING))
        air.publish(Bool(data=True))
        self._write, self._now = VectorWriter(ROBOT.actuators.names), node.get_clock().now
        node.create_subscription(JointState, COMMAND.name, self._take, subscriber_qos(COMMAND, depth=50))
        node.create_timer(0.02, self._tick)
        self._air = air

    def _take(self, message: JointState) -> None:
        self.commands.append(np.array(message.effort))

    def _tick(self) -> None:
        stamp_ns = self._now().nanoseconds
        applied = self.commands[-1] if self.commands else np.zeros(8)
        self._state.publish(self._write.write(applied, stamp_ns))
        if self.posing:
            pose = PoseStamped()
            pose.header.stamp = stamp_of(stamp_ns)
            pose.pose.position.x, pose.pose.orientation.w = self.x, 1.0
            self._poses.publish(pose)
        values = [KeyValue(key="mode", value=self.mode)]
        status = DiagnosticStatus(name=f"{ROBOT.name}: plant", message=self.message, values=values)
        self._health.publish(DiagnosticArray(status=[status]))


@pytest.fixture
def bench(ros_domain) -> Iterator[tuple[Session, FakeDriver]]:
    """A session that is ready, and the driver that it commands."""
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("bench", namespace=f"/{ROBOT.name}")
    with spinning(node, lambda error: pytest.fail(repr(error))):
        session = Session(node, ROBOT, from_outside=True, bearing=True, ended=lambda: "")
        driver = FakeDriver(node)
        session.until_ready()
        yield session, driver
    rclpy.try_shutdown()


def test_a_pulse_lasts_as_asked_and_ends_closed(bench):
    session, driver = bench
    driver.commands.clear()
    pulse = session.pulse(np.eye(8)[2], 0.12)
    assert 0.08 <= pulse.end_s - pulse.begin_s <= 0.3
    assert np.count_nonzero(np.any(driver.commands, axis=1)) >= 3
    assert not driver.commands[-1].any()
    assert len(session.track().time_s) > 5


def estop(driver):
    driver.message = "e-stop: pressed: actuators in their safe state"


def lost(driver):
    driver.posing = False


def far(driver):
    driver.x = 0.51


def fault(driver):
    driver.mode, driver.message = "fault", "the chip is gone"


@pytest.mark.parametrize(
    ("happens", "says"),
    [
        (estop, "driver: e-stop: pressed"),
        (lost, r"no pose for \d+ ms \(limit 500 ms\)"),
        (far, r"0\.51 m from its start \(limit 0\.5 m\)"),
        (fault, "driver: the chip is gone"),
    ],
)
def test_what_must_stop_a_commissioning_ends_it_and_closes_the_valves(bench, happens, says):
    session, driver = bench
    threading.Timer(0.1, lambda: happens(driver)).start()
    began = time.monotonic()
    with pytest.raises(RunFailed, match=says):
        session.pulse(np.eye(8)[0], 3.0)
    assert time.monotonic() - began < 1.0
    session.make_safe()
    until = time.monotonic() + 1.0
    while driver.commands[-1].any() and time.monotonic() < until:
        time.sleep(0.01)
    assert not driver.commands[-1].any()
