"""Lock step without an answer: the error says what came in its place."""

from __future__ import annotations

import threading
from types import SimpleNamespace

import numpy as np
import pytest

from fulmar_core.config.errors import LockstepError
from fulmar_core.robots.robot_file import load_robot
from fulmar_ros.plant_clock import SimulatedTime
from fulmar_ros.plant_loops import LockstepLoop

ROBOT = load_robot("turtlebot2")


class Wires:
    """A plant's wires on which commands come with one stamp, or none come."""

    def __init__(self, stamp_ns: int | None) -> None:
        self.lock, self.answered_ns, self._stamp_ns = threading.Condition(), None, stamp_ns

    @property
    def commands(self) -> Wires:
        """What is published and what is received are one object here."""
        return self

    def publish_sample(self, sample: object, time_ns: int) -> None:
        self.answered_ns = self._stamp_ns

    def wait_for_answer(self, time_ns: int, timeout_s: float) -> bool:
        return self.answered_ns == time_ns


@pytest.mark.parametrize(
    ("stamp_ns", "words"),
    [
        (None, "the controller is silent. Look at its output."),
        (0, "the last command is stamped t = 0.00 s. A command answers an odom by its stamp. Look"),
        (7_000_000_000, "the last command is stamped t = 7.00 s."),
    ],
)
def test_commands_that_answer_another_stamp_are_named(stamp_ns: int | None, words: str) -> None:
    backend = SimpleNamespace(robot=ROBOT)
    guard = SimpleNamespace(last_rejection="")
    loop = LockstepLoop(
        backend, Wires(stamp_ns), guard, SimulatedTime(), control_hz=10.0, answer_timeout_s=0.0
    )
    with pytest.raises(LockstepError) as caught:
        loop.run(None, 1, threading.Event())
    assert words in str(caught.value)


def test_without_air_what_is_applied_is_the_safe_command() -> None:
    platform, applied = load_robot("floating_platform"), []
    wires = Wires(0)
    wires.publish_applied = lambda command, time_ns: applied.append(command)
    wires.publish_truth = lambda *_: None
    sample = SimpleNamespace(odometry=None)
    backend = SimpleNamespace(
        robot=platform, bearing_on=False, set_bearing=lambda on: "", step=lambda command, ticks: sample
    )
    guard = SimpleNamespace(last_rejection="", answer=lambda *_, **__: np.ones(8))
    loop = LockstepLoop(
        backend,
        wires,
        guard,
        SimulatedTime(0),
        control_hz=10.0,
        answer_timeout_s=1.0,
        publish_bearing=lambda: None,
    )
    loop.run(sample, 1, threading.Event())
    assert not applied[0].any()
