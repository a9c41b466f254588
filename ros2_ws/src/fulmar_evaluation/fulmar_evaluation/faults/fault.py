"""A fault: what is done, to which system, and for whom it has a meaning."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from fulmar_core.robot import Robot
from fulmar_evaluation.faults.fault_environment import USUAL, Surroundings
from fulmar_evaluation.faults.fault_result import Outcome
from fulmar_evaluation.faults.live_system import LiveSystem


def possible(_robot: Robot) -> str:
    """Every robot and every machine can have it."""
    return ""


@dataclass(frozen=True)
class Fault:
    """One line of the suite's table."""

    do: Callable[[LiveSystem], Outcome]
    about: Surroundings = USUAL
    # Why a robot, or this machine, cannot have it; empty if it can.
    why_not: Callable[[Robot], str] = possible
    begins: bool = True  # whether the system is under way when it is done

    @property
    def name(self) -> str:
        """What people call it."""
        return self.do.__name__
