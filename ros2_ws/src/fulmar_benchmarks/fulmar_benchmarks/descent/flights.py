"""Flights whose controller is killed: what they begin with, and figures of how they come down."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.flight_refuge import HOLD_S, SINK
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import Episode, draw_episodes
from fulmar_core.states.attitude import euler_of
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import Task, load_task
from fulmar_core.tasks.follow_reference import FollowReference
from fulmar_core.worlds.scenario import Scenario, load_scenario
from policy_server.controllers import Choice, load_controller, usual_hz

TASK = "fly_hold"
# Simulators stop a craft at touch-down, and one that tumbles; the first within the way of a tick from the ground.
TOUCH_M, STOPPED_M_S = 0.05, 1.0
MOST_BANK_DEG, MOST_SINK = 10.0, 1.0  # until touch-down [deg], at touch-down [m/s]
SHARE = 60 / 64  # of the flights that must keep both
KILLED_S = (4.0, 6.0)  # after the start, drawn for each flight [s]
LATER_S = (
    10.0  # beyond the time that the descent takes by its own law, after which a flight counts as not down [s]
)


@dataclass(frozen=True)
class Flights:
    """Some flights that hold one height until their controller is killed."""

    robot: str
    controller: str
    height: float  # [m]
    count: int
    seed: int
    scenario: str = "nominal"
    policy: str = ""  # folder of a bundle; empty: the shipped one

    @property
    def craft(self) -> Robot:
        """The aircraft.

        Raises:
            ConfigError: The robot is none.
        """
        robot = load_robot(self.robot)
        if robot.kind.rests:
            raise ConfigError(f"'{self.robot}' does not fly: what stops at once needs no descent.")
        return robot

    @property
    def task(self) -> Task:
        """The task: holding the height."""
        task = load_task(TASK)
        assert isinstance(task, FollowReference)
        return replace(task, height=(self.height, self.height))

    @property
    def conditions(self) -> Scenario:
        """The scenario."""
        return load_scenario(self.scenario)

    @property
    def control_hz(self) -> float:
        """Command rate [Hz]."""
        policy = Path(self.policy) if self.policy else None
        return usual_hz(self.controller, self.craft, self.task, policy)

    def check(self) -> None:
        """Refuse what cannot be flown.

        Raises:
            ConfigError: The robot does not fly, starts in the water, or there is no such scenario or controller.
        """
        task = self.task.fitted(self.craft)
        task.check(self.craft)
        load_scenario(self.scenario)
        load_controller(self.controller, self.craft, task, Choice(self.control_hz, self.policy))

    def drawn(self, numbers: np.ndarray) -> Episode:
        """What the flights of some numbers begin with."""
        return draw_episodes(
            self.craft, self.task.fitted(self.craft), self.conditions, seed=self.seed, numbers=numbers
        )

    def killed_s(self, number: int) -> float:
        """When the controller of a flight is killed, after its start [s]."""
        return float(np.random.default_rng((self.seed, number)).uniform(*KILLED_S))

    @property
    def longest_s(self) -> float:
        """Time after the kill in which a flight must be down [s]."""
        return HOLD_S + self.height / SINK + LATER_S


@dataclass(frozen=True)
class Descent:
    """How one flight came down."""

    number: int
    height_m: float | None  # of the wing's origin when the controller was killed
    bank_deg: float  # largest from then to touch-down
    sink_m_s: float | None  # in the last tick before touch-down; None: it never touched down
    seconds: float  # from the kill to touch-down

    @property
    def good(self) -> bool:
        """Whether it touched down, and kept bank and sink."""
        return self.sink_m_s is not None and self.sink_m_s <= MOST_SINK and self.bank_deg <= MOST_BANK_DEG


class DescentLog:
    """Watches one flight from the kill on, by its true states.

    Attributes:
        down: Whether the flight is over: the hull touches the ground, or the craft is lost.
    """

    def __init__(self, robot: Robot, number: int) -> None:
        """Begin at the kill."""
        self._lowest, self._number = robot.hull_span[0], number
        self._height: float | None = None
        self._bank = self._sink = self._seconds = 0.0
        self.down = self._touched = False

    def add(self, state: SpatialState, seconds: float) -> None:
        """Take the true state at a time after the kill [s]; what comes after touch-down does not count."""
        if self.down:
            return
        if self._height is None:
            self._height = float(state.z)
        low = float(state.z) + self._lowest
        stopped = not math.hypot(*(float(part) for part in state.velocity)) > STOPPED_M_S
        self.down = stopped or low <= 0.0
        self._seconds, self._touched = seconds, self.down and low <= TOUCH_M
        if not self.down:
            self._bank = max(self._bank, abs(math.degrees(float(euler_of(state.quat)[0]))))
            self._sink = -float(state.vz)

    def descent(self) -> Descent:
        """What came of it."""
        sink = self._sink if self._touched else None
        return Descent(self._number, self._height, self._bank, sink, self._seconds)
