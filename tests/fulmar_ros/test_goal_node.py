"""What the goal node says and when it ends, with odometry and a clock in the test's hand: nothing waits."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from nav_msgs.msg import Odometry
from rclpy.signals import SignalHandlerOptions

from fulmar_bags.message_reader import stamp_ns
from fulmar_core.config.errors import DONE, FAILED, ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks.goal_files import GoalFile, single_goal
from fulmar_ros.convert import OdometryWriter
from fulmar_ros.goal_node import GoalNode
from fulmar_ros.qos import publish_patiently
from tests.conftest import RosDomain
from tests.states import planar_state

MS = 1_000_000
Spoil = Callable[[Odometry], None]
VELOCITIES = """
kind: velocities
title: ahead, then turning
velocities:
  - { velocity: [0.3, 0.0, 0.0], hold_s: 0.4 }
  - { velocity: [0.0, 0.0, 90.0], hold_s: 0.4 }
"""
LONG = VELOCITIES.replace("hold_s: 0.4", "hold_s: 30.0")
POSITIONS = """
kind: positions
title: here, then there
positions: [[1.0, 0.0], [1.0, 1.0]]
"""
LINE = """
kind: path
title: a wave ahead
path: { kind: sine, length: 4.0, amplitude: 0.1, cycles: 1 }
speed: 0.25
look_ahead: 0.2
"""


class Bench:
    """A goal node that nobody serves: its callbacks are called here, and what it publishes is kept."""

    def __init__(
        self, clock: SimpleNamespace, robot: str, goals: GoalFile | None, parameters: dict[str, object]
    ) -> None:
        arguments = ["--ros-args", "-r", f"__ns:=/{robot}", "-p", f"robot:={robot}"]
        arguments += [word for key, value in parameters.items() for word in ("-p", f"{key}:={value}")]
        self.codes: list[int] = []
        self.sent: list[Any] = []
        self.listened_to = {
            "goal_pose",
            "goal_point",
            "goal_path",
            "goal_velocity",
        }  # topics with a controller
        self.stamp_ns = 1_000 * MS
        self._clock, self._writer = clock, OdometryWriter(load_robot(robot).sensors.odometry)
        self.node: Any = GoalNode(self.codes.append, goals=goals, cli_args=arguments)
        self.publish = self.node._publish
        self.node._publish = lambda _publisher, message: self.sent.append(message)
        self.node.get_subscriptions_info_by_topic = self._subscribers

    def _subscribers(self, topic: str) -> list[SimpleNamespace]:
        """A recorder subscribes everything."""
        controllers = [topic.rsplit("/", 1)[-1]] if topic.rsplit("/", 1)[-1] in self.listened_to else []
        return [SimpleNamespace(node_name=name) for name in ("recorder", *controllers)]

    def watch(self, seconds: float) -> None:
        """Let time pass without odometry, with the looks of the node's timer."""
        for _ in range(round(seconds / 0.1)):
            self._clock.now_s += 0.1
            self.stamp_ns += 100 * MS
            self.node._watch()

    def see(
        self, times: int, *, x: float = 0.0, y: float = 0.0, spoil: Spoil = lambda _message: None
    ) -> None:
        """Odometry at 50 Hz, with the looks of the node's timer between it."""
        for count in range(times):
            self.stamp_ns += 20 * MS
            self._clock.now_s += 0.02
            message = self._writer.write(planar_state(x, y, 0.0), self.stamp_ns)
            spoil(message)
            self.node._on_odometry(message)
            if count % 5 == 4:
                self.node._watch()

    def refuse(self, reason: str, *, later_ns: int = 0) -> None:
        """The controller's status about the newest goal, or about another one."""
        stamp = str(stamp_ns(self.sent[-1].header.stamp) + later_ns)
        values = [KeyValue(key="goal_refused", value=reason)]
        values.append(KeyValue(key="goal_refused_stamp_ns", value=stamp))
        self.node._on_status(DiagnosticArray(status=[DiagnosticStatus(values=values)]))

    @property
    def moves(self) -> list[tuple[float, float, float]]:
        """Velocities as numbers."""
        twists = [message.twist for message in self.sent]
        return [(t.linear.x, t.linear.y, t.angular.z) for t in twists]


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """The node's steady clock, in the test's hand."""
    made = SimpleNamespace(now_s=100.0)
    monkeypatch.setattr("fulmar_ros.goal_node.time", SimpleNamespace(monotonic=lambda: made.now_s))
    return made


@pytest.fixture
def make(ros_domain: RosDomain, tmp_path: Path, clock: SimpleNamespace) -> Iterator[Callable[..., Bench]]:
    """Makes goal nodes of a file's text, or of one place."""
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    made: list[Bench] = []

    def begin(
        what: str | tuple[float, ...], *, robot: str = "floating_platform", **parameters: object
    ) -> Bench:
        if isinstance(what, str):
            (tmp_path / "mine.yaml").write_text(what)
            goals, parameters = None, {"goals": tmp_path / "mine.yaml", **parameters}
        else:
            goals = single_goal(what, load_robot(robot).state_type)
        made.append(Bench(clock, robot, goals, parameters))
        return made[-1]

    yield begin
    for bench in made:
        bench.node.destroy_node()
    rclpy.try_shutdown()


def error_line(capfd: pytest.CaptureFixture[str]) -> str:
    (line,) = [line for line in capfd.readouterr().err.splitlines() if "ERROR" in line]
    return line


def test_velocities_come_by_the_odometry_s_clock_and_end_in_standstill(make) -> None:
    """Twenty milliseconds a message, whatever the wall clock says."""
    bench = make(VELOCITIES)
    bench.see(60)
    assert bench.moves == [(0.3, 0.0, 0.0), (0.0, 0.0, pytest.approx(math.pi / 2)), (0.0, 0.0, 0.0)]
    first, second, last = (stamp_ns(message.header.stamp) for message in bench.sent)
    assert (second - first, last - first) == (400 * MS, 800 * MS)
    assert {message.header.frame_id for message in bench.sent} == {"base_link"}
    assert bench.codes == [DONE]


def test_positions_come_when_the_one_before_is_reached_and_each_once(make) -> None:
    bench = make(POSITIONS)
    bench.see(20)
    bench.see(70, x=1.0)
    assert [(m.point.x, m.point.y) for m in bench.sent] == [(1.0, 0.0), (1.0, 1.0)]
    assert bench.codes == []
    bench.see(500, x=1.0, y=1.0)
    assert len(bench.sent) == 2
    assert bench.codes == [DONE]


def test_as_a_path_all_positions_come_in_one_message(make) -> None:
    """For tasks that pass through them."""
    bench = make(POSITIONS, as_path="true")
    bench.see(1)
    (path,) = bench.sent
    assert [(p.pose.position.x, p.pose.position.y) for p in path.poses] == [(1.0, 0.0), (1.0, 1.0)]


def test_along_a_path_velocities_come_at_the_rate_that_was_asked_for(make) -> None:
    """Steered for a robot that cannot move sideways."""

    def drift(message: Odometry) -> None:
        message.pose.pose.position.y = 1e-10 * stamp_ns(message.header.stamp)

    bench = make(LINE, robot="turtlebot2", control_hz=5.0)
    bench.see(40, spoil=drift)
    stamps = [stamp_ns(message.header.stamp) for message in bench.sent]
    assert [b - a for a, b in itertools.pairwise(stamps)] == [200 * MS] * 3
    assert all(ahead == pytest.approx(0.25) and left == 0.0 for ahead, left, _ in bench.moves)


def test_silence_of_the_odometry_becomes_standstill_and_its_return_goes_on(make) -> None:
    """The time of silence does not count."""
    bench = make(VELOCITIES)
    bench.see(5)
    bench.watch(0.4)
    assert len(bench.sent) == 1
    bench.watch(0.2)
    assert bench.moves[1] == (0.0, 0.0, 0.0)
    bench.watch(5.0)
    assert len(bench.sent) == 2
    bench.see(6)  # the next goal comes after a period
    assert bench.moves[2] == bench.moves[0]
    assert bench.codes == []


def test_unbelievable_odometry_counts_as_silence(make) -> None:
    """As for a controller."""

    def spoil(message: Odometry) -> None:
        message.header.frame_id = "map"

    bench = make(LONG)
    bench.see(5)
    bench.see(35, spoil=spoil)
    assert len(bench.sent) == 2
    assert not any(bench.moves[1])


def test_whoever_stops_the_node_stops_the_robot(make) -> None:
    """Ctrl-C in the middle of a velocity."""
    bench = make(LONG)
    bench.see(5)
    bench.node.stop()
    assert len(bench.sent) == 2
    assert not any(bench.moves[1])


def test_a_file_that_is_wrong_is_named(make) -> None:
    with pytest.raises(ConfigError, match=r"mine\.yaml"):
        make("kind: dances\ntitle: no\n")


def test_without_a_robot_or_a_controller_the_node_ends_if_it_shall_not_wait(make, capfd) -> None:
    impatient, patient = make(POSITIONS, give_up_s=0.5), make(POSITIONS)
    for bench in (impatient, patient):
        bench.watch(0.6)
    assert (impatient.codes, patient.codes) == ([FAILED], [])
    assert "nothing comes on /floating_platform/odom (after 0.5 s)" in error_line(capfd)
    alone = make(POSITIONS, give_up_s=0.5)
    alone.listened_to = set()
    alone.see(40)
    assert alone.codes == [FAILED]
    assert "no controller subscribes /floating_platform/goal_point" in error_line(capfd)


@pytest.mark.parametrize("gone", ["robot", "controller"])
def test_goals_end_with_one_line_when_their_robot_or_its_controller_went_silent(
    make, gone: str, capfd
) -> None:
    bench = make(POSITIONS, give_up_s=0.5)
    bench.see(100)
    assert bench.codes == []
    if gone == "controller":
        bench.listened_to = set()
        bench.see(40)
    else:
        bench.watch(0.7)
    assert bench.codes == [FAILED]
    missing = {
        "robot": "the robot went silent: nothing comes on /floating_platform/odom",
        "controller": "no controller subscribes /floating_platform/goal_point any more",
    }
    line = error_line(capfd)
    assert f"{missing[gone]} (for 0.5 s)" in line and "fulmar goals --wait" in line


@pytest.mark.parametrize(
    "reason", ["out of bounds: it lies outside", "goal is 9 m away, beyond the geofence of 8 m"]
)
def test_a_goal_that_can_never_be_followed_ends_the_node_with_one_line(make, reason: str, capfd) -> None:
    bench = make((1.0, 3.0, 90.0))
    bench.see(5)
    bench.refuse(reason, later_ns=1)  # of another goal
    bench.refuse("e-stop: pressed")  # which passes
    assert bench.codes == []
    capfd.readouterr()
    bench.refuse(reason)
    assert f"the controller refuses the goal: {reason}" in error_line(capfd)
    assert bench.codes == [FAILED]


TAKEN = [
    ("turtlebot2", (1.0, 2.0, 90.0), "goal_velocity", "a file of velocities or of a path"),
    ("turtlebot2", (1.0, 2.0, 90.0), "goal_path", "a file of positions or poses, and --as-path"),
    ("spacecraft_16", (0.0, 0.0, 0.0), "goal_pose", "--pose x,y,z,roll,pitch,yaw or a file of poses"),
    ("spacecraft_16", (0.0,) * 6, "goal_point", "--position x,y,z or a file of positions"),
    ("floating_platform", (0.0, 0.0), "goal_pose", "--pose x,y,deg or a file of poses"),
    ("floating_platform", (0.0, 0.0, 0.0), "goal_point", "--position x,y or a file of positions"),
]


@pytest.mark.parametrize(("robot", "place", "taken", "advice"), TAKEN)
def test_a_place_for_a_controller_of_other_goals_is_neither_published_nor_reached_and_ends_with_one_line(
    make, robot: str, place: tuple[float, ...], taken: str, advice: str, capfd
) -> None:
    """Also where the robot is at the place already."""
    bench = make(place, robot=robot, give_up_s=1.0)
    bench.listened_to = {taken}
    bench.see(60)
    assert bench.sent == []
    assert bench.codes == [FAILED]
    said = capfd.readouterr().err
    (line,) = [line for line in said.splitlines() if "ERROR" in line]
    assert "no controller subscribes" in line
    assert f"(after 1 s). The one that runs takes {taken}: give {advice}." in line
    assert "published" not in said and "reached" not in said


def test_goals_wait_for_a_controller_that_starts_after_them(make) -> None:
    """Their time begins then; a recorder does not count as a subscriber."""
    bench = make(VELOCITIES)
    bench.listened_to = set()
    bench.see(100)
    assert (bench.sent, bench.codes) == ([], [])
    bench.listened_to = {"goal_velocity"}
    bench.see(60)
    first, second, _ = (stamp_ns(message.header.stamp) for message in bench.sent)
    assert second - first == 400 * MS
    assert bench.codes == [DONE]


def test_in_lock_step_a_goal_comes_with_each_odometry_and_none_is_overwritten(make) -> None:
    """Also with odometry that is refused: others wait for its stamp."""
    bench = make(VELOCITIES, lockstep="true")
    bench.see(3)
    bench.see(1, x=float("nan"))
    assert [stamp_ns(message.header.stamp) for message in bench.sent] == [
        (1_000 + 20 * n) * MS for n in range(1, 5)
    ]
    assert bench.moves == [(0.3, 0.0, 0.0)] * 4
    assert bench.publish is publish_patiently
