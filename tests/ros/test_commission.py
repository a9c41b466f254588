"""`fulmar commission` through every driver, on emulated devices that are wired otherwise than their file says."""

from __future__ import annotations

import json
import signal
import time
from pathlib import Path

import numpy as np
import pytest
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from fulmar_core.robots.topics import DEVICE_STATE, ESTOP_TRIGGER
from fulmar_ros.qos import subscriber_qos
from hardware_drivers.hardware import load_hardware
from hardware_drivers.settings import MavlinkBoat
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of, nothing_left, start_fulmar
from tests.ros.neighbour import Neighbour, until

pytestmark = [pytest.mark.real_time, pytest.mark.slow, pytest.mark.timeout(240)]

DRIVERS = (  # one file of each kind
    "zero_g_lab",
    "zero_g_lab_roboran_valve_node",
    "turtlebot2",
    "turtlebot2_kobuki_node",
    "kingfisher",
    "kingfisher_ardupilot",
    "kingfisher_action",
)
STARTS_S = 40.0


def commissioned(hardware: str, wiring: str, ros_domain: RosDomain, cwd: Path, *more: str, seed: int = 5):
    arm = ("--arm",) if isinstance(load_hardware(hardware).driver, MavlinkBoat) else ()
    asked = (
        "commission",
        hardware,
        "--emulate",
        "--wiring",
        wiring,
        "--seed",
        str(seed),
        "--yes",
        *arm,
        "--json",
    )
    return fulmar(*asked, *more, env=ros_domain.env, cwd=cwd, timeout_s=150.0)


@pytest.mark.parametrize("hardware", DRIVERS)
def test_a_shuffled_wiring_is_found_and_written(hardware, ros_domain, tmp_path):
    done = commissioned(hardware, "shuffled", ros_domain, tmp_path, "--out", "mine.yaml")
    assert done.returncode == 0, done.stderr
    found = json_of(done.stdout)
    assert found["right"] and not found["as_written"]
    written = load_hardware(str(tmp_path / "mine.yaml")).driver
    assert list(getattr(written, found["key"])) == found[found["key"]]
    assert found["seconds"] < 60.0


@pytest.mark.parametrize("hardware", DRIVERS)
def test_each_wire_is_identified_or_named(hardware, seed_of_series, ros_domain, tmp_path):
    wiring = ("shuffled", "inverted", "dead")[seed_of_series % 3]
    done = commissioned(hardware, wiring, ros_domain, tmp_path, seed=100 + seed_of_series)
    found = json_of(done.stdout)
    assert found["right"], (found, done.stderr)
    if wiring == "dead":
        assert len(found["dead"]) == 1
        assert any(f"{found['dead'][0]} does not answer" in problem for problem in found["problems"])


@pytest.mark.parametrize("hardware", ["zero_g_lab", "turtlebot2"])
def test_a_cut_wire_is_named_and_nothing_is_written(hardware, ros_domain, tmp_path):
    done = commissioned(hardware, "dead", ros_domain, tmp_path, "--out", "mine.yaml")
    assert done.returncode == 1
    found = json_of(done.stdout)
    assert found["right"] and len(found["dead"]) == 1
    assert any(f"{found['dead'][0]} does not answer" in problem for problem in found["problems"])
    assert not (tmp_path / "mine.yaml").exists()


def test_lines_of_the_other_level_are_recognised(ros_domain, tmp_path):
    done = commissioned("zero_g_lab", "inverted", ros_domain, tmp_path)
    assert done.returncode == 1
    found = json_of(done.stdout)
    assert found["right"] and found["inverted"] and found["active_low"] is False
    assert "active_low: false" in json.dumps(found["problems"])


def test_without_a_confirmation_each_valve_clicks_once_and_nothing_is_identified(
    neighbour: Neighbour, ros_domain, tmp_path
):
    neighbour.withdraw_command()  # a second publisher of commands would stop the driver
    opened: list[tuple[float, ...]] = []
    qos = subscriber_qos(DEVICE_STATE, reliable=True, depth=50)
    neighbour.node.create_subscription(
        JointState, DEVICE_STATE.name, lambda message: opened.append(tuple(message.effort)), qos
    )
    done = fulmar("commission", "zero_g_lab", "--emulate", env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.index("line PZ.06") < done.stdout.index("line PN.01")
    seen = [valves for valves, before in zip(opened[1:], opened, strict=False) if valves != before]
    clicked = [int(np.argmax(valves)) for valves in seen if any(valves)]
    order = list(load_hardware("zero_g_lab").driver.order)
    assert len(clicked) >= 5  # on a busy machine this test receives the emulator late
    assert clicked == order[-len(clicked) :]


@pytest.mark.parametrize("ending", ["SIGTERM", "SIGINT", "SIGSTOP", "e-stop"])
def test_whatever_ends_it_closes_the_valves(neighbour: Neighbour, ros_domain, tmp_path, ending):
    """Our own end, or the e-stop: at once. While it hangs, the driver's watchdog of 0.2 s. No process stays."""
    neighbour.withdraw_command()  # a second publisher of commands would stop the driver
    device: list[np.ndarray] = []
    qos = subscriber_qos(DEVICE_STATE, reliable=True, depth=50)
    neighbour.node.create_subscription(
        JointState, DEVICE_STATE.name, lambda message: device.append(np.array(message.effort)), qos
    )
    press = neighbour.node.create_client(Trigger, ESTOP_TRIGGER)
    run = start_fulmar("commission", "zero_g_lab", "--emulate", "--yes", env=ros_domain.env, cwd=tmp_path)
    try:
        until(lambda: run.poll() is not None or (bool(device) and device[-1].any()), STARTS_S)
        assert run.poll() is None, run.stderr.read()
        children = run.children(recursive=True)
        if ending == "e-stop":
            assert press.wait_for_service(5.0)
            press.call_async(Trigger.Request())
        else:
            run.send_signal(signal.Signals[ending])
        time.sleep(0.6)
        assert not device[-1].any()
        if ending == "SIGSTOP":
            run.kill()
        assert run.wait(30.0) == (-signal.SIGKILL if ending == "SIGSTOP" else 1)
        assert nothing_left(children)
        if ending == "e-stop":
            assert "e-stop" in run.stderr.read()
    finally:
        if run.poll() is None:
            run.kill()
