"""Fallback and change of policies on the wires."""

from __future__ import annotations

import json
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from std_msgs.msg import String

from fulmar_bringup.robot_operator import Operator
from fulmar_core.config.errors import FulmarError, RunFailed
from fulmar_core.controllers.controller import Inputs
from fulmar_core.estimators.actuator_health.beliefs import Beliefs
from fulmar_core.loop.bundle_signature import make_keys, sign_bundle
from fulmar_core.loop.swap_request import SwapRequest, read_request
from fulmar_core.robots.topics import METADATA, SWAP
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.qos import publisher_qos, subscriber_qos
from fulmar_ros.runtime import spinning
from policy_server.controller_node import make_controller
from policy_server.controllers import policies_directory
from policy_server.policy import Policy
from tests.ros.controllers import copy_of
from tests.ros.neighbour import NAMESPACE, ROBOT, Neighbour, Stream, asked_by_neighbour, until
from tests.ros.recorder import Recorder

real_time = pytest.mark.real_time

SHIPPED = policies_directory() / "floating_platform_go_to_pose"
OTHER_TASK = policies_directory() / "floating_platform_go_to_position"
OTHER_ROBOT = policies_directory() / "turtlebot2_go_to_pose"

Start = Callable[..., ControllerNode]


@pytest.fixture
def start(neighbour: Neighbour, monkeypatch: pytest.MonkeyPatch) -> Iterator[Start]:
    """Starts a policy node with parameters; stops it at the end."""
    monkeypatch.setattr(sys, "argv", ["controller_node"])
    nodes: list[ControllerNode] = []
    contexts = []

    def begin(**parameters: object) -> ControllerNode:
        arguments = ["--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", "control_hz:=5.0"]
        for name, value in parameters.items():
            arguments += ["-p", f"{name}:={value}"]
        node = ControllerNode(make_controller, lambda _code: None, cli_args=arguments)
        context = spinning(node, lambda error: pytest.fail(repr(error)))
        context.__enter__()
        nodes.append(node)
        contexts.append(context)
        neighbour.give_goal()
        until(lambda: "controller" in neighbour.said)
        return node

    yield begin
    for node, context in zip(nodes, contexts, strict=True):
        node.stop()
        context.__exit__(None, None, None)


def values(neighbour: Neighbour) -> dict[str, str]:
    return neighbour.said["controller"][1]


def damaged(folder: Path) -> Path:
    bundle = shutil.copytree(SHIPPED, folder / "damaged")
    (bundle / "policy.onnx").write_bytes((bundle / "policy.onnx").read_bytes()[:-1] + b"x")
    return bundle


@real_time
@pytest.mark.parametrize("what", ["wrong hash", "unsigned"])
def test_a_policy_that_is_refused_gives_its_place_to_the_named_controller(
    what: str, neighbour: Neighbour, start: Start, tmp_path: Path
) -> None:
    more, folder = {}, SHIPPED
    if what == "unsigned":
        make_keys(tmp_path / "private.pem", tmp_path / "public.pem")
        more["trusted_keys"] = tmp_path / "public.pem"
    else:
        folder = damaged(tmp_path)
    start(policy=folder, fallback="lqr", **more)
    odometry = Stream(neighbour)
    until(lambda: bool(neighbour.commands) and neighbour.commands[-1].any())
    until(lambda: values(neighbour)["mode"] == "active")
    odometry.stop()
    assert values(neighbour)["controller"] == "lqr"
    assert values(neighbour)["fell_back"]


def test_without_a_fallback_it_does_not_start(neighbour: Neighbour, start: Start, tmp_path: Path) -> None:
    with pytest.raises(FulmarError, match="SHA-256"):
        start(policy=damaged(tmp_path))


def test_a_rate_that_the_policy_was_not_trained_at_is_refused_too(neighbour: Neighbour, start: Start) -> None:
    start(policy=SHIPPED, fallback="lqr", control_hz=10.0)
    until(lambda: values(neighbour)["controller"] == "lqr")
    assert "Hz" in values(neighbour)["fell_back"]


@real_time
def test_a_policy_whose_commands_are_refused_several_times_is_replaced(
    neighbour: Neighbour, start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    good = Policy.act

    def act(self: Policy, inputs: Inputs) -> np.ndarray:
        command = good(self, inputs)
        return np.full_like(command, np.nan) if asked_by_neighbour(inputs) else command

    monkeypatch.setattr(Policy, "act", act)
    start(policy=SHIPPED, fallback="lqr")
    odometry = Stream(neighbour)
    until(lambda: values(neighbour)["controller"] == "lqr")
    until(lambda: neighbour.commands[-1].any())
    odometry.stop()
    assert all(np.isfinite(command).all() for command in neighbour.commands)
    assert int(values(neighbour)["rejections"]) >= 3


class Swapper:
    """Asks for another policy, and notes who says that it controls."""

    def __init__(self, neighbour: Neighbour) -> None:
        self.neighbour, self.metadata = neighbour, list[dict[str, object]]()
        self._publisher = neighbour.node.create_publisher(String, SWAP.name, publisher_qos(SWAP))
        neighbour.node.create_subscription(
            String,
            METADATA.name,
            lambda message: self.metadata.append(json.loads(message.data)),
            subscriber_qos(METADATA),
        )
        until(lambda: bool(self._publisher.get_subscription_count() and self.metadata))
        time.sleep(0.3)

    def ask(self, folder: Path | str, answer: str, words: str = "") -> None:
        """Ask for a bundle, and wait for an answer that begins with one text and contains another."""
        self._publisher.publish(String(data=str(folder)))

        def answered() -> bool:
            swap = values(self.neighbour)["swap"]
            return swap.startswith(answer) and words in swap

        until(answered)


@real_time
def test_a_policy_is_changed_while_it_acts_without_a_gap_or_a_stray_command(
    neighbour: Neighbour, start: Start, tmp_path: Path
) -> None:
    start(policy=SHIPPED)
    odometry = Stream(neighbour)
    until(lambda: bool(neighbour.commands) and neighbour.commands[-1].any())
    swapper = Swapper(neighbour)
    before = values(neighbour)
    count = len(neighbour.commands)
    swapper.ask(copy_of(tmp_path, "second"), "done")
    until(lambda: len(neighbour.commands) > count + 5)
    odometry.stop()
    after = values(neighbour)
    assert after["sha256"] != before["sha256"]
    assert swapper.metadata[-1]["sha256"] == after["sha256"]
    assert after["mode"] == "active"
    assert after["rejections"] == "0"
    # The two are the same network: whatever happened in between would show as another command.
    around = np.array(neighbour.commands[count - 1 : count + 5])
    assert (around == around[0]).all()


@real_time
def test_policies_that_do_not_fit_are_refused_and_the_old_one_goes_on(
    neighbour: Neighbour, start: Start
) -> None:
    start(policy=SHIPPED)
    odometry = Stream(neighbour)
    until(lambda: bool(neighbour.commands) and neighbour.commands[-1].any())
    before = values(neighbour)["sha256"]
    swapper = Swapper(neighbour)
    for folder, words in (
        (OTHER_ROBOT, "trained for robot"),
        (OTHER_TASK, "trained for task"),
        ("/nowhere", "nowhere"),
        ("x" * 5000, "characters"),
    ):
        swapper.ask(folder, "refused", words)
        count = len(neighbour.commands)
        until(lambda count=count: len(neighbour.commands) > count + 1)
        assert neighbour.commands[-1].any(), words
        assert values(neighbour)["sha256"] == before, words
    odometry.stop()


@real_time
def test_where_signatures_are_asked_for_only_a_signed_policy_takes_over(
    neighbour: Neighbour, start: Start, tmp_path: Path
) -> None:
    make_keys(tmp_path / "private.pem", tmp_path / "public.pem")
    first, second = copy_of(tmp_path, "first"), copy_of(tmp_path, "second")
    sign_bundle(first, tmp_path / "private.pem")
    start(policy=first, trusted_keys=tmp_path / "public.pem")
    swapper = Swapper(neighbour)
    swapper.ask(second, "refused")
    assert "not signed" in values(neighbour)["swap"]
    sign_bundle(second, tmp_path / "private.pem")
    swapper.ask(second, "done")


@real_time
def test_the_swap_command_waits_for_the_controller_beside_a_recorder_and_asks_again(
    neighbour: Neighbour, start: Start, record: Callable[..., Recorder], tmp_path: Path, monkeypatch
) -> None:
    """A recorder subscribes to requests too, and the controller's first look at one may come before it is matched.

    Here the controller drops the first two: the command sends them again, and each swap loads once, also the second
    to the folder that runs already.
    """
    dropped, loaded = [], []
    taken, load = ControllerNode._on_swap, ControllerNode._load

    def lossy(self: ControllerNode, message: String) -> None:
        dropped.append(message.data) if len(dropped) < 2 else taken(self, message)

    def counted(self: ControllerNode, request: SwapRequest) -> object:
        loaded.append(request.bundle)
        return load(self, request)

    monkeypatch.setattr(ControllerNode, "_on_swap", lossy)
    monkeypatch.setattr(ControllerNode, "_load", counted)
    record().wait_until_recording()  # it is there before any controller is
    until(lambda: neighbour.node.count_subscribers(f"{NAMESPACE}/{SWAP.name}") > 0)
    person = Operator(neighbour.node)
    with pytest.raises(RunFailed, match="no controller of 'floating_platform'"):
        person.ask_swap(ROBOT, bundle="x", find_s=0.3, answer_s=0.1)
    node = start(policy=SHIPPED)
    odometry = Stream(neighbour)
    second = str(copy_of(tmp_path, "second"))
    node._actuator_beliefs._estimated = Beliefs(words=("a push of 2.00 N is believed",))
    until(lambda: values(neighbour)["beliefs"] != "")
    for number in (1, 2):
        answer = person.ask_swap(ROBOT, bundle=second, find_s=5.0, answer_s=10.0)
        assert (answer.accepted, answer.bundle) == (True, second)
        assert loaded == [second] * number
    until(lambda: values(neighbour)["beliefs"] == "")  # the one before believed it
    odometry.stop()
    assert [read_request(text).bundle for text in dropped] == [second] * 2
