"""One writer for each actuator: two nodes that command one robot, and a second plant of a robot's name."""

from __future__ import annotations

import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from fulmar_bringup.launch_check import refuse_living_plants
from fulmar_bringup.node_spec import NodeSpec
from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.topics import COMMAND, ODOMETRY
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.plant_node import PlantNode
from tests.conftest import RosDomain
from tests.ros.cli import FULMAR, fulmar, json_of
from tests.ros.neighbour import NAMESPACE, ROBOT, Neighbour, open_valves, second_publisher, until

pytestmark = pytest.mark.real_time

PLANT = [
    *(sys.executable, "-m", "sim_nodes.sim_node", "--ros-args", "-r", f"__ns:={NAMESPACE}"),
    *("-p", "backend:=mock"),
]


class Commands:
    """Opens a valve 50 times a second, from a thread."""

    def __init__(self, neighbour: Neighbour) -> None:
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(neighbour,))
        self._thread.start()

    def _run(self, neighbour: Neighbour) -> None:
        while not self._over.wait(0.02):
            neighbour.command(open_valves(neighbour.robot))

    def stop(self) -> None:
        self._over.set()
        self._thread.join()


@pytest.fixture
def commands(neighbour: Neighbour) -> Iterator[Commands]:
    stream = Commands(neighbour)
    yield stream
    stream.stop()


def opened(neighbour: Neighbour) -> bool:
    return bool(neighbour.applied) and bool(neighbour.applied[-1].any())


def test_a_second_node_that_commands_closes_the_valves_until_it_is_gone(
    neighbour: Neighbour, plant: PlantNode, commands: Commands, ros_domain: RosDomain
) -> None:
    """Both are named."""
    until(lambda: opened(neighbour))
    with second_publisher(ros_domain.id, COMMAND):
        until(lambda: not opened(neighbour))
        name = f"{NAMESPACE}/neighbour"
        until(
            lambda: (
                f"2 nodes publish commands, and only one may: {name}, {name}" in neighbour.said["plant"][0]
            )
        )
    until(lambda: opened(neighbour))
    assert plant.guard.watchdog.trips == 0  # the commands went on all the time


def test_a_controller_follows_no_input_of_two_nodes_names_both_and_goes_on_when_one_is_gone(
    neighbour: Neighbour, controller: ControllerNode, ros_domain: RosDomain
) -> None:
    """Odometry; tests/fulmar_ros/test_writer_watch.py has the others."""

    def acts() -> bool:
        neighbour.odometry(time.time_ns())
        time.sleep(0.02)
        return bool(neighbour.commands) and bool(neighbour.commands[-1].any())

    until(lambda: neighbour.goal_publisher.get_subscription_count() > 0)
    neighbour.give_goal()
    until(acts)
    name = f"{NAMESPACE}/neighbour"
    words = f"2 nodes publish {ODOMETRY.name}, and only one may: {name}, {name}"
    with second_publisher(ros_domain.id, ODOMETRY):
        until(lambda: not acts())
        until(lambda: not acts() and neighbour.said["controller"][1].get("warnings") == words)
        message, values = neighbour.said["controller"]
        assert message == values["reason"] == words
        assert values["mode"] == "armed"
    until(acts)


def test_a_node_that_publishes_odometry_and_starts_again_in_order_is_no_second_one(
    neighbour: Neighbour, controller: ControllerNode
) -> None:
    until(lambda: neighbour.goal_publisher.get_subscription_count() > 0)
    neighbour.give_goal()
    for _ in range(3):
        for _ in range(10):
            neighbour.odometry(time.time_ns())
            time.sleep(0.02)
            assert not controller.guard.flags.contested
        neighbour.measure_anew()


@pytest.mark.slow
def test_a_run_ends_where_another_node_commands_its_robot_and_its_result_names_both(
    neighbour: Neighbour, ros_domain: RosDomain, tmp_path: Path
) -> None:
    """The neighbour has a publisher of commands, and never uses it."""
    neighbour.withdraw_odometry()
    asked = ("--controller", "lqr", "--goal", "1,0,0", "--record", "bag", "--json")
    done = fulmar("run", ROBOT, *asked, env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 1
    failure = json_of(done.stdout)["failure"]
    assert failure.startswith("plant: 2 nodes publish commands, and only one may: ")
    assert f"{NAMESPACE}/controller, {NAMESPACE}/neighbour" in failure
    assert not neighbour.applied[-1].any()


@pytest.fixture
def live(neighbour: Neighbour, ros_domain: RosDomain, commands: Commands) -> Iterator[psutil.Process]:
    """A plant in a process of its own, which a neighbour drives."""
    process = subprocess.Popen(PLANT, env=ros_domain.env)
    until(lambda: opened(neighbour), timeout_s=20.0)
    yield psutil.Process(process.pid)
    process.terminate()
    process.wait()


def test_a_plant_whose_name_already_lives_is_refused_by_run_launch_file_and_node(
    neighbour: Neighbour, live: psutil.Process, ros_domain: RosDomain, tmp_path: Path
) -> None:
    """Each says which process on which host lives there, and the live robot never notices."""
    place = f"{NAMESPACE}/plant, process {live.pid} on host {socket.gethostname()}"
    until(lambda: "plant" in neighbour.said)
    begun = len(neighbour.applied)

    run = fulmar("run", ROBOT, "--controller", "lqr", "--record", "bag", env=ros_domain.env, cwd=tmp_path)
    assert run.returncode == 2
    assert place in " ".join(run.stderr.split())
    assert not (tmp_path / "bag").exists()

    node = subprocess.run(
        PLANT, env=ros_domain.env, capture_output=True, text=True, timeout=20.0, check=False
    )
    assert node.returncode in (2, 1), node.stderr  # 1: discovered late, on a busy machine
    assert place in node.stderr

    plant = NodeSpec("plant", "sim_nodes", "sim_node", "sim_nodes.sim_node", NAMESPACE)
    with pytest.raises(ConfigError, match=f"process {live.pid} on host"):
        refuse_living_plants([plant])
    refuse_living_plants([NodeSpec("plant", "sim_nodes", "sim_node", "sim_nodes.sim_node", "/another")])

    assert live.is_running()
    said, values = neighbour.said["plant"]
    assert (said, values["watchdog_trips"]) == ("running", "0")
    if node.returncode == 2:  # one that is discovered late reports its own safe state until then
        assert all(applied.any() for applied in neighbour.applied[begun:])


@pytest.mark.slow  # tests/fulmar_ros/test_older_plant.py has who gives way
def test_of_two_plants_that_start_at_once_not_both_live(ros_domain: RosDomain) -> None:
    """Neither has published anything yet when the other looks."""
    both = [subprocess.Popen(PLANT, env=ros_domain.env, stderr=subprocess.PIPE, text=True) for _ in range(2)]
    try:
        until(lambda: any(one.poll() is not None for one in both), timeout_s=20.0)
        ended = next(one for one in both if one.poll() is not None)
        assert "/floating_platform/plant lives in " in ended.communicate()[1]
    finally:
        for one in both:
            one.kill()
            one.wait()


@pytest.mark.slow
def test_of_two_runs_of_one_name_that_start_at_once_no_more_than_one_runs_and_the_other_is_refused_in_one_line(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    """Of two users, whose locks are apart. The first to see the nodes of the other ends; both may."""
    asked = [
        *FULMAR,
        "run",
        ROBOT,
        "--controller",
        "lqr",
        "--goal",
        "0.5,0,0",
        "--lockstep",
        "--record",
        "bag",
    ]
    folders = [tmp_path / "one", tmp_path / "two"]
    runs = []
    for folder in folders:
        folder.mkdir()
        env = ros_domain.env | {"TMPDIR": str(folder)}
        runs.append(subprocess.Popen(asked, env=env, cwd=folder, stderr=subprocess.PIPE, text=True))
    words = [run.communicate(timeout=60.0)[1] for run in runs]
    codes = [run.returncode for run in runs]
    assert sorted(codes) in ([0, 2], [2, 2]), words
    for code, said, folder in zip(codes, words, folders, strict=True):
        assert "RCLError" not in said
        if code == 2:
            assert (
                f"another run of this name goes on in ROS domain {ros_domain.id}: {NAMESPACE}/plant" in said
            )
            assert "set ROS_DOMAIN_ID to another number" in said
            assert not (folder / "bag").exists()
