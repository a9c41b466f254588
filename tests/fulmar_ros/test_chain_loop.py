"""Lock step with nodes between plant and controller: ticks, periods, and who is silent."""

from __future__ import annotations

import threading
from types import SimpleNamespace

import numpy as np
import pytest

from fulmar_core.config.errors import LockstepError
from fulmar_core.robots.robot_file import load_robot
from fulmar_ros.plant_clock import SimulatedTime
from fulmar_ros.plant_loops import ChainLoop

ROBOT = load_robot("turtlebot2")
DT_NS = round(1e9 * ROBOT.timing.physics_dt)
TICKS = ROBOT.timing.substeps(10.0)


class Named(str):
    """A sample that is known by its name, and has no odometry."""

    odometry = None


class Backend:
    robot = ROBOT

    def __init__(self) -> None:
        self.steps: list[tuple[int, int | None]] = []

    def step(self, command: np.ndarray, ticks: int = 1, *, begins: int | None = None) -> str:
        self.steps.append((ticks, begins))
        return Named(f"sample {len(self.steps)}")


class Wires:
    """Wires on which answers come at the second try, or never; a command never, where there is no odometry."""

    def __init__(self, *, silent: tuple[str, ...] = (), answers: bool = True, commands: bool = True) -> None:
        self.lock, self.answered_ns = threading.Condition(), None
        self.log: list[tuple[object, ...]] = []
        self._silent, self._answers, self._commands = silent, answers, commands
        self._tries = 0

    @property
    def commands(self) -> Wires:
        """What is published and what is received are one object here."""
        return self

    def publish_tick(self, sample: object, time_ns: int) -> None:
        self.log.append(("tick", sample, time_ns))

    def publish_period(self, sample: object, time_ns: int) -> None:
        self.log.append(("period", sample, time_ns))
        self._tries = 0

    def repeat_period(self) -> None:
        self.log.append(("repeat",))

    def begin_period(self) -> None:
        self.log.append(("begin",))

    def publish_applied(self, command: object, time_ns: int) -> None:
        self.log.append(("applied", time_ns))

    def publish_truth(self, sample: object, time_ns: int) -> None:
        self.log.append(("truth", sample, time_ns))

    def silent_nodes(self, time_ns: int) -> list[str]:
        return [*self._silent]

    def wait_for_period(self, time_ns: int, timeout_s: float) -> bool:
        self._tries += 1
        if not self._answers or self._tries < 2:
            return False
        if self._commands:
            self.answered_ns = time_ns
        return True


def run(wires: Wires, *, steps: int = 2, timeout_s: float = 10.0) -> tuple[ChainLoop, Backend]:
    backend = Backend()

    def answer(_now_ns, _state, *, plant_ns):
        assert plant_ns == loop._clock.now_ns
        return np.zeros(2)

    guard = SimpleNamespace(last_rejection="", answer=answer)
    loop = ChainLoop(
        backend, wires, guard, SimulatedTime(0), control_hz=10.0, answer_timeout_s=timeout_s
    )  # fmt: skip
    loop.run(Named("sample 0"), steps, threading.Event())
    return loop, backend


def test_each_tick_of_a_period_is_published_and_the_period_repeated_until_all_have_answered():
    wires = Wires()
    loop, backend = run(wires)
    assert backend.steps == 2 * [(1, TICKS), *[(1, 0)] * (TICKS - 1)]
    assert wires.log[:4] == [("period", "sample 0", 0), ("repeat",), ("begin",), ("applied", 0)]
    ticks = [("tick", f"sample {number}", number * DT_NS) for number in range(1, TICKS)]
    end = TICKS * DT_NS
    assert wires.log[4 : 4 + TICKS] == [*ticks, ("period", f"sample {TICKS}", end)]
    assert wires.log[-1] == ("truth", f"sample {2 * TICKS}", 2 * end)
    assert loop.steps == 2


def test_periods_without_a_command_are_no_steps_that_a_bag_must_have():
    loop, backend = run(Wires(commands=False))
    assert (loop.steps, len(backend.steps)) == (0, 2 * TICKS)


@pytest.mark.parametrize(
    ("silent", "words"),
    [
        (("estimator",), r"no answer to the readings up to t = 0.00 s for 0.0 s \(limit 0 s\): estimator is silent"),
        (("camera", "estimator"), "camera, estimator are silent"),
        ((), "no command answers the odom of t = 0.00 s .* the controller is silent"),
    ],
)  # fmt: skip
def test_the_error_names_the_link_that_is_silent(silent: tuple[str, ...], words: str) -> None:
    with pytest.raises(LockstepError, match=words):
        run(Wires(silent=silent, answers=False), timeout_s=0.0)
