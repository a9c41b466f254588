"""How robots of each kind are identified."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fulmar_bags.bag_reading import BagReading
from fulmar_core.robots.robot import Robot
from fulmar_evaluation.identification.boat import BoatModel
from fulmar_evaluation.identification.free_flyer import FreeFlyerModel
from fulmar_evaluation.identification.model import Model
from fulmar_evaluation.identification.platform import PlatformModel
from fulmar_evaluation.identification.satellite import identify_satellite
from fulmar_evaluation.identification.wheels import WheelModel


@dataclass(frozen=True)
class Identifies:
    """A model, and what its scale rests on.

    Attributes:
        model: From the robot, its actuators and, with a `ballast`, the mass of each load that was aboard [kg].
        scale: What sets the scale of forces, in words; empty: a mass, since motion shows ratios only.
        ballast: A run with a known load sets it too.
        afloat: Of what water carries.
    """

    model: Callable[..., Model]
    scale: str = ""
    ballast: bool = False
    afloat: bool = False


# By kind, and family of actuators.
MODELS: dict[tuple[str, str], Identifies] = {
    ("planar", "thrusters"): Identifies(PlatformModel, ballast=True),
    ("planar", "propellers"): Identifies(
        BoatModel, "mass, inertia and drag rest on the thrust curve of the robot's YAML", afloat=True
    ),
    ("rolling", "differential_drive"): Identifies(WheelModel, "speeds need no scale"),
    ("free_flyer", "thrusters"): Identifies(FreeFlyerModel),
}

# Kinds that estimators identify instead, from a robot and its bags; JSON-ready.
ESTIMATED: dict[str, Callable[[Robot, Sequence[Path], BagReading], dict[str, Any]]] = {
    "satellite": identify_satellite
}
