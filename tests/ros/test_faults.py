"""What happens when a process dies, hangs or is told to stop: the robot stops, the bag stays, the run says why."""

from __future__ import annotations

import signal
from pathlib import Path

import numpy as np
import psutil
import pytest

from fulmar_bringup.bag_reader import read_run
from tests.conftest import RosDomain
from tests.ros.cli import child_running, json_of, nothing_left, start_fulmar, wait_for_messages

FAR = ("--start", "4,0,0", "--goal", "0,0,0")  # valves stay open for seconds
WATCHDOG_S, TICK_S = 0.4, 0.02
UNDER_WAY = 30_000  # bytes of bag


def start_run(domain: RosDomain, folder: Path, *more: str) -> psutil.Popen:
    """A real-time run with the policy that has far to go."""
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
    run = start_fulmar(*asked, *more, env=domain.env, cwd=folder)
    wait_for_messages(folder / "bag", UNDER_WAY)
    return run


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_dead_or_hung_policy_closes_the_valves_within_the_watchdog_and_a_tick(
    number: signal.Signals, ros_domain: RosDomain, tmp_path: Path
) -> None:
    """Measured in the bag, between the last command and the first closed state after it."""
    run = start_run(ros_domain, tmp_path)
    child_running(run, "policy_server.policy_node").send_signal(number)
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


def test_a_dead_recorder_ends_the_run_and_leaves_a_readable_bag(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    """A run that is not recorded does not go on; what was recorded opens."""
    run = start_run(ros_domain, tmp_path)
    child_running(run, "fulmar_ros.recorder_node").kill()
    out, _ = run.communicate(timeout=30.0)
    assert run.returncode == 1
    summary = json_of(out)
    assert "recorder was killed by SIGKILL" in summary["failure"]
    assert summary["duration_s"] > 1.0


def test_a_dead_plant_ends_the_run(ros_domain: RosDomain, tmp_path: Path) -> None:
    """First failure stops all."""
    run = start_run(ros_domain, tmp_path)
    child_running(run, "sim_nodes.sim_node").kill()
    out, _ = run.communicate(timeout=30.0)
    assert run.returncode == 1
    assert "plant was killed by SIGKILL" in json_of(out)["failure"]


def test_ctrl_c_stops_in_order_with_the_valves_closed_last(ros_domain: RosDomain, tmp_path: Path) -> None:
    """The bag is whole and ends with closed valves; nobody is left behind."""
    run = start_run(ros_domain, tmp_path)
    children = run.children(recursive=True)
    run.send_signal(signal.SIGINT)
    out, _ = run.communicate(timeout=30.0)
    assert run.returncode == 1
    assert json_of(out)["failure"] == "stopped by the user"
    assert nothing_left(children)
    record = read_run(tmp_path / "bag")
    assert not record.warnings
    assert not np.any(record.applied.effort[-1])


def test_no_node_outlives_its_launcher(ros_domain: RosDomain, tmp_path: Path) -> None:
    """Even one that was killed and could stop nobody; the bag is closed properly all the same."""
    run = start_run(ros_domain, tmp_path)
    children = run.children(recursive=True)
    assert len(children) == 3
    run.kill()
    run.wait()
    assert nothing_left(children)
    assert not read_run(tmp_path / "bag").warnings
