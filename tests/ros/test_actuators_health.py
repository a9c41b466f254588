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
from fulmar_core.health.informer import Informer
from fulmar_core.robot import load_robot
from fulmar_core.safety.input_gate import Measurement
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
    """The recorder listens, so the controller's node says what it believes at every step."""
    scenario, seed = "drift_two_lost", 3
    asked = ("floating_platform", "--controller", "policy", "--scenario", scenario, "--seed", str(seed))
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
def test_a_command_does_not_wait_for_a_health_that_only_a_recorder_wants(
    stream: Stream, controller: ControllerNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else recording would make the control loop slower."""
    answered = []

    def see(measurement: Measurement, _informer: Informer, *, wanted: bool) -> None:
        answered.append(wanted and controller._answered_ns == measurement.stamp_ns)

    monkeypatch.setattr(controller._actuators, "see", see)
    stream.neighbour.node.create_subscription(
        JointState, ACTUATORS_HEALTH.name, lambda _message: None, subscriber_qos(ACTUATORS_HEALTH)
    )
    until(lambda: controller.wires.health_wanted)
    answered.clear()
    until(lambda: len(answered) > 5)
    assert all(answered[1:])


@pytest.mark.real_time
def test_where_nobody_listens_nothing_is_reckoned(stream: Stream, controller: ControllerNode) -> None:
    """And from the first listener on, it is."""
    assert not controller.wires.health_wanted
    heard: list[JointState] = []
    stream.neighbour.node.create_subscription(
        JointState, ACTUATORS_HEALTH.name, heard.append, subscriber_qos(ACTUATORS_HEALTH)
    )
    until(lambda: len(heard) > 5)
    assert np.asarray(heard[0].effort) == pytest.approx(0.98, abs=0.01)
