"""The health of the valves, over real wires and in the bag of a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState

from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.episode import draw_episode
from fulmar_core.robot import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.topics import ACTUATORS_HEALTH, COMMAND
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.qos import subscriber_qos
from tests.conftest import RosDomain
from tests.ros.cli import fulmar
from tests.ros.neighbour import Stream, until

PLATFORM = load_robot("floating_platform")


def told(bag: Path, topic: str) -> list[JointState]:
    """Every message of one topic."""
    (file,) = bag.glob("*.mcap")
    with file.open("rb") as stream:
        return [
            deserialize_message(message.data, JointState)
            for _, channel, message in make_reader(stream).iter_messages()
            if channel.topic == f"/floating_platform/{topic}"
        ]


def test_a_valve_that_stays_closed_is_in_the_bag_of_its_run(ros_domain: RosDomain, tmp_path: Path) -> None:
    """The recorder subscribes, so the node publishes the estimate that its controller uses at every step."""
    scenario, seed = "drift_two_lost", 3
    asked = ("floating_platform", "--controller", "lqr", "--scenario", scenario, "--seed", str(seed))
    done = fulmar(
        "run", *asked, "--lockstep", "--duration", "20", "--record", "bag", env=ros_domain.env, cwd=tmp_path
    )
    assert (tmp_path / "bag").is_dir(), done.stderr
    world = draw_episode(
        PLATFORM, load_task("go_to_pose"), load_scenario(scenario), seed=seed, number=0
    ).world
    commands = np.array([message.effort for message in told(tmp_path / "bag", COMMAND.name)])
    health = told(tmp_path / "bag", ACTUATORS_HEALTH.name)
    assert len(health) >= 95
    assert list(health[-1].name) == list(PLATFORM.actuators.names)
    last = np.array(health[-1].effort)
    used = commands.sum(axis=0) >= 5
    dead = np.asarray(world.alive) == 0.0
    assert np.any(used & dead)
    assert np.all(last[used & dead] < 0.2)
    assert np.all(last[~dead] > 0.5)


@pytest.mark.real_time
def test_an_estimate_is_published_once_somebody_subscribes_and_no_command_waits_for_it(
    stream: Stream, controller: ControllerNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else recording would make the control loop slower."""
    published: list[tuple[str, int]] = []
    publish_command, publish_health = (
        controller.wires.publish_command,
        controller.wires.publish_actuators_health,
    )

    def command(values: np.ndarray, stamp: int) -> None:
        publish_command(values, stamp)
        published.append(("command", stamp))

    def health(values: np.ndarray, stamp: int) -> None:
        published.append(("health", stamp))
        publish_health(values, stamp)

    monkeypatch.setattr(controller.wires, "publish_command", command)
    monkeypatch.setattr(controller.wires, "publish_actuators_health", health)
    until(lambda: len(published) > 5)
    assert {what for what, _ in published} == {"command"}
    received: list[JointState] = []
    stream.neighbour.node.create_subscription(
        JointState, ACTUATORS_HEALTH.name, received.append, subscriber_qos(ACTUATORS_HEALTH)
    )
    until(lambda: len(received) > 5)
    assert np.asarray(received[0].effort) == pytest.approx(0.98, abs=0.01)
    order = list(published)
    begins = order.index(next(each for each in order if each[0] == "health"))
    for before, after in zip(order[begins - 1 :], order[begins:], strict=False):
        if after[0] == "health":
            assert before == ("command", after[1])
