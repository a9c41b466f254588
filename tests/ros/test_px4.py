"""PX4 and ArduPlane under the driver node, with the physics of the robot behind them: whole runs, and dead drivers."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from std_msgs.msg import Bool

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import ESTOP
from fulmar_core.robots.wire_check import WARNINGS
from fulmar_ros.px4_wires import Px4Wires
from fulmar_ros.qos import publisher_qos
from fulmar_ros.runtime import spinning
from hardware_drivers.driver_node import DriverNode
from sim_nodes.emulators.arduplane import GUIDED, RTL, ArduPlaneEmulator
from sim_nodes.emulators.px4 import Px4Emulator
from tests.conftest import RosDomain
from tests.hardware_drivers.bench import Bench
from tests.hardware_drivers.boat_bench import free_udp_port
from tests.hardware_drivers.px4_bench import ORDER, START
from tests.hardware_drivers.wing_bench import ROBOT as WING
from tests.hardware_drivers.wing_bench import WingBench, trim
from tests.ros.cli import fulmar, json_of
from tests.ros.neighbour import Neighbour, until

pytestmark = [pytest.mark.real_time, pytest.mark.timeout(240)]

ROBOT = "modular_freeflyer"
OPEN = [1.0] + [0.0] * 7
STARTS_AND_ENDS_S = 60.0  # of a run on a busy machine: PX4's proof of the stream and its rehearsal take 5 s


@pytest.fixture
def bench(neighbour: Neighbour) -> Iterator[Bench]:
    """A free flyer behind PX4, on its topics."""
    wires = Px4Wires(neighbour.node, "", as_px4=True)

    def make(_backend: object) -> Px4Emulator:
        device = Px4Emulator(load_robot(ROBOT), ORDER, wing=False)
        device.connect(wires)
        return device

    made = Bench(ROBOT, make, start=START)
    yield made
    made.stop()
    wires.close()


@pytest.fixture
def node(neighbour: Neighbour, bench: Bench) -> Iterator[DriverNode]:
    parameters = {"robot": ROBOT, "hardware": f"{ROBOT}_px4", "arm": "true", "estop": "true"}
    words = [word for key, value in parameters.items() for word in ("-p", f"{key}:={value}")]
    node = DriverNode(lambda _code: None, cli_args=["--ros-args", "-r", f"__ns:=/{ROBOT}", *words])
    with spinning(node, lambda error: pytest.fail(repr(error))):
        yield node
        node.stop()


class Stop:
    """An e-stop that is published, and what is open behind PX4."""

    def __init__(self, neighbour: Neighbour, bench: Bench) -> None:
        self._neighbour, self._bench, self.pressed = neighbour, bench, False
        self._stop = neighbour.node.create_publisher(Bool, ESTOP.name, publisher_qos(ESTOP))

    def publish(self) -> None:
        self._stop.publish(Bool(data=self.pressed))
        time.sleep(0.03)

    def drive(self) -> None:
        self._neighbour.command(OPEN)
        self.publish()

    @property
    def opened(self) -> bool:
        return bool(self._bench.device.command(time.monotonic()).any())


@pytest.mark.parametrize("neighbour", [ROBOT], indirect=True)
def test_commands_reach_px4_and_the_e_stop_closes_its_thrusters(
    neighbour: Neighbour, bench: Bench, node: DriverNode
) -> None:
    stop = Stop(neighbour, bench)
    until(lambda: stop.drive() or stop.opened, 20.0)
    stop.pressed = True
    until(lambda: stop.drive() or not stop.opened, 2.0)
    end_s = time.monotonic() + 1.5
    while time.monotonic() < end_s:
        stop.drive()
        assert not stop.opened
    assert bench.device.armed
    assert bench.device.nav_state == 14


@pytest.mark.parametrize("neighbour", [ROBOT], indirect=True)
def test_a_silent_controller_leaves_px4_to_its_failsafe(
    neighbour: Neighbour, bench: Bench, node: DriverNode
) -> None:
    stop = Stop(neighbour, bench)
    until(lambda: stop.drive() or stop.opened, 20.0)
    silent_s = time.monotonic()
    until(lambda: stop.publish() or not stop.opened, 2.0)
    assert bench.device.armed
    until(lambda: stop.publish() or not bench.device.armed, 3.0)
    assert 1.0 < time.monotonic() - silent_s < 2.5
    words = "PX4 is not armed: its thrusters are closed"
    until(lambda: stop.publish() or words in neighbour.said["plant"][1].get(WARNINGS, ""), 5.0)


def run(*words: str, seconds: float, env: dict[str, str], cwd: Path) -> dict:
    """The summary of a run of so many seconds in real time, which are fewer than `fulmar` waits for its end."""
    asked = (
        "run",
        *words,
        "--duration",
        str(seconds),
        "--backend",
        "hardware",
        "--emulate",
        "--arm",
        "--json",
    )
    done = fulmar(*asked, env=env, cwd=cwd, timeout_s=seconds + STARTS_AND_ENDS_S)
    assert done.stdout, done.stderr
    summary = json_of(done.stdout)
    assert summary["failure"] is None, (summary["failure"], done.stderr)
    return summary


@pytest.mark.slow
def test_a_free_flyer_reaches_its_goal_through_px4(ros_domain: RosDomain, tmp_path: Path) -> None:
    """The command of the manual, with MuJoCo behind an emulated PX4."""
    goal = ("--controller", "lqr", "--hardware", "modular_freeflyer_px4", "--goal", "0.5,0.3")
    assert run(ROBOT, *goal, seconds=50.0, env=ros_domain.env, cwd=tmp_path)["success"]


@pytest.mark.slow
def test_sixteen_thrusters_in_space_reach_a_pose_through_px4(ros_domain: RosDomain, tmp_path: Path) -> None:
    goal = ("--controller", "lqr", "--hardware", "spacecraft_16_px4", "--goal", "0.5,0,0.3,0,0,0")
    assert run("spacecraft_16", *goal, seconds=50.0, env=ros_domain.env, cwd=tmp_path)["success"]


@pytest.mark.slow
@pytest.mark.parametrize("hardware", ["volantex_ranger_px4", "volantex_ranger_ardupilot"])
def test_a_wing_holds_its_height_through_an_autopilot(
    hardware: str, ros_domain: RosDomain, tmp_path: Path
) -> None:
    flight = ("--controller", "lqi", "--hardware", hardware)
    summary = run("volantex_ranger", *flight, seconds=12.0, env=ros_domain.env, cwd=tmp_path)
    assert summary["task"] == "fly_hold"
    assert summary["final_position_error_m"] < 1.0


def test_px4_without_its_messages_says_what_to_install(monkeypatch, neighbour: Neighbour) -> None:
    monkeypatch.setattr("fulmar_ros.px4_wires.importlib.import_module", _missing)
    with pytest.raises(Exception, match="Run: fulmar install-px4"):
        Px4Wires(neighbour.node, "")


def _missing(name: str) -> None:
    raise ModuleNotFoundError(name)


@pytest.mark.parametrize("neighbour", ["volantex_ranger"], indirect=True)
def test_a_silent_controller_leaves_a_plane_to_arduplanes_failsafe(neighbour: Neighbour) -> None:
    bench = WingBench(ArduPlaneEmulator(WING, free_udp_port()))
    settings = {"robot": WING.name, "hardware": f"{WING.name}_ardupilot", "arm": "true", "task": "fly_hold"}
    parameters = settings | {"port": bench.device.address}
    words = [word for key, value in parameters.items() for word in ("-p", f"{key}:={value}")]
    node = DriverNode(lambda _code: None, cli_args=["--ros-args", "-r", f"__ns:=/{WING.name}", *words])

    def fly() -> None:
        neighbour.command(trim().tolist())
        time.sleep(0.02)

    with spinning(node, lambda error: pytest.fail(repr(error))):
        try:
            until(lambda: fly() or bench.device.target is not None, 20.0)
            assert bench.device.mode == GUIDED
            asked = "SET_ATTITUDE_TARGET"
            time.sleep(0.3)
            sent = bench.device.received[asked]
            until(lambda: time.sleep(0.05) or bench.device.mode == RTL, 4.0)
            assert bench.device.received[asked] == sent
        finally:
            node.stop()
            bench.stop()
