"""Driver nodes on emulated devices: whole runs, dead drivers and the bearing."""

from __future__ import annotations

import logging
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from queue import SimpleQueue

import numpy as np
import psutil
import pytest
import rclpy
from mcap.reader import make_reader
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool
from std_srvs.srv import SetBool

from fulmar_bringup.domains import reserved_domains
from fulmar_bringup.emulation import emulation_of
from fulmar_bringup.emulator_row import emulator_spec
from fulmar_bringup.plant_row import plant_spec
from fulmar_bringup.processes import ProcessGroup
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system import default_hardware
from fulmar_core.config.errors import DeviceError, FulmarError
from fulmar_core.config.paths import config_names, config_path
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import AIR_BEARING, DEVICE_STATE
from fulmar_ros.qos import subscriber_qos
from hardware_drivers.devices import own_watchdog, when_the_driver_dies
from hardware_drivers.driver_node import DriverNode
from hardware_drivers.hardware import load_hardware
from sim_nodes.emulators.outputs import ValveBank
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of
from tests.ros.neighbour import Neighbour, until

real_time = pytest.mark.real_time

STARTS_S = 40.0


class Rig:
    """An emulator and a driver, each a process, and what the emulated device does by itself."""

    def __init__(self, neighbour: Neighbour, hardware: str, folder: Path) -> None:
        self.neighbour, self.robot = neighbour, neighbour.robot.name
        self.device: list[np.ndarray] = []
        qos = subscriber_qos(DEVICE_STATE, reliable=True, depth=50)
        neighbour.node.create_subscription(JointState, DEVICE_STATE.name, self._received, qos)
        found = load_hardware(hardware)
        emulation = emulation_of(found, folder)
        plan = RunPlan(self.robot, "go_to_position", "policy", "hardware", 10.0)
        plan = replace(plan, hardware=default_hardware(self.robot, hardware), emulated=True)
        plan = replace(plan, arm=found.arms)
        self.group = ProcessGroup()
        self.group.start(emulator_spec(plan, emulation))
        self.plant = plant_spec(plan, port=emulation.port)
        self.group.start(self.plant)

    def _received(self, message: JointState) -> None:
        self.device.append(np.array(message.effort))

    @property
    def driver(self) -> psutil.Process:
        return self.group.process("plant")

    def command(self) -> None:
        """As hard as it goes, in the wire of the robot."""
        if self.robot == "turtlebot2":
            message = self.neighbour.twist(0.4, 0.0)
            self.neighbour.drive.publish(message)
        else:
            self.neighbour.command([1.0] + [0.0] * (len(self.neighbour.robot.actuators.names) - 1))
        time.sleep(0.03)

    def until_it_moves(self) -> None:
        until(lambda: self.command() or (bool(self.device) and self.device[-1].any()), STARTS_S)


@pytest.fixture
def rig(neighbour: Neighbour, request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Rig]:
    made = Rig(neighbour, request.param, tmp_path)
    yield made
    made.group.stop_all()


def is_watched(name: str) -> bool:
    """Whether a device that this rig can drive stops by itself; what flies or floats in space has tests of its own."""
    file = load_hardware(name)
    return bool(own_watchdog(file.driver)) and load_robot(file.robot).state_type.AXES == 2


WATCHED = [name for name in config_names("hardware") if is_watched(name)]
UNWATCHED = ("zero_g_lab", "zero_g_lab_valve_node", "kingfisher_action")


def devices(names):
    return pytest.mark.parametrize(
        ("neighbour", "rig"), [(load_hardware(name).robot, name) for name in names], indirect=True, ids=names
    )


@pytest.mark.slow
@pytest.mark.timeout(240)
@devices(WATCHED)
@real_time
def test_a_killed_driver_leaves_the_device_to_its_own_watchdog(rig: Rig, request) -> None:
    """SIGKILL while it drives: the emulator's own last command is a stop, at its own time."""
    name = request.node.callspec.id
    own_s = own_watchdog(load_hardware(name).driver).within_s
    rig.until_it_moves()
    rig.driver.send_signal(signal.SIGKILL)
    dead = time.monotonic()
    assert rig.device[-1].any()
    until(lambda: not rig.device[-1].any())
    took_s = time.monotonic() - dead
    logging.info(
        f"{name}: stopped {took_s:.2f} s after SIGKILL, {when_the_driver_dies(load_hardware(name).driver)}"
    )
    assert took_s < own_s + 0.3
    time.sleep(0.5)
    assert not rig.device[-1].any()


@pytest.mark.slow
@pytest.mark.timeout(240)
@devices(UNWATCHED)
@real_time
def test_a_killed_driver_without_a_watchdog_below_moves_on_and_a_new_one_stops_it(rig: Rig, request) -> None:
    """The hardware file says so in capitals. A driver that starts again begins with the safe command."""
    rig.until_it_moves()
    rig.driver.send_signal(signal.SIGKILL)
    time.sleep(1.0)
    assert rig.device[-1].any()
    began = time.monotonic()
    rig.group.start(rig.plant)
    until(lambda: not rig.device[-1].any(), STARTS_S)
    logging.info(
        f"{request.node.callspec.id}: moved on; stopped {time.monotonic() - began:.2f} s after a new driver"
    )


@pytest.fixture
def valves(neighbour: Neighbour, tmp_path: Path) -> Iterator[tuple[ValveBank, psutil.Process]]:
    """Valves on pins, and the driver that has opened one of them; a process."""
    bank = ValveBank(
        tmp_path / "pins", neighbour.robot, order=load_hardware("zero_g_lab").driver.order, active_low=True
    )
    plan = RunPlan("floating_platform", "go_to_position", "policy", "hardware", 10.0)
    group = ProcessGroup()
    group.start(plant_spec(replace(plan, hardware="zero_g_lab"), port=bank.address))
    try:
        first = [1.0] + [0.0] * 7
        until(lambda: neighbour.command(first) or bank.command(0.0).any(), STARTS_S)
        yield bank, group.process("plant")
    finally:
        group.stop_all()
        bank.close()


@real_time
@pytest.mark.timeout(120)
@pytest.mark.parametrize(
    "number", ["SIGHUP", *(pytest.param(n, marks=pytest.mark.slow) for n in ("SIGTERM", "SIGINT", "SIGQUIT"))]
)
def test_a_driver_that_is_asked_to_end_closes_its_valves_first(valves, number: str) -> None:
    """SIGHUP is what a driver receives whose ssh connection drops."""
    bank, driver = valves
    driver.send_signal(signal.Signals[number])
    until(lambda: not bank.command(0.0).any(), timeout_s=1.0)
    assert driver.wait(10.0) == 0


@real_time
@pytest.mark.slow
@pytest.mark.timeout(120)
def test_a_node_that_was_started_by_nohup_goes_on_without_its_terminal(neighbour, tmp_path: Path) -> None:
    """Who says `nohup` means it."""
    node = [
        sys.executable,
        "-m",
        "fulmar_ros.estop_node",
        "--ros-args",
        "-r",
        f"__ns:=/{neighbour.robot.name}",
    ]
    started = subprocess.Popen(["nohup", *node], cwd=tmp_path, stdin=subprocess.DEVNULL)
    try:
        until(lambda: "estop" in neighbour.said, STARTS_S)
        started.send_signal(signal.SIGHUP)
        neighbour.said.clear()
        until(lambda: "estop" in neighbour.said)
    finally:
        started.terminate()
        assert started.wait(10.0) == 0


@real_time
@pytest.mark.slow
@pytest.mark.timeout(240)
@pytest.mark.parametrize(("neighbour", "rig"), [("floating_platform", "zero_g_lab")], indirect=True)
def test_silence_closes_the_valves_and_the_state_shows_it(rig: Rig) -> None:
    """The driver's watchdog of 0.2 s at 10 Hz; the bearing stays on."""
    rig.until_it_moves()
    silent = time.monotonic()
    until(lambda: not rig.device[-1].any())
    assert time.monotonic() - silent < 0.2 + 0.02 + 0.15
    until(lambda: not rig.neighbour.applied[-1].any())
    until(lambda: rig.neighbour.said["plant"][1].get("air_bearing") == "on")


@real_time
@pytest.mark.slow
@pytest.mark.timeout(240)
@pytest.mark.parametrize(("neighbour", "rig"), [("floating_platform", "zero_g_lab")], indirect=True)
def test_the_bearing_has_a_service_and_a_state_of_its_own(rig: Rig) -> None:
    """Off: valves stay closed whatever is commanded, and the applied state shows it. On again: they open."""
    states: list[bool] = []
    node = rig.neighbour.node
    node.create_subscription(
        Bool, AIR_BEARING.name, lambda message: states.append(message.data), subscriber_qos(AIR_BEARING)
    )
    enable = node.create_client(SetBool, "air_bearing/enable")
    rig.until_it_moves()
    assert enable.wait_for_service(10.0)
    for on in (False, True):
        answer = enable.call_async(SetBool.Request(data=on))
        until(answer.done)
        assert answer.result().success
        until(lambda on=on: rig.command() or bool(rig.neighbour.applied[-1].any()) is on)
        until(lambda on=on: states[-1] is on)


RUNS = (  # with as many seconds as each needs to get there and stay for four
    ("floating_platform", "go_to_pose", "zero_g_lab", "11"),
    ("turtlebot2", "go_to_position", "turtlebot2", "9"),
    ("kingfisher", "go_to_position", "kingfisher", "16"),
    ("kingfisher", "go_to_position", "kingfisher_ardupilot", "16"),
)


@real_time
@pytest.mark.slow
@pytest.mark.timeout(240)
def test_runs_reach_their_goals_through_the_protocols(ros_domain: RosDomain, tmp_path: Path) -> None:
    """Driver, protocol, controller and recorder as on the robot; evaluated by where the emulated robot really is."""
    with reserved_domains(2) as domains, ThreadPoolExecutor(2) as pool:
        free: SimpleQueue[int] = SimpleQueue()
        for domain in domains:
            free.put(domain)

        def run(case: tuple[str, str, str, str]) -> subprocess.CompletedProcess[str]:
            robot, task, hardware, seconds = case
            domain = free.get()
            env = {**ros_domain.env, "ROS_DOMAIN_ID": str(domain)}
            asked = (
                "run",
                robot,
                "--task",
                task,
                "--backend",
                "hardware",
                "--hardware",
                hardware,
                "--emulate",
            )
            more = ("--start", "0,0,0", "--goal", "0.5,0.1,10", "--duration", seconds, "--record", hardware)
            more += ("--arm",) if hardware == "kingfisher_ardupilot" else ()
            try:
                return fulmar(*asked, *more, "--json", env=env, cwd=tmp_path)
            finally:
                free.put(domain)

        done = list(pool.map(run, RUNS))
    for (robot, _task, hardware, _seconds), ended in zip(RUNS, done, strict=True):
        summary = json_of(ended.stdout)
        assert summary["failure"] is None, (hardware, ended.stderr)
        assert summary["success"], hardware
        with next((tmp_path / hardware).glob("*.mcap")).open("rb") as stream:
            reader = make_reader(stream)
            topics = {channel.topic for channel in reader.get_summary().channels.values()}
            attached = {attachment.name for attachment in reader.iter_attachments()}
        assert {f"/{robot}/odom", f"/{robot}/actuators/state", f"/{robot}/emulator/actuators"} <= topics
        assert "hardware.yaml" in attached


def test_a_driver_whose_device_is_not_there_says_what_to_do(ros_domain: RosDomain, tmp_path) -> None:
    """Exit code 2 of the node, 1 of a run; one line each."""
    path = tmp_path / "mine.yaml"
    path.write_text("title: t\nrobot: turtlebot2\ndriver: {kind: kobuki, port: /dev/ttyNONE}\n")
    group = ProcessGroup()
    plan = RunPlan("turtlebot2", "go_to_position", "policy", "hardware", 10.0, hardware=str(path))
    spec = plant_spec(plan)
    group.start(replace(spec, parameters={**spec.parameters, "connect_s": 0.1}))
    try:
        until(lambda: group.ended() is not None, STARTS_S)
        assert group.ended().returncode == 2
        assert "/dev/ttyNONE cannot be opened" in group.last_words("plant")
    finally:
        group.stop_all()


@pytest.mark.parametrize(
    ("asked", "arms"),
    [({"arm": "true"}, True), ({"arm": "false"}, False), ({"unattended": "true"}, False)],
    ids=["armed", "not armed", "in a service"],
)
def test_a_boat_s_driver_says_what_it_will_do_before_it_touches_the_autopilot(
    ros_domain: RosDomain, monkeypatch, capfd, tmp_path, asked: dict[str, str], arms: bool
) -> None:
    """The autopilot is reached by `make_device` alone; by then the log has it, and the driver knows whether to arm."""
    seen: list[tuple[bool, str]] = []

    def reach(_robot, hardware, **_more):
        seen.append((hardware.driver.arm, capfd.readouterr().err))
        raise DeviceError("no autopilot here")

    monkeypatch.setattr("hardware_drivers.driver_node.make_device", reach)
    hardware = "kingfisher_ardupilot"
    if "unattended" in asked:  # a file that arms does not count
        text = config_path("hardware", hardware).read_text().replace("arm: false", "arm: true")
        (tmp_path / "armed.yaml").write_text(text)
        hardware = str(tmp_path / "armed.yaml")
    parameters = {"robot": "kingfisher", "hardware": hardware, **asked}
    arguments = [word for key, value in parameters.items() for word in ("-p", f"{key}:={value}")]
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    try:
        with pytest.raises(FulmarError, match="no autopilot here"):
            DriverNode(lambda _code: None, cli_args=["--ros-args", *arguments])
    finally:
        rclpy.try_shutdown()
    ((armed, log),) = seen
    assert armed is arms
    will = "will set MANUAL, ARM THE BOAT, and override RC channels 1 (steering) and 3 (throttle)"
    assert (will in log) is arms
    assert ("not armed: arm: true or --arm" in log) is not arms
