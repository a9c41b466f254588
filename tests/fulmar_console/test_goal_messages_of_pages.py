"""Goals as a page sends them become the message of the task's topic, or are refused in words."""

from __future__ import annotations

import math

import pytest

from fulmar_bags.message_reader import goal_of, stamp_ns
from fulmar_console.live.goals import KINDS, message_of, targets_of
from fulmar_core.wires.robot_name import frames_of

POSE = [1.0, -2.0, 0.5, 0.0, 0.0, 2.0, 0.0]  # its quaternion is not normalised
FRAMES = frames_of("alpha", "floating_platform")


@pytest.mark.parametrize("topic", KINDS)
def test_a_controller_reads_what_the_page_has_sent(topic: str) -> None:
    targets = [[0.3, 0.0, 0.0, 0.0, 0.0, 0.1]] if topic == "goal_velocity" else [POSE]
    message = message_of(topic, targets, 1_000_000_007, FRAMES)
    assert stamp_ns(message.header.stamp) == 1_000_000_007
    read, problem = goal_of(message, FRAMES)
    assert problem == ""
    wanted = {"goal_velocity": targets[0], "goal_point": [*POSE[:3], 0, 0, 0, 1]}.get(
        topic, [*POSE[:5], 1.0, 0.0]
    )
    assert read[0].tolist() == pytest.approx(wanted)


def test_a_path_keeps_the_order_of_its_targets() -> None:
    targets = [[float(i), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0] for i in range(5)]
    read, _ = goal_of(message_of("goal_path", targets, 1, FRAMES), FRAMES)
    assert read[:, 0].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]


@pytest.mark.parametrize(
    ("topic", "targets", "words"),
    [
        ("goal_pose", [[0.0] * 6], "has 7 numbers"),
        ("goal_velocity", [POSE], "has 6 numbers"),
        ("goal_pose", [POSE, POSE], "one target, not 2"),
        ("goal_pose", [[1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0]], "quaternion"),
        ("goal_path", [POSE, [0.0] * 7], "quaternion"),
    ],
)
def test_a_goal_that_does_not_fit_its_topic_is_refused(
    topic: str, targets: list[list[float]], words: str
) -> None:
    refused = message_of(topic, targets, 1, FRAMES)
    assert isinstance(refused, str)
    assert words in refused


@pytest.mark.parametrize(
    "command",
    [
        {},
        {"targets": []},
        {"targets": "home"},
        {"targets": [[1.0, 2.0]]},
        {"targets": [[1.0, 2.0, 0.0, 0.0, 0.0, 0.0, True]]},
        {"targets": [[1.0, 2.0, 0.0, 0.0, 0.0, 0.0, "1"]]},
        {"targets": [POSE] * 1001},
        {"targets": [[10**400, *POSE[1:]]]},
        {"velocity": 3},
    ],
)
def test_targets_that_are_none_are_refused_in_words(command: dict) -> None:
    assert isinstance(targets_of(command), str)


def test_targets_may_be_whole_numbers() -> None:
    targets = targets_of({"targets": [[1, 2, 0, 0, 0, 0, 1]]})
    assert targets == [[1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0]]
    assert all(math.isfinite(each) for each in targets[0])
