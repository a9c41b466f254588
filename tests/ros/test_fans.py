"""A robot with fans through live nodes: a run in lock step, a person's hand, and a bag to identify it by."""

from __future__ import annotations

from pathlib import Path

import pytest
from sensor_msgs.msg import Joy

from fulmar_core.config.paths import OWN_FOLDERS
from fulmar_core.robots.topics import JOY
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.qos import publisher_qos
from fulmar_ros.runtime import spinning
from fulmar_ros.teleop_node import TeleopNode
from sim_nodes.sim_node import make_backend
from tests.conftest import RosDomain
from tests.new_robots import write_new_robots
from tests.ros.cli import fulmar, json_of
from tests.ros.neighbour import Neighbour, until

NAME = "fan_disc"


@pytest.fixture(autouse=True)
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """The folder with the robot, for this process and for those that it starts."""
    write_new_robots(tmp_path / "mine")
    monkeypatch.setenv(OWN_FOLDERS, str(tmp_path / "mine"))
    return str(tmp_path / "mine")


@pytest.mark.slow
def test_it_meets_its_goal_in_lock_step_without_a_gains_file(
    own: str, ros_domain: RosDomain, tmp_path: Path
) -> None:
    asked = ("--task", "go_to_pose", "--controller", "classical", "--lockstep", "--seed", "2")
    env = ros_domain.env | {OWN_FOLDERS: own}
    done = fulmar("run", NAME, *asked, "--duration", "20", "--json", env=env, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    summary = json_of(done.stdout)
    assert summary["success"]
    assert summary["final_position_error_m"] < 0.01


@pytest.mark.slow
def test_it_is_excited_and_identify_says_that_there_is_no_model_of_fans(
    own: str, ros_domain: RosDomain, tmp_path: Path
) -> None:
    asked = ("--task", "go_to_position", "--controller", "excite", "--lockstep", "--duration", "5")
    env = ros_domain.env | {OWN_FOLDERS: own}
    done = fulmar("run", NAME, *asked, "--record", "bag", env=env, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    done = fulmar("identify", "bag", env=env, cwd=tmp_path)
    assert done.returncode == 2
    (line,) = done.stderr.strip().splitlines()
    assert "there is no model to identify 'fan_disc' (fans) by; there is one for thrusters" in line


@pytest.mark.real_time
@pytest.mark.parametrize("neighbour", [NAME], indirect=True)
def test_a_person_drives_it_with_a_gamepad(own: str, neighbour: Neighbour) -> None:
    arguments = ["--ros-args", "-r", f"__ns:=/{NAME}", "-p", f"robot:={NAME}"]
    plant = PlantNode(make_backend, lambda _code: None, cli_args=[*arguments, "-p", "backend:=mock"])
    hand = TeleopNode(lambda _code: None, cli_args=[*arguments, "-p", "keyboard:=false"])
    pad = neighbour.node.create_publisher(Joy, JOY.name, publisher_qos(JOY))

    def say(held: int) -> None:
        pad.publish(Joy(axes=[0.0, 1.0, 0.0, 0.0], buttons=[0, 0, 0, 0, held, 0]))

    def fail(error: BaseException) -> None:
        pytest.fail(repr(error))

    with spinning(plant, fail), spinning(hand, fail):
        until(lambda: bool(neighbour.applied))
        until(lambda: say(1) or bool(neighbour.applied[-1].any()))
        force, _ = neighbour.robot.actuators.wrench_in_body(neighbour.applied[-1])
        assert force[0] > 0.1
        until(lambda: say(0) or not neighbour.applied[-1].any())
        hand.stop()
        plant.stop()
