"""The controller's node with a controller that sees: it acts on images of its camera alone, else the robot is safe."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from rclpy.serialization import serialize_message

from fulmar_core.config.errors import BundleError
from fulmar_core.loop.swap_request import read_request
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import CAMERA_DEPTH
from fulmar_core.safety.arbiter import Mode
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_at
from fulmar_ros import graph
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.convert import OdometryWriter
from fulmar_ros.goal_messages import goal_message
from tests.fulmar_bags.test_image_bytes import message
from tests.fulmar_ros.by_hand import JUST_NOW, STEP_NS, ros

ROBOT, TASK = load_robot("cubesat_8"), load_task("dock")
FAR = np.full((240, 320), 4.0, np.float32)


class OpensByDepth:
    """Opens every nozzle by an eighth of the nearest depth in metres."""

    name, control_hz, estimator, observer = "policy", 10.0, None, None
    readings = ("camera_depth",)

    def reset(self):
        pass

    def act(self, inputs):
        return np.full((1, 8), inputs.readings["camera_depth"].min() / 8.0)

    def metadata(self):
        return {"controller": self.name, "sha256": "0"}


class Blind(OpensByDepth):
    """The same without eyes."""

    readings = ()

    def act(self, inputs):
        return np.zeros((1, 8))


class Driven:
    """The node, whose messages a test sends itself, by the clock or in lock step."""

    def __init__(self, *, lockstep=True, controller=OpensByDepth):
        parameters = ("robot:=cubesat_8", "task:=dock", f"lockstep:={str(lockstep).lower()}", "estop:=false")
        arguments = ["--ros-args", "-r", "__ns:=/cubesat_8", *(w for p in parameters for w in ("-p", p))]
        self.node = ControllerNode(lambda *_: controller(), print, cli_args=arguments)
        self.sent = []
        self.node.wires.publish_command = lambda command, _stamp: self.sent.append(np.array(command))
        self._times = itertools.count(STEP_NS, STEP_NS)
        self._write = OdometryWriter(ROBOT.sensors.odometry)
        self.now = 0
        self.node._on_goal(goal_message(goal_at(TASK.berth), "goal_pose", 7), JUST_NOW)

    def look(self, pixels=FAR, *, age_ns=0, encoding="32FC1"):
        """Receive an image of the time of the newest odometry."""
        made = message(pixels, encoding)
        made.header.stamp.sec, made.header.stamp.nanosec = divmod(self.now - age_ns, 10**9)
        (made_by_ros,) = self.node._readings.followed[CAMERA_DEPTH.name]
        made_by_ros.callback(serialize_message(made))

    def be(self, *, again=False):
        """Receive odometry before the port."""
        self.now = self.now if again else next(self._times)
        zero = 0.0
        state = SpatialState(3.0, zero, 1e-9 * self.now, zero, zero, 1.0, *([zero] * 7))
        self.node._on_odometry(self._write.raw(state.to_rigid(), self.now))


@pytest.fixture(autouse=True)
def context(ros_domain):
    with ros():
        yield


def acted(driven):
    """The newest command, and how many there were."""
    return (driven.sent[-1][0], len(driven.sent))


def test_in_lock_step_odometry_waits_for_the_image_of_its_own_stamp():
    driven = Driven()
    driven.be()
    assert driven.sent == []
    driven.look()
    assert acted(driven) == (0.5, 1)
    driven.be()
    assert len(driven.sent) == 1
    driven.look(0.5 * FAR)
    assert acted(driven) == (0.25, 2)


def test_an_image_that_comes_before_its_odometry_counts():
    driven = Driven()
    driven.be()
    driven.look()
    driven.now += STEP_NS
    driven.look(0.25 * FAR)
    driven.be()
    assert acted(driven) == (0.125, 2)


@pytest.mark.parametrize(
    ("pixels", "encoding", "words"),
    [
        (FAR[:64, :64], "32FC1", "the image is 64 × 64 px, the camera of 'cubesat_8' has 320 × 240"),
        (FAR.astype(np.uint16), "16UC1", "the image is '16UC1', must be '32FC1'"),
    ],
)
def test_an_image_of_another_size_or_encoding_makes_the_robot_safe_with_one_line(pixels, encoding, words):
    driven = Driven()
    driven.be()
    driven.look()
    driven.be()
    driven.look(pixels, encoding=encoding)
    driven.be(again=True)
    driven.be(again=True)
    assert driven.sent[-1].tolist() == [0.0] * 8
    flags = driven.node.guard.flags
    assert flags.image_problem == f"camera_depth: {words}"
    driven.be()
    driven.look()
    assert acted(driven)[0] == 0.5
    assert driven.node.guard.flags.image_problem == ""


def test_bytes_that_are_no_image_make_the_robot_safe():
    driven = Driven()
    driven.be()
    driven.look()
    (made,) = driven.node._readings.followed[CAMERA_DEPTH.name]
    made.callback(b"\x00\x01\x00\x00")
    driven.be()
    driven.be(again=True)
    assert driven.sent[-1].tolist() == [0.0] * 8
    assert "no message of an image" in driven.node.guard.flags.image_problem


def test_by_the_clock_the_newest_image_counts_until_it_is_half_a_second_old():
    driven = Driven(lockstep=False)
    driven.node._beat.halt()
    driven.be()
    driven.look()
    for step in range(8):
        driven.node._step()
        if step * STEP_NS <= 500_000_000:
            assert driven.sent[-1].tolist() == [0.5] * 8
        elif step == 6:
            assert driven.sent[-1].tolist() == [0.0] * 8  # the body is where the backup holds it
        driven.be()
    force, _ = ROBOT.actuators.wrench_in_body(driven.sent[-1])
    assert force[2] < -0.1  # by then it has risen, and is brought back
    assert np.all(np.abs(force[:2]) < 1e-9)
    assert driven.node.guard.flags.image_problem == "camera_depth: no usable image for 700 ms (limit 500 ms)"
    assert driven.node.guard.decide(0).mode is Mode.ARMED


def test_by_the_clock_a_camera_that_never_spoke_is_said():
    driven = Driven(lockstep=False)
    driven.node._beat.halt()
    driven.be()
    driven.node._step()
    assert driven.node.guard.flags.image_problem == "camera_depth: no image yet. Does the camera run?"
    assert driven.sent[-1].tolist() == [0.0] * 8


def test_two_cameras_hold_the_robot_with_a_warning_and_it_goes_on_when_one_is_gone(monkeypatch):
    """As discovery shows them, when the launcher starts a camera anew that was killed."""
    found, said = ["/cubesat_8/camera"] * 2, []
    monkeypatch.setattr(graph, "writers_of", lambda _, wire: found if "depth" in wire.topic_name else [])
    driven = Driven(lockstep=False)
    node = driven.node
    node._beat.halt()
    monkeypatch.setattr(node.wires.health, "publish", lambda *given, **more: said.append((given[0], more)))
    driven.be()
    driven.look()
    node._step()
    words = f"2 nodes publish {CAMERA_DEPTH.name}, and only one may: /cubesat_8/camera, /cubesat_8/camera"
    assert node.guard.flags.contested == words
    assert driven.sent[-1].tolist() == [0.0] * 8
    assert {level for level, _ in said} == {"warn"}
    assert said[-1][1]["warnings"] == [words]
    found.clear()
    monkeypatch.setattr(node._writer_watch, "look", lambda _now, look=node._writer_watch.look: look(1 << 62))
    driven.be()
    driven.look()
    node._step()
    assert node.guard.flags.contested == ""
    assert driven.sent[-1].tolist() == [0.5] * 8


def test_a_policy_that_sees_does_not_take_over_in_a_node_that_receives_no_images():
    driven = Driven(controller=Blind)
    driven.node._loader._make = lambda *_: OpensByDepth()
    with pytest.raises(BundleError, match="'other' takes camera_depth, which this node does not receive"):
        driven.node._load(read_request("other"))
