"""Processes that die or hang below the launchers that people use: who is started again, and what ends the robot."""

from __future__ import annotations

import shutil
import signal
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fulmar_bags.run_record import read_run
from fulmar_bringup.launched_command import LaunchedCommand, launched
from fulmar_core.config.errors import DONE, FAILED
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.attitude import euler_of
from tests.conftest import RosDomain
from tests.ros.cli import WATCHDOG_TRIP, under_way

pytestmark = pytest.mark.real_time
AIRCRAFT = ("airship_v7", "--task", "fly_hold", "--controller", "classical")
BANK_DEG, SINK = 10.0, 1.0  # most until touch-down, and there [m/s]


def fly(folder: Path, domain: RosDomain, *more: str) -> LaunchedCommand:
    """`fulmar run` of an aircraft at 2 m."""
    words = (
        "run",
        *AIRCRAFT,
        "--start",
        "0,0,2,0,0,0",
        "--duration",
        "600",
        "--json",
        "--record",
        "bag",
    )
    return launched((*words, *more), environment=domain.env, folder=folder)


def in_flight(command: LaunchedCommand) -> None:
    """Until the plant has flown for a second or more."""
    command.node("plant")
    assert under_way(command.process, Path(command.process.cwd()) / "bag", 700)


def landed_well(bag: Path) -> None:
    """Assert that the craft in a bag came down with level wings and slowly."""
    motion = read_run(bag).truth
    low = motion.position[:, 2] + load_robot("airship_v7").hull_span[0]
    down = int(np.argmax(low < 0.02))
    bank = np.degrees(np.abs(euler_of(tuple(motion.quat_xyzw.T))[0]))
    assert low[down] < 0.02
    assert bank[: down + 1].max() <= BANK_DEG
    assert -motion.velocity_in_world[down, 2] <= SINK


@pytest.mark.slow
@pytest.mark.parametrize("node", ["controller", "estop"])
def test_an_aircraft_whose_node_is_killed_lands_before_its_run_ends(
    node: str, ros_domain: RosDomain, tmp_path: Path
) -> None:
    with fly(tmp_path, ros_domain, "--estop") as command:
        in_flight(command)
        command.node(node).kill()
        if node == "estop":  # its silence brings the craft down, and it is back before
            command.node(node, other_than=0)
            command.process.send_signal(signal.SIGINT)
        assert command.wait(60.0) == FAILED
        assert command.left_over() == []
    landed_well(tmp_path / "bag")


@pytest.mark.slow
def test_ctrl_c_lands_an_aircraft_and_a_second_one_ends_it_at_once(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    with fly(tmp_path, ros_domain) as command:
        in_flight(command)
        command.process.send_signal(signal.SIGINT)
        command.wait_until(lambda: any("flies the robot down" in line for line in command.log), "words", 10.0)
        command.process.send_signal(signal.SIGINT)
        assert command.wait(10.0) == FAILED
        assert command.result["failure"].startswith("stopped by the user")
        assert command.left_over() == []
    assert read_run(tmp_path / "bag").truth.position[-1, 2] > 0.6


@pytest.mark.slow
def test_an_aircraft_lands_also_where_its_launcher_is_killed(ros_domain: RosDomain, tmp_path: Path) -> None:
    with fly(tmp_path, ros_domain) as command:
        in_flight(command)
        plant = command.node("plant")
        command.process.kill()
        command.wait(5.0)
        assert plant.is_running()
        assert command.left_over(60.0) == []


@pytest.mark.parametrize(
    ("node", "number"),
    [
        # tests/fulmar_bringup/test_node_keeper.py and test_processes.py have what starts it again.
        pytest.param("recorder", signal.SIGKILL, marks=pytest.mark.slow),
        pytest.param("recorder", signal.SIGSTOP, marks=pytest.mark.slow),
        pytest.param("markers", signal.SIGKILL, marks=pytest.mark.slow),
        pytest.param("markers", signal.SIGSTOP, marks=pytest.mark.slow),
        pytest.param("estop", signal.SIGKILL, marks=pytest.mark.slow),
        pytest.param("estop", signal.SIGSTOP, marks=pytest.mark.slow),
    ],
)
def test_a_helper_that_dies_or_hangs_below_up_is_started_again_and_control_goes_on(
    node: str, number: signal.Signals, ros_domain: RosDomain, tmp_path: Path
) -> None:
    words = ("up", "mock_lqr", "--estop", "--json", "--record", "bag")
    with launched(words, environment=ros_domain.env, folder=tmp_path) as command:
        command.wait_for_event("started")
        controller = command.node("controller").pid
        lost = command.node(node)
        lost.send_signal(number)
        again = command.node(node, other_than=lost.pid)
        event = command.wait_for_event("restarted")
        assert event["node"] == node
        assert event["reason"] == (
            f"{node} was killed by SIGKILL"
            if number == signal.SIGKILL
            else f"{node} was stopped (SIGSTOP) for 3 s"
        )
        assert command.node("controller").pid == controller
        assert again.is_running()
        command.wait_until(lambda: takes_part(again.pid), f"place of {node} among the others", 10.0)
        command.process.send_signal(signal.SIGTERM)
        assert command.wait(30.0) == DONE
        assert command.left_over() == []
    assert not read_run(tmp_path / "bag").warnings


def takes_part(process: int) -> bool:
    """Whether a process that gave way while it started does so no longer; see `fulmar_core.config.yielding`."""
    group = Path(f"/proc/{process}/autogroup")
    return not group.exists() or group.read_text(encoding="ascii").split()[-1] == "0"


@pytest.mark.slow
def test_a_run_whose_recorder_is_killed_goes_on_and_its_bag_and_result_say_so(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    result, bag = run_without_its_recorder(ros_domain, tmp_path)
    if str(result["failure"]).startswith(WATCHDOG_TRIP):  # a busy machine; see `run_in_real_time`
        shutil.rmtree(bag)
        result, bag = run_without_its_recorder(ros_domain, tmp_path)
    assert (result["failure"], result["success"]) == (None, True)
    said = "recorder was killed by SIGKILL; it was started again, and the robot went on"
    assert said in result["warnings"]
    assert any("nothing was recorded for" in warning for warning in result["warnings"])
    record = read_run(bag)
    assert len(list(bag.glob("*.mcap"))) == 2
    assert record.truth.stamp_s[-1] - record.truth.stamp_s[0] > 11.0


def run_without_its_recorder(domain: RosDomain, folder: Path) -> tuple[dict[str, Any], Path]:
    """Result and bag of a run whose recorder is killed on its way."""
    words = ("run", "floating_platform", "--controller", "lqr", "--backend", "mock", "--duration", "12")
    more = ("--start", "1,0,0", "--goal", "0,0,0", "--json", "--record", "bag")
    with launched((*words, *more), environment=domain.env, folder=folder) as command:
        assert under_way(command.process, folder / "bag", 400)
        command.node("recorder").kill()
        command.wait(60.0)
        return command.result, folder / "bag"


@pytest.mark.slow
def test_a_launcher_that_is_stopped_is_reported_by_its_nodes_and_takes_no_control_away(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    """Nor does it when it goes on, after a time in which it has received from nobody."""
    words = ("run", "floating_platform", "--controller", "lqr", "--backend", "mock", "--duration", "20")
    more = ("--rate", "0.5", "--start", "1,0,0", "--goal", "0,0,0", "--json", "--record", "bag")
    with launched((*words, *more), environment=ros_domain.env, folder=tmp_path) as command:
        assert under_way(command.process, tmp_path / "bag", 400)
        command.process.suspend()
        time.sleep(12.0)
        assert set(command.nodes()) == {"plant", "controller", "recorder"}
        command.process.resume()
        assert command.wait(90.0) == DONE, command.result
    assert command.result["success"]
    assert [each for each in command.result["warnings"] if each.startswith("the launcher is stopped")]
