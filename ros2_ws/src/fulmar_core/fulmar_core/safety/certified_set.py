"""A certified set, as a passport or a file holds it: the conditions inside which a controller succeeds."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_core.config.errors import BundleError, ConfigError, did_you_mean
from fulmar_core.robots.robot import Robot

FORMAT = 1
NEEDED = ("format", "robot", "task", "controller", "axes", "box", "score", "lower_bound", "confidence")
AGAIN = "Certify it again: fulmar certify"


@dataclass(frozen=True)
class Axis:
    """One axis of a certified set; `low` is the easiest value, `high` the hardest that was tried."""

    name: str
    low: float
    high: float
    unit: str

    def share(self, value: float) -> float:
        """Where a value lies between the easiest and the hardest, 0 to 1 or beyond [-]."""
        return (value - self.low) / (self.high - self.low)


@dataclass(frozen=True)
class CertifiedSet:
    """What `fulmar certify` found.

    Attributes:
        robot: Name of the robot.
        task: Name of the task.
        controller: Name of the law, or the hash of the bundle.
        axes: In the order of the score's weights.
        box: Lowest and highest value of each axis.
        linear: Weights of the shares u_i, shape (k,), >= 0 [-].
        quadratic: Weights of u_i u_j, upper triangle, shape (k, k), >= 0 [-].
        threshold: Largest score inside [-].
        lower_bound: Of the success inside the score's set [-].
        plain: Every key of the file.
    """

    robot: str
    task: str
    controller: str
    axes: tuple[Axis, ...]
    box: Mapping[str, tuple[float, float]]
    linear: np.ndarray
    quadratic: np.ndarray
    threshold: float
    lower_bound: float
    plain: Mapping[str, Any]

    @classmethod
    def from_plain(cls, values: Any, where: str) -> CertifiedSet:
        """Read what a passport or a file holds.

        Raises:
            ConfigError: It is none; begins with `where`.
        """
        if not isinstance(values, dict):
            raise ConfigError(f"{where}: holds no certified set. {AGAIN}.")
        if values.get("format", FORMAT) != FORMAT:
            raise ConfigError(f"{where}: has format {values['format']}, this Fulmar reads {FORMAT}. {AGAIN}.")
        missing = [name for name in NEEDED if name not in values]
        if missing:
            raise ConfigError(f"{where}: lacks the key '{missing[0]}'. {AGAIN}.")
        try:
            return cls._of(values)
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise ConfigError(f"{where}: has no meaning: {error}. {AGAIN}.") from error

    @classmethod
    def _of(cls, values: dict[str, Any]) -> CertifiedSet:
        axes = tuple(
            Axis(str(a["name"]), float(a["low"]), float(a["high"]), str(a["unit"])) for a in values["axes"]
        )
        for axis in axes:
            if not axis.low < axis.high < math.inf:
                raise ValueError(f"axis '{axis.name}' has low {axis.low:g} and high {axis.high:g}")
        box = {
            axis.name: (float(values["box"][axis.name][0]), float(values["box"][axis.name][1]))
            for axis in axes
        }
        for axis in axes:
            low, high = box[axis.name]
            if not axis.low - 1e-9 <= low <= high <= axis.high + 1e-9:
                raise ValueError(
                    f"the box's '{axis.name}' [{low:g}, {high:g}] leaves [{axis.low:g}, {axis.high:g}]"
                )
        weights, count = values["score"]["weights"], len(axes)
        linear, quadratic = np.array(weights["linear"], float), np.array(weights["quadratic"], float)
        if linear.shape != (count,) or quadratic.shape != (count, count):
            raise ValueError(f"the score needs {count} linear and {count} x {count} quadratic weights")
        if not (np.isfinite(linear).all() and np.isfinite(quadratic).all()):
            raise ValueError("a weight of the score is no number")
        return cls(
            str(values["robot"]), str(values["task"]), str(values["controller"]), axes, box, linear, quadratic,
            float(values["score"]["threshold"]), float(values["lower_bound"]), values,
        )  # fmt: skip

    def shares(self, conditions: Mapping[str, float]) -> np.ndarray:
        """Conditions as shares of the axes, shape (k,); what is not named is at its easiest.

        Raises:
            ConfigError: There is no such axis, or a value lies beyond the axis.
        """
        by_name, found = {axis.name: i for i, axis in enumerate(self.axes)}, np.zeros(len(self.axes))
        for name, value in conditions.items():
            if name not in by_name:
                hint = did_you_mean(name, by_name) or f" Axes: {', '.join(by_name)}."
                raise ConfigError(f"the certified set of '{self.controller}' has no axis '{name}'.{hint}")
            axis = self.axes[by_name[name]]
            if not axis.low <= value <= axis.high:
                raise ConfigError(
                    f"'{name}' = {value:g} {axis.unit} is out of the axis' range, {axis.low:g} to {axis.high:g}."
                )
            found[by_name[name]] = axis.share(value)
        return found

    def score(self, shares: np.ndarray) -> np.ndarray:
        """Score of conditions, shape (..., k) to (...) [-]: the higher, the harder."""
        return np.asarray(shares @ self.linear + np.sum((shares @ self.quadratic) * shares, axis=-1))

    def inside(self, shares: np.ndarray) -> np.ndarray:
        """Whether conditions lie inside, shape (..., k) to (...)."""
        return np.asarray(self.score(shares) <= self.threshold)

    def outside(self, conditions: Mapping[str, float]) -> tuple[str, ...]:
        """In words, why conditions lie outside of box and score even with all others at their easiest; empty inside.

        Those that are no axis are left out.
        """
        by_name = {axis.name: axis for axis in self.axes}
        known = {name: value for name, value in conditions.items() if name in by_name}
        too_far = tuple(
            f"{name} {value:.3g} {by_name[name].unit} is beyond {by_name[name].high:.3g} {by_name[name].unit}"
            for name, value in known.items()
            if value > by_name[name].high + 1e-9
        )
        # What is easier than an axis' own end is at that end.
        easiest = {
            name: float(np.clip(value, by_name[name].low, by_name[name].high))
            for name, value in known.items()
        }
        if too_far or self.inside(self.shares(easiest)):
            return too_far
        return self.beyond(known)

    def beyond(self, conditions: Mapping[str, float]) -> tuple[str, ...]:
        """In words, each condition outside of the box; those that are no axis are left out."""
        units = {axis.name: axis.unit for axis in self.axes}
        return tuple(
            f"{name} {value:.3g} {units[name]} is beyond {self.box[name][1]:.3g} {units[name]}"
            for name, value in conditions.items()
            # Sides are written with 6 digits.
            if name in self.box and value > (1.0 + 1e-5) * self.box[name][1] + 1e-9
        )


def read_certified_set(path: Path) -> CertifiedSet:
    """Read a file of a law.

    Raises:
        ConfigError: It cannot be read, or is none.
    """
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror}).") from error
    except (ValueError, RecursionError) as error:
        raise ConfigError(f"{path}: is no JSON: {error}. {AGAIN}.") from error
    return CertifiedSet.from_plain(values, str(path))


def set_of_bundle(envelope: Mapping[str, Any] | None, robot: Robot, task: str, where: str) -> CertifiedSet:
    """The certified set of a passport, for a robot and a task.

    Raises:
        BundleError: There is none, or it is of another robot or task.
        ConfigError: It cannot be read.
    """
    if envelope is None:
        raise BundleError(f"policy '{where}' has no certified set. Add one: fulmar certify {where} --write")
    found = CertifiedSet.from_plain(envelope, f"{where}: 'envelope'")
    for what, mine, asked in (("robot", found.robot, robot.name), ("task", found.task, task)):
        if mine != asked:
            raise BundleError(f"policy '{where}': its certified set is of {what} '{mine}', not '{asked}'.")
    return found
