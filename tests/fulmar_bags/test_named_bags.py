"""Bags of a robot with a name of its own: every reader finds its topics and frames by the name."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from fulmar_bags.bag_reading import BagReading
from fulmar_bags.comparison import differing
from fulmar_bags.contents import open_bag
from fulmar_bags.control_steps import control_steps_of
from fulmar_bags.decode import messages
from fulmar_bags.gathered import Topic
from fulmar_bags.message_types import type_store
from fulmar_bags.run_record import read_any_run, read_run
from fulmar_bags.writer import BagWriter
from fulmar_core.robots.topics import DIAGNOSTICS, ODOMETRY, STATUS
from tests.fulmar_cli.bag_commands import LQR, answer, ask

ROBOT = "floating_platform"


def named(topic: Topic) -> list[bytes]:
    """The messages as a robot of the name alpha sends them."""
    found = []
    for _, message in messages(topic):
        if hasattr(message, "header") and message.header.frame_id:
            message.header.frame_id = f"alpha/{message.header.frame_id}"
        if hasattr(message, "child_frame_id"):
            message.child_frame_id = f"alpha/{message.child_frame_id}"
        found.append(bytes(type_store().serialize_cdr(message, topic.type)))
    return found


@pytest.fixture
def alpha(tmp_path: Path) -> Path:
    """The reference bag of the LQR, as of a robot with a name."""
    bag = open_bag(LQR)
    writer = BagWriter(tmp_path / "alpha", run_info={**(bag.info or {}), "name": "alpha"})
    every = []
    for name, topic in bag.topics.items():
        renamed = name.replace(f"/{ROBOT}/", "/alpha/")
        writer.add_topic(renamed, topic.type, "stream")
        every += [(log, renamed, data) for log, data in zip(topic.log_ns, named(topic), strict=True)]
    for log_ns, renamed, data in sorted(every, key=lambda each: each[0]):
        writer.write(renamed, data, log_ns=log_ns)
    writer.close()
    return tmp_path / "alpha"


def test_a_bag_without_a_name_is_of_a_robot_that_is_called_as_its_type():
    bag = open_bag(LQR)
    assert (bag.name, bag.topic_name(ODOMETRY)) == (ROBOT, f"/{ROBOT}/odom")


def test_topics_and_frames_are_found_by_the_name(alpha: Path):
    bag, plain = open_bag(alpha), open_bag(LQR)
    assert (bag.robot, bag.name, bag.odometry().name) == (ROBOT, "alpha", "/alpha/odom")
    steps, usual = control_steps_of(bag), control_steps_of(plain)
    assert steps.odometry.frame[0] == "odom"
    assert len(steps.goals) == len(usual.goals) > 0
    record = read_run(alpha)
    assert not record.warnings
    assert len(record.goals) == len(read_run(LQR).goals)


def test_info_rerun_and_diff_take_it_as_they_take_any_other(alpha: Path):
    assert answer("info", alpha)["provenance"]["name"] == "alpha"
    assert answer("info", LQR)["provenance"]["name"] == ROBOT
    for source in ("observations", "odometry"):
        asked = ("--from", source, "--tolerance", "1e-9")
        assert ask("rerun", alpha, *asked).exit_code == 0
    found = answer("diff", alpha, LQR)
    assert (found["same"], found["provenance"]) == (True, {"name": ["alpha", ROBOT]})
    assert answer("diff", alpha, LQR, "--topic", "/alpha/odom")["topics"][0]["topic"] == "odom"


def test_a_name_that_only_the_topics_know_makes_the_frames_known(alpha: Path):
    """As in a bag of `ros2 bag record`."""
    bag = replace(open_bag(alpha), info=None)
    assert bag.frames.plain("alpha/odom") == "odom"
    assert differing(bag, bag)["same"]
    assert not read_any_run(alpha, BagReading(task="go_to_pose")).warnings


def test_what_another_robot_says_of_itself_is_not_taken_for_the_own(tmp_path: Path):
    """Robots of one domain share /diagnostics."""
    store = type_store()
    writer = BagWriter(tmp_path / "bag", run_info={"robot": ROBOT, "name": "alpha", "task": "go_to_pose"})
    kind = DIAGNOSTICS.type
    make = store.types
    header = make["std_msgs/msg/Header"](make["builtin_interfaces/msg/Time"](1, 0), "")
    for topic in ("/diagnostics", f"/alpha/{STATUS.name}", "/alpha/odom"):
        writer.add_topic(topic, ODOMETRY.type if topic.endswith("odom") else kind, "stream")
    for number, name in enumerate(("alpha", "beta")):
        status = make["diagnostic_msgs/msg/DiagnosticStatus"](0, f"{name}: plant", name, "", [])
        message = make[kind](header, [status])
        writer.write("/diagnostics", bytes(store.serialize_cdr(message, kind)), log_ns=number + 1)
    writer.close()
    record = read_run(tmp_path / "bag")
    assert record.last_health("plant").message == "alpha"
    assert len(record.health) == 1


def test_a_topic_beside_the_robot_s_own_is_compared_by_its_whole_name(tmp_path: Path):
    bags = []
    for robot, topics in (("a", ("/a/x", "/b/y")), ("b", ("/b/x",))):
        bag = BagWriter(tmp_path / robot, run_info={"robot": robot, "name": robot})
        for topic in topics:
            bag.add_topic(topic, "std_msgs/msg/Bool", "stream")
            bag.write(topic, b"\x00\x01\x00\x00\x01", log_ns=1)
        bag.close()
        bags.append(open_bag(tmp_path / robot))
    found = {each["topic"]: each["counts"] for each in differing(*bags)["topics"]}
    assert found == {"x": [1, 1], "/b/y": [1, 0]}
