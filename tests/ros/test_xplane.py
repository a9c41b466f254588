"""An aircraft in an emulated X-Plane, through driver node and protocol: whole flights, and peers that vanish or lie."""

from __future__ import annotations

import re
import signal
import struct
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState

from fulmar_bringup.emulation import emulation_of
from fulmar_bringup.emulator_row import emulator_spec
from fulmar_bringup.plant_row import plant_spec
from fulmar_bringup.processes import ProcessGroup
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system import default_hardware
from fulmar_core.robots.topics import DEVICE_STATE, TRUTH
from fulmar_ros.qos import subscriber_qos
from hardware_drivers.hardware import load_hardware
from tests.conftest import RosDomain
from tests.hardware_drivers.xplane_bench import Peer
from tests.ros.cli import fulmar, json_of
from tests.ros.neighbour import Neighbour, until

pytestmark = [pytest.mark.real_time, pytest.mark.slow, pytest.mark.timeout(180)]

STARTS_S = 40.0
ROBOT = "airship_v7"
HEIGHT = 2.0  # of the start [m]
PLAN = RunPlan(
    ROBOT, "fly_hold", "lqi", "hardware", 100.0, hardware=default_hardware(ROBOT, "xplane"), emulated=True,
    start=(0.0, 0.0, HEIGHT, 0.0, 0.0, 0.0),
)  # fmt: skip


@pytest.fixture
def group() -> Iterator[ProcessGroup]:
    group = ProcessGroup()
    yield group
    group.stop_all()


def test_lqi_holds_one_metre_through_the_protocol(ros_domain: RosDomain, tmp_path: Path) -> None:
    """The command of the manual; evaluated by where the emulated craft really is."""
    asked = (
        "run",
        ROBOT,
        "--controller",
        "lqi",
        "--backend",
        "hardware",
        "--hardware",
        "xplane",
        "--emulate",
        "--duration",
        "8",
    )
    done = fulmar(*asked, "--record", "flight", "--json", env=ros_domain.env, cwd=tmp_path)
    summary = json_of(done.stdout)
    assert summary["failure"] is None, done.stderr
    assert summary["success"]
    assert (summary["task"], summary["controller"]) == ("fly_hold", "lqi")
    assert summary["final_position_error_m"] < 0.1
    with next((tmp_path / "flight").glob("*.mcap")).open("rb") as stream:
        reader = make_reader(stream)
        channels = {channel.topic for channel in reader.get_summary().channels.values()}
    received: list[bytes] = []
    with Peer(received.append) as peer:
        asked = ("bag", "play", "flight", "--to", "xplane", "--port", str(peer.port), "--rate", "8")
        shown = fulmar(*asked, env=ros_domain.env, cwd=tmp_path)
    assert shown.returncode == 0, shown.stderr
    heights = [struct.unpack_from("<d", found, 22)[0] for found in received if found.startswith(b"POSI")]
    assert len(heights) > 30
    assert heights == pytest.approx([1.0] * len(heights), abs=0.5)
    own = {"odom", "imu/data", "air_data", "actuators/state", "emulator/actuators"}
    assert {f"/{ROBOT}/{name}" for name in own} <= channels


@pytest.mark.parametrize("neighbour", [ROBOT], indirect=True)
def test_without_a_controller_the_safe_controller_flies_and_a_lost_x_plane_ends_the_node(
    neighbour: Neighbour, group: ProcessGroup, tmp_path: Path
) -> None:
    """The emulator is stopped as a process that hangs; once it goes on, it finds the safe command, and is paused."""
    heights: list[float] = []
    device: list[np.ndarray] = []
    subscribe = neighbour.node.create_subscription
    subscribe(
        Odometry,
        TRUTH.name,
        lambda message: heights.append(message.pose.pose.position.z),
        subscriber_qos(TRUTH, reliable=True, depth=50),
    )
    subscribe(
        JointState,
        DEVICE_STATE.name,
        lambda message: device.append(np.array(message.effort)),
        subscriber_qos(DEVICE_STATE, reliable=True, depth=50),
    )
    emulation = emulation_of(load_hardware("xplane"), tmp_path)
    group.start(emulator_spec(PLAN, emulation))
    group.start(plant_spec(PLAN, port=emulation.port))
    until(lambda: bool(device) and bool(device[-1].any()), STARTS_S)
    heights.clear()
    time.sleep(4.0)
    assert len(heights) > 200
    assert np.ptp(heights) > 1e-6  # it is not paused
    assert np.array(heights) == pytest.approx(HEIGHT, abs=0.3)
    emulator = group.process("emulator")
    emulator.send_signal(signal.SIGSTOP)
    until(lambda: group.ended() is not None, STARTS_S)
    emulator.send_signal(signal.SIGCONT)
    assert group.ended().returncode == 1
    line = group.last_words("plant", ended=True)
    assert re.fullmatch(
        r"X-Plane at udp://127\.0\.0\.1:\d+: no report for 5\d\d ms \(limit 500 ms\)\. Does X-Plane run .*\?",
        line,
    )
    safe = neighbour.robot.actuators.safe_command
    until(lambda: np.allclose(device[-1], safe))
    time.sleep(0.2)
    heights.clear()
    time.sleep(0.3)
    assert np.ptp(heights) == 0.0  # paused


def test_an_x_plane_that_lies_ends_the_node_with_one_line_after_the_safe_command(
    ros_domain: RosDomain, group: ProcessGroup
) -> None:
    """Nonsense in the place of the altitude, after two seconds of truth."""
    received: list[bytes] = []
    with Peer(received.append) as peer:
        group.start(plant_spec(PLAN, port=peer.address))
        until(lambda: any(found.startswith(b"CTRL") for found in received), STARTS_S)
        time.sleep(1.0)
        assert any(struct.unpack_from("<4f", found, 5)[0] for found in received if found.startswith(b"CTRL"))
        peer.lie = lambda answer: answer[:22] + b"\xff" * 8 + answer[30:] if answer[:1] == b"P" else answer
        until(lambda: group.ended() is not None, STARTS_S)
        time.sleep(0.1)
    assert group.ended().returncode == 1
    line = group.last_words("plant", ended=True)
    assert re.search(
        r"no report for 5\d\d ms .* refused, the last: POSI of 46 bytes: a number is not finite", line
    )
    sticks = [found for found in received if found.startswith(b"CTRL")]
    throttles = [found for found in received if found.startswith(b"DREF")]
    assert [struct.unpack_from("<3f", found, 5) for found in sticks[-3:]] == [(0.0, 0.0, 0.0)] * 3
    assert all(found.endswith(struct.pack("<2f", 0.0, 0.0)) for found in throttles[-3:])
    assert received[-1] == b"SIMU\0\1" or b"SIMU\0\1" in received[-4:]


def test_an_x_plane_that_is_no_emulator_is_flown_without_a_goal(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    """The peer obeys nothing, so the height is missed, but the run has no failure; references begin at the craft."""
    received: list[bytes] = []
    with Peer(received.append) as peer:
        path = tmp_path / "mine.yaml"
        path.write_text(f"title: t\nrobot: {ROBOT}\ndriver: {{kind: xplane, port: '{peer.address}'}}\n")
        asked = (
            "run",
            ROBOT,
            "--controller",
            "lqi",
            "--backend",
            "hardware",
            "--hardware",
            str(path),
            "--duration",
            "3",
            "--json",
        )
        done = fulmar(*asked, "--record", "flight", env=ros_domain.env, cwd=tmp_path)
    summary = json_of(done.stdout)
    assert summary["failure"] is None, done.stderr
    assert summary["steps"] > 200
    assert summary["final_position_error_m"] == pytest.approx(4.0, abs=0.01)
    assert any(found.startswith(b"DREF") for found in received)


def test_a_missing_x_plane_is_one_line_before_anything_starts(ros_domain: RosDomain, tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(f"title: t\nrobot: {ROBOT}\ndriver: {{kind: xplane, port: 'udp://127.0.0.1:9'}}\n")
    asked = ("run", ROBOT, "--controller", "lqi", "--backend", "hardware", "--hardware", str(path))
    done = fulmar(*asked, env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 1
    assert "udp://127.0.0.1:9: no answer within 0.7 s. Does X-Plane run there" in done.stderr
    assert "Traceback" not in done.stderr
