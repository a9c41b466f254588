"""Lock step over a link, with a controller that answers at once: when commands act, and what a silence does."""

from __future__ import annotations

import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.safety.watchdog import Watchdog
from fulmar_core.worlds.link import Link
from fulmar_ros.plant_clock import SimulatedTime
from fulmar_ros.plant_link import PlantLink, SentCommand, plant_link
from fulmar_ros.plant_link_loop import LinkLoop

ROBOT = load_robot("floating_platform")
DT = ROBOT.timing.physics_dt
TIMEOUT_S = 0.4
ON = np.ones(8)


class Wires:
    """Those of a plant whose controller opens every valve at once, with each answer; `deaf`: it never answers again."""

    def __init__(self, link: PlantLink, clock: SimulatedTime, guard: ActuatorGuard) -> None:
        self.lock, self.answered_ns, self.answers = threading.Condition(), None, 0
        self._link, self._clock, self._guard = link, clock, guard
        self.applied: list[tuple[int, bool]] = []

    @property
    def commands(self) -> Wires:
        """What is published and what is received are one object here."""
        return self

    @property
    def steady_ns(self) -> int:
        return self._clock.now_ns

    def publish_sample(self, sample: object, time_ns: int) -> None:
        self._link.readings.send((sample, time_ns), time_ns)

    def arrived_readings(self) -> list[tuple[object, int]]:
        return self._link.readings.arrived(self._clock.now_ns)

    def await_answer(self, time_ns: int) -> None:
        self._awaited = time_ns

    def publish_measured(self, sample: object, time_ns: int) -> None:
        self._link.commands.send(SentCommand(ROBOT.actuators.names, ON.tolist(), time_ns), self._clock.now_ns)
        self.answered_ns = time_ns

    def wait_for_answer(self, time_ns: int, timeout_s: float) -> bool:
        return self.answered_ns == time_ns

    def take_arrived(self) -> None:
        for command in self._link.commands.arrived(self._clock.now_ns):
            self.answers += self._guard.offer(
                command.names,
                command.values,
                self.steady_ns,
                stamp_ns=command.stamp_ns,
                plant_ns=self.steady_ns,
            )

    def publish_applied(self, command: np.ndarray, time_ns: int) -> None:
        self.applied.append((time_ns, bool(command.any())))

    def publish_truth(self, *_: object) -> None:
        return


def run(link: Link, steps: int, *, dies_at: int = 10**9) -> tuple[list[bool], Wires, LinkLoop]:
    """Whether valves were open at each tick; from control step `dies_at` on nothing arrives any more."""
    clock = SimulatedTime(0)
    guard = ActuatorGuard(
        ROBOT.actuators, Watchdog(round(TIMEOUT_S * 1e9)), control_dt=0.2, wall_ns=time.monotonic_ns
    )
    there = PlantLink(link)
    there.begin(3)
    wires = Wires(there, clock, guard)
    opened: list[bool] = []

    def step(command: np.ndarray, *, begins: int) -> SimpleNamespace:
        opened.append(bool(command.any()))
        if len(opened) == dies_at * 10:
            wires.publish_sample = lambda *_: None
        return SimpleNamespace(odometry=None)

    backend = SimpleNamespace(robot=ROBOT, step=step)
    loop = LinkLoop(backend, wires, guard, clock, control_hz=5.0, answer_timeout_s=1.0)
    loop.run(SimpleNamespace(odometry=None), steps, threading.Event())
    return opened, wires, loop


def test_a_command_acts_after_the_way_there_and_back() -> None:
    opened, wires, loop = run(Link(delay_s=0.08), 5)
    assert opened.index(True) == 8  # 160 ms at 20 ms a tick, within a control step of 200 ms
    assert all(opened[8:])
    assert wires.applied == [(0, False), (160_000_000, True), *((200_000_000 * n, True) for n in range(1, 5))]
    assert loop.steps == 5


def test_valves_close_by_the_plants_clock_once_no_command_has_come_for_the_watchdogs_time() -> None:
    opened, _, loop = run(Link(delay_s=0.08), 10, dies_at=3)
    last = 2 * 10 + 8  # tick of the last command
    closed = last + round(TIMEOUT_S / DT) + 1
    assert all(opened[last:closed])
    assert not any(opened[closed:])
    assert loop.steps == 3


def test_a_link_that_loses_every_other_message_makes_the_robot_safe_in_between() -> None:
    opened, _, _ = run(Link(loss=0.7), 200)
    assert 0.1 < np.mean(opened) < 0.9
    assert run(Link(loss=0.7), 200)[0] == opened


def test_nodes_between_plant_and_controller_are_refused_in_lock_step_alone() -> None:
    radio = Link(delay_s=0.1)
    with pytest.raises(ConfigError, match="estimator would wait"):
        plant_link(radio, lockstep=True, chain=("estimator",))
    assert plant_link(radio, lockstep=False, chain=("estimator",)) is not None
    assert plant_link(Link(), lockstep=True, chain=("estimator",)) is None
