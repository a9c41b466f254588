"""The command of an installed service, run as it stands in the unit: after a start nothing moves by itself."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest

from fulmar_bringup.robot_operator import Operator
from fulmar_bringup.service.installation import UNITS
from fulmar_bringup.service.unit import command_of
from fulmar_core.errors import DONE
from fulmar_core.paths import config_path
from tests.conftest import RosDomain
from tests.ros.cli import fulmar
from tests.ros.neighbour import ROBOT, Neighbour, until

pytestmark = pytest.mark.real_time
STILL_S = 1.5  # in which a controller that had a goal would have opened valves many times
CLOSED_S = 1.0  # within which valves are closed after SIGTERM
Start = Callable[..., psutil.Popen]


@pytest.fixture
def start(neighbour: Neighbour, ros_domain: RosDomain, tmp_path: Path) -> Iterator[Start]:
    """Installs a service, and starts what its unit starts; none outlives its test."""
    neighbour.withdraw_command()
    started: list[psutil.Popen] = []

    def begin(system: str, *more: str, also: tuple[str, ...] = ()) -> psutil.Popen:
        root = tmp_path / "root"
        asked = ("service", "install", system, *more, "--user", "games", "--root", str(root))
        done = fulmar(*asked, env=ros_domain.env, cwd=tmp_path)
        assert done.returncode == DONE, done.stderr
        (unit,) = (root / UNITS).glob("fulmar-*.service")
        command = [*command_of(unit.read_text()), *also]
        process = psutil.Popen(command, env=ros_domain.env, cwd=tmp_path, stdin=subprocess.DEVNULL)
        started.append(process)
        return process

    yield begin
    for process in started:
        if process.poll() is None:
            for each in [*process.children(recursive=True), process]:
                each.kill()
        process.wait(10.0)


def ready(neighbour: Neighbour) -> None:
    """Wait until plant and controller run."""
    until(lambda: bool(neighbour.applied) and "controller" in neighbour.said, 30.0)


def stands_still(neighbour: Neighbour) -> bool:
    """Whether no actuator moves for a while."""
    begin = len(neighbour.applied)
    time.sleep(STILL_S)
    later = neighbour.applied[begin:]
    return len(later) > 10 and not any(applied.any() for applied in later)


def reset(neighbour: Neighbour) -> None:
    """As a person does."""
    assert all(done for done, _ in Operator(neighbour.node).reset_all(ROBOT).values())


def test_nothing_moves_until_a_reset_and_a_goal_that_comes_after_it(
    neighbour: Neighbour, start: Start
) -> None:
    neighbour.give_goal()  # latched, from before the boot
    service = start("mock_lqr")
    ready(neighbour)
    until(lambda: neighbour.said["estop"][0] == "pressed")
    assert stands_still(neighbour)
    neighbour.give_goal()  # while it is pressed
    assert stands_still(neighbour)
    reset(neighbour)
    until(lambda: neighbour.said["estop"][0] == "released")
    assert stands_still(neighbour), "a goal from before the reset was obeyed"
    neighbour.give_goal()
    until(lambda: neighbour.applied[-1].any())
    _ends_with_closed_valves(neighbour, service, [service])


@pytest.mark.slow
@pytest.mark.parametrize(
    "whole_group", [False, True], ids=["the command alone", "every process, as systemd does"]
)
def test_sigterm_closes_valves_of_a_driver_within_a_second(
    whole_group: bool, neighbour: Neighbour, start: Start
) -> None:
    service = start("mujoco_lqr", "--backend", "hardware", also=("--emulate",))
    ready(neighbour)
    reset(neighbour)
    until(lambda: neighbour.said["estop"][0] == "released")
    neighbour.give_goal()
    until(lambda: neighbour.applied[-1].any(), 20.0)
    asked = [service, *service.children(recursive=True)] if whole_group else [service]
    _ends_with_closed_valves(neighbour, service, asked)


@pytest.mark.slow
def test_after_a_crash_and_a_restart_it_stands_still_again(neighbour: Neighbour, start: Start) -> None:
    first = start("mock_lqr")
    ready(neighbour)
    reset(neighbour)
    neighbour.give_goal()
    until(lambda: neighbour.applied[-1].any())
    nodes = first.children(recursive=True)
    first.kill()
    began = time.monotonic()
    until(lambda: not neighbour.applied[-1].any())
    assert time.monotonic() - began < CLOSED_S
    _gone, alive = psutil.wait_procs(nodes, timeout=10.0)
    assert not alive
    neighbour.said.clear()
    neighbour.applied.clear()
    start("mock_lqr")
    ready(neighbour)
    until(lambda: neighbour.said["estop"][0] == "pressed")
    assert stands_still(neighbour), "the goal of before the crash was obeyed"


@pytest.mark.slow
@pytest.mark.parametrize("neighbour", ["kingfisher"], indirect=True)
def test_a_file_that_arms_does_not_arm_in_a_service(
    neighbour: Neighbour, tmp_path: Path, start: Start
) -> None:
    text = config_path("hardware", "kingfisher_ardupilot").read_text()
    (tmp_path / "armed.yaml").write_text(text.replace("arm: false", "arm: true"))
    more = ("--robot", "kingfisher", "--backend", "hardware", "--hardware", str(tmp_path / "armed.yaml"))
    start("mujoco_classical", *more, also=("--emulate",))
    until(lambda: neighbour.said["plant"][1].get("warning", "").startswith("not armed"), 40.0)
    assert neighbour.said["plant"][1]["armed"] == "false"


def _ends_with_closed_valves(
    neighbour: Neighbour, service: psutil.Popen, asked: list[psutil.Process]
) -> None:
    began = time.monotonic()
    for process in asked:
        os.kill(process.pid, signal.SIGTERM)
    until(lambda: not neighbour.applied[-1].any())
    assert time.monotonic() - began < CLOSED_S
    nodes = service.children(recursive=True)
    assert service.wait(15.0) == DONE
    assert not psutil.wait_procs(nodes, timeout=5.0)[1]
    assert not neighbour.applied[-1].any()
