"""What the envelope guard would have done in a recorded run.

The recorded commands go through the guarded loop of the controller node once more, with the guard: each step begins
from what was recorded, whatever the guard sent before. So a trip says that the backup would have taken over then; what
comes after it is the record's, not what the backup would have made of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fulmar_bags.contents import Bag
from fulmar_bags.control_steps import ControlSteps, control_steps_of
from fulmar_bags.envelope_events import envelope_events
from fulmar_core.config.errors import BagError, ConfigError
from fulmar_core.controllers.controller import Inputs, StateObserver
from fulmar_core.estimators.actuator_health.filters import HealthSettings
from fulmar_core.loop.controller_settings import ENVELOPE
from fulmar_core.loop.envelope import check_guard, envelope_of
from fulmar_core.safety.geofence import NO_AREA, check_area_of
from fulmar_evaluation.guard_figures import trips_of
from fulmar_evaluation.rerun.embedded_configs import calibrated_as, knowing_what_it_carries
from fulmar_evaluation.rerun.rerun import rerun


class Recorded:
    """A controller that says what was recorded.

    Attributes:
        name: See `Controller`.
        control_hz: See `Controller`.
        estimator: See `Controller`.
        observer: See `Controller`.
        readings: See `Controller`.
    """

    name = "recorded"
    estimator: HealthSettings | None = None
    observer: StateObserver[Any] | None = None
    readings: tuple[str, ...] = ()

    def __init__(self, record: ControlSteps) -> None:
        """Take the commands of a run; the safe one where none is known."""
        self.control_hz = record.settings.control_rate(record.robot)
        safe = np.asarray(record.robot.actuators.safe_command, dtype=float)
        known = np.isfinite(record.commands).all(axis=1)
        self._commands = {
            int(stamp): np.asarray(command if there else safe, dtype=float)
            for stamp, command, there in zip(record.stamp_ns, record.commands, known, strict=True)
        }
        self._safe = safe

    def reset(self) -> None:
        """Nothing to forget."""

    def act(self, inputs: Inputs) -> np.ndarray:
        """The command that answered a measurement, shape (1, m)."""
        return self._commands.get(inputs.stamp_ns, self._safe)[None]

    def metadata(self) -> dict[str, Any]:
        """Its name."""
        return {"controller": self.name}


@dataclass(frozen=True)
class ReplayRequest:
    """What the guard keeps; empty or None where the bag decides."""

    area: tuple[float, ...] = NO_AREA  # sides in the form of `check_area` [m]
    robot: str | None = None
    task: str | None = None


def replay_guard(bag: Bag, asked: ReplayRequest) -> dict[str, Any]:
    """Let the envelope guard watch a recorded run.

    Returns:
        `bag`, `robot`, `task`, `steps`, the `area`; `trips` and `backup_share` as in the result of a run, of what it
        would have done; `beyond_m`, how far the robot came beyond its area in the record, None without one; and
        `recorded_trips`, those of the guard that the run had.

    Raises:
        BagError: The bag holds no odometry or no commands, or no goal.
        ConfigError: No such guard is there for its robot, or the area is none of such a robot.
    """
    with knowing_what_it_carries(bag), calibrated_as(bag):
        record = control_steps_of(bag, robot=asked.robot, task=asked.task)
        check_guard(record.robot)
        area = asked.area if asked.area != NO_AREA else tuple(record.settings.area)
        check_area_of(record.robot, area)
        if not np.isfinite(record.commands).all(axis=1).any():
            raise BagError(f"{bag.path}: holds no commands, which the guard would have to check.")
        guard = envelope_of(record.robot, replace(record.settings, guard=ENVELOPE, area=area))
        answers = rerun(record, Recorded(record), source="odometry", envelope=guard)
    stamps = record.stamp_ns / 1e9
    recorded = envelope_events(bag)
    return {
        "bag": str(bag.path),
        "robot": record.robot.name,
        "task": record.task.name,
        "steps": len(record),
        "area": None if area == NO_AREA else list(area),
        **trips_of(answers.trips or (), float(stamps[0]), float(stamps[-1])),
        "beyond_m": _beyond(record, area),
        "recorded_trips": sum(event.tripped for event in recorded),
    }


def _beyond(record: ControlSteps, area: Sequence[float]) -> float | None:
    """How far a robot came beyond the sides of its area, negative inside; None without one [m]."""
    if tuple(area) == NO_AREA or not len(record.odometry):
        return None
    low, high = np.array(area[0::2]), np.array(area[1::2])
    place = record.odometry.pose[:, : len(low)]
    return float(np.maximum(low - place, place - high).max())


def replay_guards(bags: Sequence[Bag], asked: ReplayRequest) -> dict[str, Any]:
    """Let the envelope guard watch several runs of one robot.

    Returns:
        `bags`, each as `replay_guard` returns it, and over all of them `runs_with_trip`, `trips` and `backup_share`.

    Raises:
        BagError: As `replay_guard`.
        ConfigError: As `replay_guard`, or the bags are of several robots.
    """
    found: list[dict[str, Any]] = []
    for bag in bags:
        each = replay_guard(bag, asked)
        if found and each["robot"] != found[0]["robot"]:
            raise ConfigError(
                f"{each['bag']} is of '{each['robot']}', {found[0]['bag']} of '{found[0]['robot']}'. "
                "Replay the bags of one robot at a time."
            )
        found.append(each)
    steps = sum(each["steps"] for each in found)
    held = sum(each["backup_share"] * each["steps"] for each in found)
    return {
        "bags": found,
        "runs_with_trip": sum(bool(each["trips"]) for each in found),
        "trips": sum(len(each["trips"]) for each in found),
        "backup_share": held / steps if steps else 0.0,
    }


def replay_text(found: dict[str, Any]) -> list[str]:
    """The same in lines for people."""
    lines = []
    for each in found["bags"]:
        trips, beyond = each["trips"], each["beyond_m"]
        left = f"; it came {beyond:.2f} m beyond its area" if beyond is not None and beyond > 0.0 else ""
        if trips:
            count, first = len(trips), trips[0]
            often = f"{count} time{'s' if count > 1 else ''}, {each['backup_share']:.1%} of the time"
            said = f"would have taken over {often}; first after {first['t_s']:.1f} s: {first['cause']}"
        else:
            said = "would have left its controller alone"
        lines.append(f"{each['bag']}: {each['steps']} steps; the envelope guard {said}{left}")
    count = len(found["bags"])
    lines.append(
        f"{found['runs_with_trip']} of {count} run{'s' if count != 1 else ''} with a trip, {found['trips']} in all, "
        f"{found['backup_share']:.1%} of the time"
    )
    return lines
