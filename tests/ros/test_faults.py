"""What happens when a process dies, hangs or is reported to stop: the robot stops, the bag stays, the run says why."""

from __future__ import annotations

import json
import re
import shutil
import signal
import time
from pathlib import Path

import numpy as np
import psutil
import pytest
import yaml

from fulmar_bags.run_record import read_run
from fulmar_core.robots.robot_file import load_robot
from tests.conftest import RosDomain
from tests.ros.cli import (
    child_running,
    fulmar,
    json_of,
    nothing_left,
    start_fulmar,
    tripped,
    under_way,
)

pytestmark = pytest.mark.real_time

FAR = ("--start", "4,0,0", "--goal", "0,0,0")  # valves stay open for seconds
WATCHDOG_S, TICK_S = 0.4, 0.02
UNDER_WAY = 200  # messages in the bag


def start_run(domain: RosDomain, folder: Path, *more: str) -> psutil.Popen:
    """A real-time run with the policy that has far to go; begun again if a busy machine trips its watchdog first."""
    asked = (
        "run",
        "floating_platform",
        "--controller",
        "policy",
        *FAR,
        "--duration",
        "40",
        "--record",
        "bag",
        "--json",
    )
    for _ in range(2):
        run = start_fulmar(*asked, *more, env=domain.env, cwd=folder)
        if under_way(run, folder / "bag", UNDER_WAY):
            return run
        out, err = run.communicate()
        assert tripped(out), err
        shutil.rmtree(folder / "bag")
    raise AssertionError("the watchdog tripped twice before the run was under way")


# In the quick tests the fault suite kills a controller, and tests/ros/test_plant_node.py has its silence.
@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_dead_or_hung_policy_closes_the_valves_within_the_watchdog_and_a_tick(
    number: signal.Signals, ros_domain: RosDomain, tmp_path: Path
) -> None:
    """Measured in the bag, between the last command and the first closed state after it."""
    run = start_run(ros_domain, tmp_path)
    child_running(run, "policy_server.controller_node").send_signal(number)
    out, err = run.communicate(timeout=30.0)
    assert run.returncode == 1
    summary = json_of(out)
    assert "no command for" in summary["failure"]
    assert summary["failure"][:40] in err.replace("\n", " ")
    assert summary["watchdog_trips"] == 1
    record = read_run(tmp_path / "bag")
    last_command = record.commanded.log_s[-1]
    after = record.applied.log_s > last_command
    open_after = record.applied.log_s[after & (record.applied.effort.sum(axis=1) > 0)]
    assert open_after.size, "the valves were closed anyway: the test shows nothing"
    # The recorder's own clock adds its wake-up time to both ends; 30 ms cover it on a busy machine.
    assert open_after.max() - last_command < WATCHDOG_S + TICK_S + 0.03
    closed = record.applied.effort[record.applied.log_s > open_after.max()]
    assert closed.size
    assert not np.any(closed)


@pytest.mark.slow  # tests/fulmar_bringup/test_node_keeper.py has the decision
def test_a_dead_plant_ends_the_run(ros_domain: RosDomain, tmp_path: Path) -> None:
    """First failure stops all."""
    run = start_run(ros_domain, tmp_path)
    child_running(run, "sim_nodes.sim_node").kill()
    out, _ = run.communicate(timeout=30.0)
    assert run.returncode == 1
    assert "plant was killed by SIGKILL" in json_of(out)["failure"]


@pytest.mark.slow  # tests/fulmar_bringup/test_silent_nodes.py has the decision
def test_a_hung_plant_is_noticed_within_seconds(ros_domain: RosDomain, tmp_path: Path) -> None:
    """It reports once a second; a run does not wait for its own limit to learn that it no longer does."""
    run = start_run(ros_domain, tmp_path)
    began = time.monotonic()
    child_running(run, "sim_nodes.sim_node").suspend()
    out, _ = run.communicate(timeout=30.0)
    assert time.monotonic() - began < 10.0  # three seconds of silence, and the end of all processes
    assert run.returncode == 1
    assert re.search(r"plant: has not reported for 3\.\d s; it hangs$", json_of(out)["failure"])


def check_that_a_second_run_is_refused(domain: RosDomain, folder: Path) -> None:
    """Two runs in one domain would mix: the second ends before it starts anything."""
    asked = ("run", "floating_platform", "--controller", "lqr", "--record", "other")
    second = fulmar(*asked, env=domain.env, cwd=folder)
    assert second.returncode == 2
    assert f"another `fulmar run` is using ROS domain {domain.id}" in second.stderr
    assert not (folder / "other").exists()


@pytest.mark.parametrize(
    ("number", "reported"),
    [
        (signal.SIGINT, "stopped by the user"),
        # one handler for all
        pytest.param(signal.SIGTERM, "stopped by SIGTERM", marks=pytest.mark.slow),
        pytest.param(signal.SIGHUP, "stopped by SIGHUP", marks=pytest.mark.slow),
    ],
)
def test_ctrl_c_sigterm_and_a_lost_terminal_stop_in_order_with_the_valves_closed_last(
    number: signal.Signals, reported: str, ros_domain: RosDomain, tmp_path: Path
) -> None:
    """The bag is whole and ends with closed valves; no process is left behind."""
    run = start_run(ros_domain, tmp_path)
    children = run.children(recursive=True)
    if number == signal.SIGINT:
        check_that_a_second_run_is_refused(ros_domain, tmp_path)
    run.send_signal(number)
    out, _ = run.communicate(timeout=30.0)
    assert run.returncode == 1
    assert json_of(out)["failure"] == reported
    assert nothing_left(children)
    record = read_run(tmp_path / "bag")
    assert not record.warnings
    assert not np.any(record.applied.effort[-1])


@pytest.mark.slow  # tests/fulmar_bringup/test_processes.py has one child, with no bag
def test_no_node_outlives_its_launcher(ros_domain: RosDomain, tmp_path: Path) -> None:
    """Even one that was killed and could stop nobody; the bag is closed properly all the same."""
    run = start_run(ros_domain, tmp_path)
    children = run.children(recursive=True)
    assert len(children) == 3
    run.kill()
    run.wait()
    assert nothing_left(children)
    assert not read_run(tmp_path / "bag").warnings


@pytest.mark.slow
def test_a_ring_writes_the_run_of_a_controller_that_died(ros_domain: RosDomain, tmp_path: Path) -> None:
    """The watchdog trips; the goal, the way until then and the closed valves are in the bag."""
    asked = ("run", "floating_platform", "--controller", "lqr", *FAR, "--recording", "ring")
    run = start_fulmar(*asked, "--record", "bag", "--json", env=ros_domain.env, cwd=tmp_path)
    controller = child_running(run, "policy_server.controller_node")
    time.sleep(10.0)
    controller.kill()
    _, err = run.communicate(timeout=30.0)
    assert run.returncode == 1, err
    record = read_run(tmp_path / "bag")
    assert len(record.goals) == 1
    assert len(record.truth) > 50
    assert not np.any(record.applied.effort[-1])
    reported = yaml.safe_load((tmp_path / "bag" / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert any(
        fault["reason"].startswith("plant: no command")
        for fault in json.loads(reported["custom_data"]["fulmar_faults"])
    )


@pytest.mark.slow
@pytest.mark.timeout(120)
def test_an_aircraft_whose_controller_was_killed_is_flown_down_before_its_run_ends(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    """From one metre: five seconds level, then down; the run waits for it."""
    asked = ("run", "airship_v7", "--task", "fly_hold", "--controller", "lqi", "--duration", "60")
    run = start_fulmar(*asked, "--record", "bag", "--json", env=ros_domain.env, cwd=tmp_path)
    controller = child_running(run, "policy_server.controller_node")
    time.sleep(12.0)
    controller.kill()
    out, err = run.communicate(timeout=60.0)
    assert run.returncode == 1, err
    failure = json_of(out)["failure"]
    assert "controller was killed by SIGKILL" in failure
    assert "the safe controller holds its height" in failure
    record = read_run(tmp_path / "bag")
    height = record.truth.states.position_in_world[:, 2]
    climb = record.truth.states.velocity_in_world[:, 2]
    lowest = load_robot("airship_v7").hull_span[0]
    touched = int(np.argmax(height + lowest <= 0.01))
    assert height[touched] + lowest <= 0.01
    assert climb[touched - 1] >= -1.0
    assert not record.applied.effort[-1].any()  # on the ground throttles are idle
