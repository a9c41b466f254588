"""Identification of one robot from its bags, for `fulmar identify` and `fulmar twin`."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fulmar_bags.bag_reading import AS_IT_IS, BagReading
from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.calibration import Calibration
from fulmar_core.robots.robot import Robot
from fulmar_evaluation.driven_run import driven_run
from fulmar_evaluation.identification.identify import SIGMAS, Identified, Weight, calibration_of, identify
from fulmar_evaluation.identification.model import Known

_NUMBER = r"[0-9]*\.?[0-9]+(?:[eE][-+]?[0-9]+)?"
_QUANTITY = re.compile(rf"(?P<value>{_NUMBER})(?:(?:\+-|±)(?P<error>{_NUMBER}))?(?:\s*(?:kg|N|s|m|kg·m²))?")


@dataclass(frozen=True)
class IdentifiedRobot:
    """What the bags of one robot show of it."""

    robot: Robot  # as its YAML has it
    bags: tuple[str, ...]
    driven_s: float  # of all bags together [s]
    found: Identified
    calibration: Calibration
    warnings: tuple[str, ...]  # of what could not be read, and of what the runs do not show

    def document(self, out: Path | None) -> dict[str, Any]:
        """The result, ready for JSON.

        Args:
            out: Where the calibration was written to; None: nowhere.
        """
        fit = self.found.fit
        return {
            "robot": self.robot.name,
            "bags": list(self.bags),
            "driven_s": round(self.driven_s, 3),
            "scale": self.found.scale,
            "estimates": {
                name: {"value": e.value, "low": e.low, "high": e.high, "unit": e.unit}
                for name, e in fit.estimates.items()
            },
            "untold": list(self.found.undetermined),
            "residuals": dict(zip(self.found.channels, fit.noise, strict=True)),
            "windows": fit.windows,
            "calibration": None if out is None else str(out),
        }


def identify_bags(
    bags: Sequence[Path],
    *,
    known: Sequence[str] = (),
    ballast: Sequence[str] = (),
    reading: BagReading = AS_IT_IS,
) -> IdentifiedRobot:
    """Estimate the quantities of a robot from its bags.

    Args:
        bags: Driven runs of one robot.
        known: Texts such as `mass=5.32+-0.02`.
        ballast: Texts such as `runs/heavy=2.0+-0.005`.
        reading: What the bags do not say themselves.

    Raises:
        BagError: A bag cannot be read.
        ConfigError: A text is none, the bags are of several robots, or they do not show what is asked.
    """
    read = [_read(text, "--known", "mass=5.32+-0.02") for text in known]
    known_values = [Known(name, value, max(error / SIGMAS, 1e-6 * value)) for name, value, error in read]
    loads, ballasts = _loads(bags, ballast)
    runs = [driven_run(bag, reading, load=load) for bag, load in zip(bags, loads, strict=True)]
    lines = [f"{bag}: {line}" for bag, (_, _, said) in zip(bags, runs, strict=True) for line in said]
    names = sorted({robot.name for robot, _, _ in runs})
    if len(names) > 1:
        raise ConfigError(f"the bags are of {', '.join(names)}. Identify one robot at a time.")
    robot = runs[0][0]
    weights = {load: Weight(value, error) for load, (value, error) in ballasts.items()}
    found = identify(robot, [drive for _, drive, _ in runs], known=known_values, ballasts=weights)
    if found.undetermined:
        left = ", ".join(found.undetermined)
        lines.append(f"the runs do not show {left}: left out of the calibration. Drive more briskly.")
    names = [str(bag) for bag in bags]
    calibration = calibration_of(robot, found, names)
    driven_s = sum(drive.duration_s for _, drive, _ in runs)
    return IdentifiedRobot(robot, tuple(names), driven_s, found, calibration, tuple(lines))


def _read(text: str, option: str, example: str) -> tuple[str, float, float]:
    """Read `NAME=VALUE` or `NAME=VALUE+-ERROR`; a name can be a path."""
    name, _, quantity = text.rpartition("=")
    match = _QUANTITY.fullmatch(quantity.strip())
    if not name or match is None or float(match["value"]) <= 0.0:
        raise ConfigError(
            f"{option} {text}: must be a name, '=', a number greater than 0 and, if known, its error. "
            f"Example: {option} {example}"
        )
    return name.strip(), float(match["value"]), float(match["error"] or 0.0)


def _loads(bags: Sequence[Path], ballast: Sequence[str]) -> tuple[list[int], dict[int, tuple[float, float]]]:
    """Number of the ballast of each bag, 0 for none; and mass and error of each ballast."""
    loads, ballasts = [0] * len(bags), {}
    places = {bag.resolve(): i for i, bag in enumerate(bags)}
    for number, text in enumerate(ballast, start=1):
        name, mass, error = _read(text, "--ballast", "runs/heavy=2.0+-0.005")
        place = places.get(Path(name).resolve())
        if place is None:
            raise ConfigError(f"--ballast {text}: '{name}' is none of the bags: {', '.join(map(str, bags))}.")
        if loads[place]:
            raise ConfigError(f"--ballast: '{name}' is named twice; add the masses up.")
        loads[place], ballasts[number] = number, (mass, error)
    if ballasts and all(loads):
        raise ConfigError("--ballast: one run without ballast is needed to compare with.")
    return loads, ballasts
