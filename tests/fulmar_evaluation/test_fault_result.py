"""What counts as noticed, and what counts as an intact bag."""

from __future__ import annotations

import json
import math
import time
from dataclasses import asdict
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import numpy as np
import pytest

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import stamps_ns
from fulmar_core.robots.topics import ODOMETRY
from fulmar_evaluation.faults.fault import stopped
from fulmar_evaluation.faults.fault_environment import plan_of
from fulmar_evaluation.faults.live_system import LiveSystem
from fulmar_evaluation.faults.observer import HealthStatus, bag_evidence, first_problem

BAG = Path(__file__).parents[1] / "replay/bags/floating_platform_go_to_pose_lqr"
FAULT_S = 100.0


def word(received_s: float, text: str, who: str = "plant") -> HealthStatus:
    return HealthStatus(received_s, who, "ok" if text == "running" else "error", text, {})


def test_what_was_wrong_before_a_fault_is_not_noticed_by_it_whatever_its_figures():
    standing = [word(99.5, "3 commands refused"), word(100.5, "4 commands refused")]
    assert first_problem(standing, FAULT_S) is None
    found = first_problem([*standing, word(100.6, "no command for 400 ms")], FAULT_S)
    assert found is not None
    assert found.text == "no command for 400 ms"


def test_the_same_words_of_another_node_or_after_good_ones_are_new():
    assert first_problem([word(99.5, "stale", "estimator"), word(100.5, "stale")], FAULT_S) is not None
    again = [word(99.0, "stale"), word(99.5, "running"), word(100.5, "stale")]
    assert first_problem(again, FAULT_S) is not None


@pytest.mark.parametrize("robot", ["floating_platform", "turtlebot2", "kingfisher"])
@pytest.mark.parametrize("late_s", [-0.01, 0.01])
def test_whether_a_robot_stopped_in_time_can_be_reported_in_json(robot: str, late_s: float, tmp_path: Path):
    live = LiveSystem(plan_of(robot, tmp_path / "bag"), MagicMock(), MagicMock())
    since_s = time.monotonic() - 10.0
    at_s = since_s + live.silenced_s + late_s
    live.observer = MagicMock(
        applied_since=lambda _: [(at_s - 0.02, True), (at_s, False)],
        problem_since=lambda _: word(at_s, "no command"),
    )
    reported = json.loads(json.dumps(asdict(stopped(live, since_s, live.silenced_s))))
    assert reported["passed"] is (late_s < 0.0)


@pytest.fixture(scope="module")
def stamps() -> np.ndarray:
    found = stamps_ns(open_bag(BAG).of(ODOMETRY))
    assert found is not None
    return np.sort(found)


def received(stamps: np.ndarray) -> SimpleNamespace:
    """A bystander who received one message a second, from 0 s on."""
    times = np.arange(len(stamps), dtype=float)
    return SimpleNamespace(wire=ODOMETRY, received=lambda: (times, stamps))


def with_one_more(stamps: np.ndarray, at: int) -> np.ndarray:
    return np.insert(stamps, at, (stamps[at - 1] + stamps[at]) // 2)


def test_a_bag_with_everything_that_was_received_is_intact(stamps):
    kept = bag_evidence(BAG, received(stamps), None)
    assert (kept.lost, kept.intact, kept.words) == (0, True, "")


def test_a_message_that_is_missing_is_a_gap_unless_the_recorder_was_kept_from_it(stamps):
    observer = received(with_one_more(stamps, 10))
    kept = bag_evidence(BAG, observer, None)
    assert (kept.lost, kept.intact) == (1, False)
    assert "lacks 1 of odom" in kept.words
    hung = bag_evidence(BAG, observer, (9.0, 11.0))
    assert (hung.lost, hung.intact) == (1, True)
    assert not bag_evidence(BAG, observer, (11.0, 13.0)).intact


def test_a_recorder_that_died_may_take_its_last_second_along_and_no_more(stamps):
    observer = received(with_one_more(stamps, 10))
    assert bag_evidence(BAG, observer, (10.5, math.inf)).intact
    assert not bag_evidence(BAG, observer, (12.5, math.inf)).intact
    before = bag_evidence(BAG, observer, (5.0, math.inf))
    assert (before.lost, before.intact) == (0, True)


def test_a_bag_that_does_not_open_is_lost_as_a_whole(stamps, tmp_path):
    kept = bag_evidence(tmp_path, received(stamps), None)
    assert (kept.lost, kept.intact) == (len(stamps), False)
    assert str(tmp_path) in kept.words


def test_a_recorder_that_was_started_again_may_lack_what_came_meanwhile_and_a_second_before(stamps):
    observer = received(with_one_more(stamps, 10))
    assert bag_evidence(BAG, observer, (10.5, 12.0), again=True).intact
    assert not bag_evidence(BAG, observer, (12.5, 14.0), again=True).intact
