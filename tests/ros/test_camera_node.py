"""The camera's node: which images it publishes, with which stamps, and that nothing waits for it by the clock."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from copy import deepcopy
from typing import Any

import numpy as np
import pytest
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import CameraInfo, Image, JointState

from fulmar_bags.message_reader import stamp_ns
from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import CAMERA_IMAGES, CAMERA_INFO
from fulmar_ros.convert import stamp_of
from sim_nodes import camera_node
from sim_nodes.camera.renderer import Frames
from sim_nodes.camera_node import CameraNode
from tests.ros.neighbour import NAMESPACE, Neighbour

NS = 1_000_000_000
KINDS = [Image, Image, Image, CameraInfo]


class Drawer:
    """Draws nothing: every pixel of depth has the robot's x. OpenGL stays out of the process of the tests."""

    def __init__(self, camera: Any, *_structures: Any, **_more: Any) -> None:
        self.size, self.closed = (camera.height, camera.width), False

    def render(self, pose: np.ndarray, _blocks: Any) -> Frames:
        depth = np.full(self.size, pose[0], dtype=np.float32)
        return Frames(np.zeros((*self.size, 3), np.uint8), depth, np.full(self.size, 7, np.uint16))

    def close(self) -> None:
        self.closed = True


Make = Callable[..., CameraNode]


@pytest.fixture
def make(neighbour: Neighbour, monkeypatch: pytest.MonkeyPatch) -> Iterator[Make]:
    monkeypatch.setattr(sys, "argv", ["node"])
    monkeypatch.setattr(camera_node, "Renderer", Drawer)
    made: list[CameraNode] = []

    def node(*parameters: str) -> CameraNode:
        given = [word for each in parameters for word in ("-p", each)]
        words = ["--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", "robot:=cubesat_8", *given]
        made.append(CameraNode(lambda _code: None, cli_args=words))
        return made[-1]

    yield node
    for each in made:
        each.destroy_node()
        assert each._renderer.closed  # type: ignore[attr-defined]


def state(time_ns: int, x: float = 1.0, w: float = 1.0) -> Odometry:
    message = Odometry()
    message.header.stamp = stamp_of(time_ns)
    message.pose.pose.position.x, message.pose.pose.orientation.w = x, w
    return message


def published(node: CameraNode, monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, Any]]:
    """What the node publishes by the clock, by topic."""
    found: list[tuple[str, Any]] = []
    for each in (*node._images, node._infos):
        name = each.topic_name.removeprefix(f"{NAMESPACE}/")
        keep = lambda message, name=name: found.append((name, deepcopy(message)))  # noqa: E731
        monkeypatch.setattr(each, "publish", keep)
    return found


def test_by_the_clock_images_come_at_the_camera_s_rate_with_the_stamps_of_states(
    make: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    node = make()
    found = published(node, monkeypatch)
    for k in range(40):
        node._on_truth(state(NS + k * NS // 40, x=float(k)))
    wires = (*CAMERA_IMAGES, CAMERA_INFO)
    assert [name for name, _ in found] == [wire.name for wire in wires] * 10
    stamps = [stamp_ns(message.header.stamp) for _, message in found]
    assert stamps == [NS + k * NS // 10 for k in range(10) for _ in wires]
    frame = f"{NAMESPACE.strip('/')}/camera_optical_frame"  # prefixed, as the robot has a name of its own
    assert {message.header.frame_id for _, message in found} == {frame}
    rgb, depth, ids, info = (message for _, message in found[-4:])
    assert [each.encoding for each in (rgb, depth, ids)] == ["rgb8", "32FC1", "16UC1"]
    assert [each.step for each in (rgb, depth, ids)] == [960, 1280, 640]
    assert np.frombuffer(depth.data, np.float32).reshape(240, 320)[3, 5] == 36.0
    assert np.frombuffer(ids.data, np.uint16)[0] == 7
    assert (info.width, info.height) == (320, 240)
    assert list(info.k) == pytest.approx([160.0, 0.0, 159.5, 0.0, 160.0, 119.5, 0.0, 0.0, 1.0])
    assert list(info.p[:3]) == list(info.k[:3])


def test_in_lock_step_each_period_gets_one_image_of_each_kind_with_its_stamp_and_an_answer(
    make: Make,
) -> None:
    node = make("lockstep:=true")
    answer = node._period
    assert answer is not None
    truth = node.resolve_topic_name("ground_truth/odom")
    for k in range(5):
        time_ns = NS + k * NS // 10
        period = JointState(name=[truth], position=[1.0])
        period.header.stamp = stamp_of(time_ns)
        node._on_truth(state(time_ns))
        node._on_truth(state(time_ns))  # a plant sends it again where an answer is late
        answer._on_period(period)
        images, said = answer._sent[:-1], deserialize_message(answer._sent[-1][1], JointState)
        messages = [deserialize_message(data, kind) for (_, data), kind in zip(images, KINDS, strict=True)]
        assert {stamp_ns(each.header.stamp) for each in (*messages, said)} == {time_ns}
        assert said.header.frame_id == "camera" and list(said.position) == [1.0] * 4


def test_a_state_that_is_none_shows_nothing_and_ends_nothing(
    make: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    node = make()
    found = published(node, monkeypatch)
    for k, (x, w) in enumerate(((np.nan, 1.0), (np.inf, 1.0), (0.0, np.nan), (0.0, 0.0), (0.0, 1.0))):
        node._on_truth(state(NS + k * NS // 10, x, w))
    assert len(found) == 4


def test_images_that_no_state_came_for_are_counted(make: Make) -> None:
    node = make()
    for k in (0, 1, 4):
        node._on_truth(state(NS + k * NS // 10))
    said: list[tuple[Any, ...]] = []
    node._health.publish = lambda *given, **_more: said.append(given)  # type: ignore[method-assign]
    node._report()
    assert said[0][0] == "warn" and said[0][2]["frames"] == "3" and said[0][2]["frames_missed"] == "2"


def test_a_robot_without_a_camera_is_refused(make: Make) -> None:
    assert load_robot("spacecraft_16").sensors.camera is None
    with pytest.raises(ConfigError, match="'spacecraft_16' has no camera"):
        make("robot:=spacecraft_16")


def test_the_node_loads_no_torch_whose_compiler_and_opengl_do_not_live_in_one_process() -> None:
    look = "import sys, sim_nodes.camera_node; print(sorted({'torch', 'triton'} & set(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", look], capture_output=True, text=True, check=True, timeout=60.0
    )
    assert done.stdout.strip() == "[]"
