"""Runs, demos and evaluations that end early, at no time that counts: everybody ends, and the reason is reported."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from diagnostic_msgs.msg import DiagnosticArray

from fulmar_bringup.completion import completed
from fulmar_bringup.plan_checks import checked
from fulmar_bringup.processes import Ended, ProcessGroup
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.supervisor import Supervisor
from fulmar_evaluation.run_outcome import RunOutcome, run_and_evaluate
from tests.conftest import RosDomain
from tests.ros.cli import child_running, fulmar, json_of, nothing_left, start_fulmar, wait_for_children

UNDER_WAY_S = 1.5  # from the start of the processes of an evaluation until they step


@pytest.mark.slow
def test_a_recorder_that_fails_at_its_end_fails_the_run(
    ros_domain: RosDomain, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A full disk is reported by the recorder's exit code alone, when all else went well."""
    reported = outcome_with(monkeypatch, tmp_path, [Ended("controller", 0), Ended("recorder", 1)])
    assert reported.failure == "recorder ended with exit code 1 when it was stopped"
    assert reported.exit_code == 1


@pytest.mark.slow
def test_commands_that_are_not_in_the_bag_fail_a_lockstep_run(
    ros_domain: RosDomain, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever lost them."""
    reported = outcome_with(monkeypatch, tmp_path, [], lost=3)
    assert reported.failure == "the bag lacks 3 of 13 commands"
    assert reported.exit_code == 1


def outcome_with(
    monkeypatch: pytest.MonkeyPatch, folder: Path, ends: list[Ended], lost: int = 0
) -> RunOutcome:
    """A short lock-stepped run whose children end otherwise, or whose plant has done more steps than it did."""
    stop_all, receives = ProcessGroup.stop_all, Supervisor._on_diagnostics

    def receive(self: Supervisor, message: DiagnosticArray) -> None:
        receives(self, message)
        if lost:
            self.plant.values["steps"] = str(10 + lost)

    def stop_otherwise(self: ProcessGroup) -> list[Ended]:
        return stop_all(self) and ends

    monkeypatch.setattr(Supervisor, "_on_diagnostics", receive)
    if ends:
        monkeypatch.setattr(ProcessGroup, "stop_all", stop_otherwise)
    return run_and_evaluate(
        checked(
            completed(
                RunPlan(
                    *("floating_platform", "go_to_pose", "lqr", "mock", 5.0),
                    duration_s=2.0,
                    lockstep=True,
                    record=str(folder / "bag"),
                    command="test",
                )
            )
        )
    )


@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)])
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


@pytest.mark.slow
def test_ctrl_c_ends_a_demo_and_not_its_first_run_alone(ros_domain: RosDomain, tmp_path: Path) -> None:
    """Nothing is compared, and no second run begins."""
    demo = start_fulmar("demo", "--out", "demo", env=ros_domain.env, cwd=tmp_path)
    child_running(demo, "policy_server.controller_node")
    children = wait_for_children(demo, 3)
    demo.send_signal(signal.SIGINT)
    out, err = demo.communicate(timeout=30.0)
    assert (demo.returncode, out) == (1, ""), err
    assert "policy: stopped by the user" in err
    assert not (tmp_path / "demo" / "lqr").exists()
    assert nothing_left(children)


@pytest.mark.slow
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


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_an_evaluation_that_is_reported_to_stop_leaves_nobody_behind(
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


def test_a_worker_whose_stop_got_lost_in_another_error_ends_all_the_same() -> None:
    """As where it is asked to stop while a module is being loaded: it would wait for another share for ever."""
    done = subprocess.run(
        [sys.executable, "-c", LOSES_ITS_STOP], capture_output=True, text=True, timeout=30.0, check=False
    )
    assert (done.returncode, done.stdout) == (1, ""), done.stderr


LOSES_ITS_STOP = """
import os, signal
from fulmar_evaluation import ros_evaluation as evaluation

def lose(*_):
    try:
        os.kill(os.getpid(), signal.SIGINT)
    except SystemExit:
        raise RuntimeError("could not be loaded")

evaluation._roll_out_share = lose
evaluation._begin_worker([], os.getppid())
try:
    evaluation._work(None, range(1), 0, 0)
except RuntimeError:
    print("waits for another share")
"""


def test_a_worker_whose_evaluation_was_killed_is_asked_to_stop() -> None:
    """Its parent, a process between this one and it, can tell it nothing any more."""
    done = subprocess.run(
        [sys.executable, "-c", LOSES_ITS_PARENT], capture_output=True, text=True, timeout=30.0, check=False
    )
    assert done.stdout == "stopped\n", done.stderr


LOSES_ITS_PARENT = """
import os, signal, time
from fulmar_evaluation import ros_evaluation as evaluation

here, parent = os.getpid(), os.fork()
if parent == 0:
    ready, begun = os.pipe()
    if os.fork() == 0:
        evaluation._begin_worker([], os.getppid())
        try:
            os.write(begun, b".")
            time.sleep(20.0)
        except SystemExit:
            print("stopped", flush=True)
        os._exit(0)
    os.read(ready, 1)
    os.kill(os.getpid(), signal.SIGKILL)
os.waitpid(parent, 0)
"""


@pytest.mark.slow
def test_the_first_failure_of_an_evaluation_ends_it(ros_domain: RosDomain, tmp_path: Path) -> None:
    """The other share is not waited for."""
    run = start_evaluation(ros_domain, tmp_path)
    children = wait_for_children(run, 5)
    time.sleep(UNDER_WAY_S)
    child_running(run, "policy_server.controller_node").kill()
    _, err = run.communicate(timeout=15.0)  # a plant waits 5 s for an answer
    assert run.returncode == 1
    assert "fulmar: controller was killed by SIGKILL" in err
    assert nothing_left(children)


def start_evaluation(domain: RosDomain, folder: Path) -> psutil.Popen:
    """An evaluation that would take minutes."""
    asked = ("evaluate", "floating_platform", "go_to_pose", "--controller", "lqr", "--through", "ros")
    return start_fulmar(*asked, "--episodes", "400", "--jobs", "2", env=domain.env, cwd=folder)
