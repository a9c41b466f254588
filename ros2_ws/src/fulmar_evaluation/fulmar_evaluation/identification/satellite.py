"""Inertia of a satellite from the bag of a run, by the estimators that run as nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from fulmar_bags.bag_reading import AS_IT_IS, BagReading
from fulmar_bags.contents import open_bag
from fulmar_bags.message_reader import reading_of
from fulmar_bags.wire_reader import WireReader
from fulmar_core.config.errors import BagError
from fulmar_core.estimators.inertia.estimator import InertiaEstimator
from fulmar_core.estimators.kinds import load_estimator
from fulmar_core.estimators.motion.settings import InertiaSettings
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.table import SENSORS

METHODS: tuple[Literal["batch", "rls", "ekf"], ...] = ("batch", "rls", "ekf")
NAMES = ("xx", "yy", "zz", "xy", "xz", "yz")


def identify_satellite(robot: Robot, bags: Sequence[Path], reading: BagReading = AS_IT_IS) -> dict[str, Any]:
    """Estimate the inertia by every method, over all bags.

    Args:
        robot: The satellite.
        bags: Its runs; the recursive methods go from one to the next.
        reading: What the bags do not say themselves.

    Returns:
        JSON-ready: by method the tensor's entries with 95 % intervals [kg·m²], or why there is none.

    Raises:
        BagError: A bag lacks the readings of the gyroscope or of the wheels.
    """
    settings = load_estimator("inertia")
    assert isinstance(settings, InertiaSettings)
    runs = [_readings(bag, reading) for bag in bags]
    found: dict[str, Any] = {
        "robot": robot.name,
        "bags": [str(bag) for bag in bags],
        "driven_s": round(sum((run[-1][0] - run[0][0]) / 1e9 for run in runs), 3),
        "file": dict(zip(NAMES, robot.body.tensor, strict=True)),
        "estimates": {},
    }
    for method in METHODS:
        estimator = InertiaEstimator(replace(settings, method=method), robot)
        for run in runs:
            for _, name, taken in run:
                estimator.take(name, taken)
        found["estimates"][method] = _document(estimator)
    return found


def _readings(bag: Path, reading: BagReading) -> list[tuple[int, str, Any]]:
    """Stamp [ns], name and reading of every message of gyroscope and wheels, by time."""
    reader = WireReader(open_bag(bag, reading))
    found = []
    for name in ("imu", "wheels"):
        kind = SENSORS[name]
        readings = [reading_of(message, kind) for _, message in reader.messages(kind.wire)]
        if not readings:
            raise BagError(
                f"{bag}: no message on '{kind.wire.name}', which shows the inertia. If it has another name there, give "
                f"--topics {kind.wire.name}=TOPIC; else record a run of a satellite with "
                "its gyroscope and wheels: "
                "fulmar run cubesat_wheels --task point_inertial --controller excite --lockstep"
            )
        found += [(reading.stamp_ns or 0, name, reading) for reading in readings]
    return sorted(found, key=lambda one: one[:2])


def _document(estimator: InertiaEstimator) -> dict[str, Any]:
    estimate = estimator.estimate()
    if estimate is None:
        return {"problem": estimator.problem}
    tensor, half = estimate.value, 1.96 * np.sqrt(np.diag(estimate.covariance))
    entries = tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    count = 3 if estimator.is_diagonal else 6
    return {
        name: {
            "value": float(value),
            "low": float(value - spread),
            "high": float(value + spread),
            "unit": "kg·m²",
        }
        for name, value, spread in list(zip(NAMES, entries, half, strict=True))[:count]
    }


def robot_of_bag(bag: Path, reading: BagReading = AS_IT_IS) -> str:
    """Name of the robot whose run a bag holds; empty where neither the bag nor `reading` says it."""
    return reading.robot or open_bag(bag).robot
