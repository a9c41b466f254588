"""The health of the valves that a controller estimates, over real wires and in the bag of a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import ACTUATORS_HEALTH, COMMAND
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.qos import subscriber_qos
from tests.conftest import RosDomain
from tests.ros.cli import fulmar
from tests.ros.neighbour import Stream, until

PLATFORM = load_robot("floating_platform")


def reported(bag: Path, topic: str) -> list[JointState]:
    """Every message of one topic."""
    (file,) = bag.glob("*.mcap")
    with file.open("rb") as stream:
        return [
            deserialize_message(message.data, JointState)
            for _, channel, message in make_reader(stream).iter_messages()
            if channel.topic == f"/floating_platform/{topic}"
        ]


def run_policy(ros_domain: RosDomain, folder: Path, task: str, *more: str) -> Path:
    """The bag of a policy's run in lock step."""
    asked = ("floating_platform", "--task", task, "--controller", "policy", *more)
    done = fulmar("run", *asked, "--lockstep", "--record", "bag", env=ros_domain.env, cwd=folder)
    assert (folder / "bag").is_dir(), done.stderr
    return folder / "bag"


@pytest.mark.slow
def test_the_estimate_that_a_policy_uses_of_its_valves_is_in_the_bag_of_its_run(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    scenario, seed, task = "drift_two_lost", 3, load_task("drift_go_to_pose")
    more = ("--scenario", scenario, "--seed", str(seed), "--duration", "20")
    bag = run_policy(ros_domain, tmp_path, task.name, *more)
    world = draw_episode(PLATFORM, task, load_scenario(scenario), seed=seed, number=0).world
    health = reported(bag, ACTUATORS_HEALTH.name)
    assert len(health) >= 95
    assert list(health[-1].name) == list(PLATFORM.actuators.names)
    last = np.array(health[-1].effort)
    dead = np.asarray(world.alive) == 0.0
    assert dead.sum() == 2
    assert np.all(last[dead] < 0.2)
    assert np.all(last[~dead] > 0.5)


@pytest.mark.slow
def test_a_controller_without_an_estimator_publishes_no_health(ros_domain: RosDomain, tmp_path: Path) -> None:
    bag = run_policy(ros_domain, tmp_path, "go_to_pose", "--duration", "2")
    assert reported(bag, COMMAND.name)
    assert reported(bag, ACTUATORS_HEALTH.name) == []


@pytest.mark.real_time
def test_health_is_published_where_it_is_subscribed_to_and_never_before_its_command(
    stream: Stream, controller: ControllerNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else recording would make the control loop slower."""
    assert not controller.wires.health_wanted
    published: list[tuple[str, int]] = []
    command, health = controller.wires.publish_command, controller.wires.publish_actuators_health

    def publish_command(values: np.ndarray, stamp: int) -> None:
        published.append(("command", stamp))
        command(values, stamp)

    def publish_health(values: np.ndarray, stamp: int) -> None:
        published.append(("health", stamp))
        health(values, stamp)

    monkeypatch.setattr(controller.wires, "publish_command", publish_command)
    monkeypatch.setattr(controller.wires, "publish_actuators_health", publish_health)
    until(lambda: len(published) > 5)
    assert not [stamp for name, stamp in published if name == "health"]
    received: list[JointState] = []
    stream.neighbour.node.create_subscription(
        JointState, ACTUATORS_HEALTH.name, received.append, subscriber_qos(ACTUATORS_HEALTH)
    )
    until(lambda: len(received) > 5)
    assert np.asarray(received[0].effort) == pytest.approx(0.98, abs=0.01)
    seen = list(published)
    for at, (name, stamp) in enumerate(seen):
        if name == "health":
            assert ("command", stamp) in seen[:at]
