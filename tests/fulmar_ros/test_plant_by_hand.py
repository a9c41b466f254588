"""The plant's node without a clock: what it takes from whom, and what it leaves behind."""

from __future__ import annotations

import time

import numpy as np
import pytest
from rclpy.lifecycle import TransitionCallbackReturn
from std_msgs.msg import Bool

from fulmar_core.simulation.backend import Sample
from fulmar_ros.plant_node import PlantNode
from tests.fulmar_ros.by_hand import PLATFORM, DrivenPlant, ros

OPEN, SHUT = [1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0], [0.0] * 8


class Backend:
    """Counts how often it was made safe and closed."""

    robot = PLATFORM

    def __init__(self) -> None:
        self.log: list[str] = []

    def reset(self, *_arguments, **_keywords):
        raise RuntimeError("the board is gone")

    def step(self, command):
        return Sample({}, None)

    def make_safe(self) -> None:
        self.log.append("safe")

    def close(self) -> None:
        self.log.append("closed")


@pytest.fixture
def backend():
    return Backend()


@pytest.fixture
def plant(ros_domain, backend):
    with ros():
        driven = DrivenPlant(backend)
        yield driven
        driven.node.stop()


def output(driven: DrivenPlant) -> list[float]:
    return driven.node.guard.output(time.monotonic_ns()).tolist()


def test_a_command_is_carried_out(plant):
    plant.command(OPEN)
    assert output(plant) == OPEN


def test_the_first_command_of_a_second_publisher_is_not_carried_out(plant, monkeypatch):
    plant.command(OPEN)
    monkeypatch.setattr("fulmar_ros.plant_commands.writers_of", lambda *_: ["/a/controller", "/b/controller"])
    plant.command(OPEN[::-1])
    assert output(plant) == SHUT


def test_at_its_end_a_plant_takes_no_command(plant):
    plant.node.wires.commands.listening = False
    plant.command(OPEN)
    assert output(plant) == SHUT


def test_what_was_on_its_way_at_a_shutdown_moves_nothing_and_ends_nothing(plant):
    """The executor delivers it all the same, and an error would end the process with exit code 1."""
    plant.node.trigger_shutdown()
    plant.command(OPEN)
    plant.node.wires.estop._on_estop(Bool(data=True), {})
    plant.node.wires.estop._on_released(None)
    plant.node.health.publish()
    assert output(plant) == SHUT


def test_a_torn_command_feeds_no_watchdog(plant):
    plant.node.wires.commands._on_command(b"\xff" * 90)
    assert plant.node.guard.watchdog.expired(time.monotonic_ns())


def test_a_press_closes_the_valves_at_the_plant(plant):
    plant.command(OPEN)
    plant.node.wires.estop._on_estop(Bool(data=True), {})
    assert output(plant) == SHUT
    plant.node.wires.estop._on_released(None)
    assert output(plant) == SHUT  # until a new command


def test_an_answer_to_a_state_of_long_ago_opens_no_valve(plant):
    commands, now_ns = plant.node.wires.commands, time.monotonic_ns()
    timeout_ns = plant.node.guard.watchdog.timeout_ns
    commands._sent.note(5_000, now_ns - 2 * timeout_ns)
    commands._sent.note(6_000, now_ns)
    plant.command(OPEN, 5_000)
    assert output(plant) == SHUT
    plant.command(OPEN, 6_000)
    assert output(plant) == OPEN


def test_a_backend_that_raises_is_made_safe_and_ends_the_process(plant, backend):
    type(plant.node)._run(plant.node, backend)
    assert backend.log == ["safe"]
    assert plant.codes == [1]
    assert (plant.node.health.mode, plant.node.health.reason) == ("fault", "RuntimeError: the board is gone")


@pytest.mark.parametrize(
    ("end", "left"),
    [("trigger_deactivate", ["safe"]), ("stop", ["safe", "closed"])],
    ids=["deactivated", "stopped"],
)
def test_a_plant_that_is_deactivated_or_stopped_is_made_safe(plant, backend, end, left):
    plant.command(OPEN)
    getattr(plant.node, end)()
    assert backend.log == left


def test_a_plant_that_is_activated_again_begins_with_the_safe_command(plant):
    plant.command(OPEN)
    plant.node.trigger_deactivate()
    plant.node.trigger_activate()
    assert output(plant) == SHUT
    assert np.array_equal(plant.node.guard.command, PLATFORM.actuators.safe_command)


@pytest.mark.parametrize(
    ("error", "said"),
    [(RuntimeError("no CPU of this kind"), "RuntimeError: no CPU of this kind"), (OSError(), "OSError")],
)
def test_a_backend_that_cannot_be_made_is_said_with_its_reason(ros_domain, error, said):
    def fail(_robot, _settings):
        raise error

    with ros():
        node = PlantNode(fail, lambda _code: None, cli_args=["--ros-args", "-p", "autostart:=false"])
        assert node.trigger_configure() != TransitionCallbackReturn.SUCCESS
        assert node.health.reason == said
        node.stop()
