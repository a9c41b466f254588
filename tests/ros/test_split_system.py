"""Plant and controller in two containers: network, IPC and mount namespaces of their own, and two users."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest
from sensor_msgs.msg import JointState

from fulmar_core.config.errors import BAD_USAGE, DONE, FAILED
from fulmar_core.robots.topics import ACTUATORS_STATE
from fulmar_core.wires.silence import default_timeout
from fulmar_evaluation.faults.two_hosts import TwoHosts, inside, two_hosts
from fulmar_ros.middleware import STATIC_PEERS
from fulmar_ros.qos import subscriber_qos
from fulmar_ros.runtime import ros_node
from tests.conftest import RosDomain
from tests.ros.cli import FULMAR, json_of
from tests.ros.neighbour import NAMESPACE, ROBOT, until
from tests.ros.split_parts import Part, in_container

pytestmark = [pytest.mark.slow, pytest.mark.real_time]
SYSTEM = "mujoco_lqr"
PERIOD_S = 1.0 / 50.0  # of the system's commands
PEER_OF_ROBOT = {STATIC_PEERS: "10.77.0.2"}  # the documented settings of two hosts
PEER_OF_OTHER = {STATIC_PEERS: "10.77.0.1"}
ANSWER_S = 0.25  # after the limit: the state is published each tick, and this computer is busy


class Containers:
    """Two containers, what runs in them, and what the plant's actuators do."""

    def __init__(self, hosts: TwoHosts, env: dict[str, str], folder: Path) -> None:
        self._hosts, self._env, self._folder = hosts, env, folder
        self.parts: list[Part] = []
        self.effort: list[tuple[float, bool]] = []  # when [s], and whether any actuator acts

    def plant(self, *more: str) -> Part:
        return self._up(self._hosts.robot, "plant", SYSTEM, "--estop", *more)

    def controller(self, *more: str, system: str = SYSTEM) -> Part:
        return self._up(self._hosts.other, "controller", system, "--estop", *more)

    def _up(self, host: str, only: str, *arguments: str) -> Part:
        folder = self._folder / f"{only}_{len(self.parts)}"
        folder.mkdir(mode=0o777)
        folder.chmod(0o777)
        command = [*FULMAR, "up", *arguments, "--only", only, "--json"]
        self.parts.append(
            Part(in_container(host, command, other_user=only == "controller"), self._env_on(host), folder)
        )
        return self.parts[-1]

    def _env_on(self, host: str) -> dict[str, str]:
        return self._env | (PEER_OF_ROBOT if host == self._hosts.robot else PEER_OF_OTHER)

    def beside_controller(self, *arguments: str) -> tuple[int, str]:
        """Run a command in the controller's container, as its user; exit code and standard output."""
        command = in_container(self._hosts.other, [*FULMAR, *arguments], other_user=True)
        env = self._env_on(self._hosts.other)
        done = psutil.Popen(command, env=env, cwd="/", stdout=-1, stderr=-1, text=True)
        try:
            output, errors = done.communicate(timeout=60.0)
        finally:
            for process in [*done.children(recursive=True), done] if done.poll() is None else []:
                process.kill()
        return int(done.returncode), output or errors

    def start_beside_controller(self, *arguments: str) -> Part:
        """The same in the background."""
        command = in_container(self._hosts.other, [*FULMAR, *arguments], other_user=True)
        self.parts.append(Part(command, self._env_on(self._hosts.other), self._folder))
        return self.parts[-1]

    def on_state(self, message: JointState) -> None:
        self.effort.append((time.monotonic(), any(message.effort)))

    def last_act_s(self) -> float:
        """When an actuator acted last [s]."""
        return max((at for at, acts in list(self.effort) if acts), default=0.0)


@pytest.fixture
def containers(
    ros_domain: RosDomain, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> Iterator[Containers]:
    """Two containers, and an observer of the actuators on the plant's side."""
    for name, value in PEER_OF_ROBOT.items():
        monkeypatch.setenv(name, value)
    (tmp_path / "logs").mkdir()
    for folder in (tmp_path, tmp_path / "logs"):
        folder.chmod(0o777)
    for folder in tmp_path.parents:  # of pytest, which keeps other users out
        if "pytest" in str(folder):
            folder.chmod(folder.stat().st_mode | 0o011)
    errors: list[Exception] = []
    with two_hosts() as hosts, inside(hosts.robot), ros_node("observer", errors.append) as node:
        logs = {"ROS_LOG_DIR": str(tmp_path / "logs"), "HOME": str(tmp_path)}  # writable for both users
        made = Containers(hosts, {**ros_domain.env, **logs}, tmp_path)
        topic, qos = f"{NAMESPACE}/{ACTUATORS_STATE.name}", subscriber_qos(ACTUATORS_STATE, depth=50)
        node.create_subscription(JointState, topic, made.on_state, qos)
        try:
            yield made
        finally:
            for part in made.parts:
                part.kill()
    assert not errors


def goal(containers: Containers, pose: str) -> None:
    code, words = containers.beside_controller("goals", "--robot", ROBOT, "--pose", pose)
    assert code == DONE, words


def drive_away(containers: Containers) -> None:
    """Publish a goal so far away that the robot is under way for long, and wait until it accelerates."""
    began_s = time.monotonic()
    sender = containers.start_beside_controller("goals", "--robot", ROBOT, "--pose", "4,0,0")
    until(lambda: containers.last_act_s() > began_s, 30.0)
    sender.kill()  # else the next controller would receive its goal, which is latched


def test_a_goal_an_e_stop_and_a_killed_controller_reach_the_plant_of_another_container(
    containers: Containers, record_property: Callable[[str, object], None]
) -> None:
    controller = containers.controller()
    plant = containers.plant()  # the order does not matter
    for part in (plant, controller):
        part.wait_for("started")
    goal(containers, "0.3,0,0")
    plant.wait_for("reached")

    code, words = containers.beside_controller("status", ROBOT, "--json")
    status = json_of(words)
    assert code == DONE, status
    assert status["robots"][0]["estop"] == "released"
    nodes = {node["node"]: node for node in status["robots"][0]["nodes"]}
    assert (nodes["estop"]["level"], nodes["estop"]["reason"]) == ("ok", "released")  # as it reports itself

    drive_away(containers)
    assert containers.beside_controller("estop")[0] == DONE
    plant.wait_for("estop")
    stopped_s = time.monotonic()
    time.sleep(1.0)
    assert containers.last_act_s() < stopped_s
    assert containers.effort[-1][0] > stopped_s + 0.5  # the plant still reports: zero
    assert containers.beside_controller("estop", "--reset")[0] == DONE
    plant.wait_for("reset")

    drive_away(containers)
    killed_s = controller.kill()
    limit_s = default_timeout(PERIOD_S)
    plant.wait_for("fault")
    reaction_s = containers.last_act_s() - killed_s
    record_property("last_act_after_kill_ms", round(1e3 * reaction_s))
    assert -limit_s < reaction_s < limit_s + ANSWER_S  # it acted to the end, and not for longer
    assert {event["node"] for event in plant.of("fault")} <= {"plant", "controller"}
    until(lambda: any(event["node"] == "controller" for event in plant.of("fault")), 10.0)
    assert plant.process.poll() is None

    again = containers.controller()
    again.wait_for("started")
    until(lambda: any(event["node"] == "controller" for event in plant.of("recovered")), 20.0)
    time.sleep(2.0)
    assert containers.last_act_s() < time.monotonic() - 2.0  # without a new goal nothing moves
    goal(containers, "0,0.3,0")
    plant.wait_for("reached", 2)

    plant.kill()
    again.wait_for("fault")
    assert again.of("fault")[-1]["node"] == "plant"
    containers.plant().wait_for("started")
    until(lambda: any(event["node"] == "plant" for event in again.of("recovered")), 30.0)
    for part in (containers.parts[-1], again):
        assert part.end(signal.SIGTERM) == DONE


def test_a_controller_of_another_task_is_rejected_in_a_line_and_the_plant_stays_up(
    containers: Containers,
) -> None:
    plant = containers.plant()
    plant.wait_for("started")
    other = containers.controller("--task", "go_to_position")
    assert other.process.wait(40.0) == BAD_USAGE
    assert "task go_to_pose, here go_to_position" in other.errors[-1]
    assert plant.process.poll() is None
    assert containers.beside_controller("status", ROBOT, "--node", "plant")[0] == DONE
    assert (
        containers.beside_controller("status", ROBOT, "--node", "controller", "--timeout", "2")[0] == FAILED
    )
    assert plant.end(signal.SIGTERM) == DONE
