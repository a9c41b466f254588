"""What happens when a process dies, hangs or is told to stop: the robot stops, the bag stays, the run says why."""

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
from diagnostic_msgs.msg import DiagnosticArray

from fulmar_bringup.bag_reader import read_run
from fulmar_bringup.conductor import RunOutcome, conduct
from fulmar_bringup.planning import plan_run
from fulmar_bringup.processes import Ended, ProcessGroup
from fulmar_bringup.supervisor import Supervisor
from tests.conftest import RosDomain
from tests.ros.cli import (
    child_running,
    fulmar,
    json_of,
    nothing_left,
    start_fulmar,
    tripped,
    under_way,
    wait_for_children,
)

pytestmark = pytest.mark.real_time

FAR = ("--start", "4,0,0", "--goal", "0,0,0")  # valves stay open for seconds
WATCHDOG_S, TICK_S = 0.4, 0.02
UNDER_WAY = 400  # messages in the bag
UNDER_WAY_S = 1.5  # from the start of the processes of an evaluation until they step


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


def test_a_hung_plant_is_noticed_within_seconds(ros_domain: RosDomain, tmp_path: Path) -> None:
    """It reports once a second; a run does not wait for its own limit to learn that it no longer does."""
    run = start_run(ros_domain, tmp_path)
    began = time.monotonic()
    child_running(run, "sim_nodes.sim_node").suspend()
    out, _ = run.communicate(timeout=30.0)
    assert time.monotonic() - began < 10.0  # three seconds of silence, and the end of all processes
    assert run.returncode == 1
    assert re.search(r"plant: has not reported for 3\.\d s; it hangs$", json_of(out)["failure"])


def test_a_recorder_that_fails_at_its_end_fails_the_run(
    ros_domain: RosDomain, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A full disk is told by the recorder's exit code alone, when all else went well."""
    told = outcome_with(monkeypatch, tmp_path, [Ended("controller", 0), Ended("recorder", 1)])
    assert told.failure == "recorder ended with exit code 1 when it was stopped"
    assert told.exit_code == 1


def test_commands_that_are_not_in_the_bag_fail_a_lockstep_run(
    ros_domain: RosDomain, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever lost them."""
    told = outcome_with(monkeypatch, tmp_path, [], lost=3)
    assert told.failure == "the bag lacks 3 of 13 commands"
    assert told.exit_code == 1


def outcome_with(
    monkeypatch: pytest.MonkeyPatch, folder: Path, ends: list[Ended], lost: int = 0
) -> RunOutcome:
    """A short lock-stepped run whose children end otherwise, or whose plant has done more steps than it did."""
    stop_all, heard = ProcessGroup.stop_all, Supervisor._hear

    def hear(self: Supervisor, message: DiagnosticArray) -> None:
        heard(self, message)
        if lost:
            self.plant.values["steps"] = str(10 + lost)

    def stop_otherwise(self: ProcessGroup) -> list[Ended]:
        return stop_all(self) and ends

    monkeypatch.setattr(Supervisor, "_hear", hear)
    if ends:
        monkeypatch.setattr(ProcessGroup, "stop_all", stop_otherwise)
    return conduct(
        plan_run(
            robot="floating_platform",
            task="go_to_pose",
            controller="lqr",
            backend="mock",
            policy=None,
            goal=None,
            start=None,
            duration_s=2.0,
            lockstep=True,
            rate=1.0,
            control_hz=5.0,
            scenario="nominal",
            seed=0,
            record=folder / "bag",
            command="test",
        )
    )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_run_that_is_stopped_before_there_is_a_bag_has_an_outcome_all_the_same(
    number: signal.Signals, ros_domain: RosDomain, tmp_path: Path
) -> None:
    """As soon as the first child is there; what is not known is null."""
    asked = ("run", "floating_platform", "--controller", "lqr", "--record", "bag", "--json")
    run = start_fulmar(*asked, env=ros_domain.env, cwd=tmp_path)
    children = [child_running(run, "fulmar_ros.recorder_node")]
    run.send_signal(number)
    out, err = run.communicate(timeout=30.0)
    assert run.returncode == 1, err
    summary = json_of(out)
    assert summary["failure"].startswith("stopped by")
    assert (summary["robot"], summary["controller"], summary["success"]) == (
        "floating_platform",
        "lqr",
        False,
    )
    assert summary["final_position_error_m"] is None
    assert nothing_left(children)


def test_ctrl_c_ends_a_demo_and_not_its_first_run_alone(ros_domain: RosDomain, tmp_path: Path) -> None:
    """Nothing is compared, and no second run begins."""
    demo = start_fulmar("demo", "--out", "demo", env=ros_domain.env, cwd=tmp_path)
    child_running(demo, "policy_server.policy_node")
    children = wait_for_children(demo, 3)
    demo.send_signal(signal.SIGINT)
    out, err = demo.communicate(timeout=30.0)
    assert (demo.returncode, out) == (1, ""), err
    assert "policy: stopped by the user" in err
    assert not (tmp_path / "demo" / "lqr").exists()
    assert nothing_left(children)


def test_a_recorder_that_cannot_begin_is_the_failure(ros_domain: RosDomain, tmp_path: Path) -> None:
    """Its own words are on standard error."""
    (tmp_path / "file").write_text("")
    asked = ("run", "floating_platform", "--controller", "lqr", "--record", "file/bag", "--json")
    done = fulmar(*asked, env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 1
    summary = json_of(done.stdout)
    assert summary["failure"].startswith("recorder ended with exit code 2 before the run was over")
    assert summary["bag"] is None
    assert "[recorder] " in done.stderr


def test_two_runs_in_one_domain_do_not_mix(ros_domain: RosDomain, tmp_path: Path) -> None:
    """The second is refused before it starts anything."""
    run = start_run(ros_domain, tmp_path)
    asked = ("run", "floating_platform", "--controller", "lqr", "--record", "other")
    second = fulmar(*asked, env=ros_domain.env, cwd=tmp_path)
    assert second.returncode == 2
    assert f"another `fulmar run` is using ROS domain {ros_domain.id}" in second.stderr
    assert not (tmp_path / "other").exists()
    run.send_signal(signal.SIGINT)
    run.communicate(timeout=30.0)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_an_evaluation_that_is_told_to_stop_leaves_nobody_behind(
    number: signal.Signals, ros_domain: RosDomain, tmp_path: Path
) -> None:
    """Two workers with a controller each, in the middle of their shares."""
    run = start_evaluation(ros_domain, tmp_path)
    children = wait_for_children(run, 5)  # with Python's own tracker of shared memory
    time.sleep(UNDER_WAY_S)
    run.send_signal(number)
    _, err = run.communicate(timeout=10.0)
    assert nothing_left(children)
    if number != signal.SIGKILL:
        assert run.returncode == 1
        assert "fulmar: stopped by" in err
        assert "Traceback" not in err


def test_the_first_failure_of_an_evaluation_ends_it(ros_domain: RosDomain, tmp_path: Path) -> None:
    """The other share is not waited for."""
    run = start_evaluation(ros_domain, tmp_path)
    children = wait_for_children(run, 5)
    time.sleep(UNDER_WAY_S)
    child_running(run, "policy_server.lqr_node").kill()
    _, err = run.communicate(timeout=15.0)  # a plant waits 5 s for an answer
    assert run.returncode == 1
    assert "fulmar: controller was killed by SIGKILL" in err
    assert nothing_left(children)


def start_evaluation(domain: RosDomain, folder: Path) -> psutil.Popen:
    """An evaluation that would take minutes."""
    asked = ("evaluate", "floating_platform", "go_to_pose", "--controller", "lqr", "--through", "ros")
    return start_fulmar(*asked, "--episodes", "400", "--jobs", "2", env=domain.env, cwd=folder)


@pytest.mark.parametrize(
    ("number", "told"),
    [
        (signal.SIGINT, "stopped by the user"),
        (signal.SIGTERM, "stopped by SIGTERM"),
        (signal.SIGHUP, "stopped by SIGHUP"),
    ],
)
def test_ctrl_c_sigterm_and_a_lost_terminal_stop_in_order_with_the_valves_closed_last(
    number: signal.Signals, told: str, ros_domain: RosDomain, tmp_path: Path
) -> None:
    """The bag is whole and ends with closed valves; nobody is left behind."""
    run = start_run(ros_domain, tmp_path)
    children = run.children(recursive=True)
    run.send_signal(number)
    out, _ = run.communicate(timeout=30.0)
    assert run.returncode == 1
    assert json_of(out)["failure"] == told
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


@pytest.mark.slow
def test_a_ring_writes_the_run_of_a_controller_that_died(ros_domain: RosDomain, tmp_path: Path) -> None:
    """The watchdog trips; the goal, the way until then and the closed valves are in the bag."""
    asked = ("run", "floating_platform", "--controller", "lqr", *FAR, "--recording", "ring")
    run = start_fulmar(*asked, "--record", "bag", "--json", env=ros_domain.env, cwd=tmp_path)
    controller = child_running(run, "policy_server.lqr_node")
    time.sleep(10.0)
    controller.kill()
    _, err = run.communicate(timeout=30.0)
    assert run.returncode == 1, err
    record = read_run(tmp_path / "bag")
    assert len(record.goals) == 1
    assert len(record.truth) > 50
    assert not np.any(record.applied.effort[-1])
    told = yaml.safe_load((tmp_path / "bag" / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert any(
        fault["reason"].startswith("plant: no command")
        for fault in json.loads(told["custom_data"]["fulmar_faults"])
    )
