"""How robots of each kind are identified."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fulmar_bags.run_record import Motion
from fulmar_core.states.rotation import yaw_of
from fulmar_evaluation.identification.boat import BoatModel
from fulmar_evaluation.identification.drives import Drive, drive_in_space, drive_of
from fulmar_evaluation.identification.free_flyer import FreeFlyerModel
from fulmar_evaluation.identification.model import Model
from fulmar_evaluation.identification.platform import PlatformModel
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


def _in_plane(name: str, odometry: Motion, command_s: np.ndarray, command: np.ndarray, load: int) -> Drive:
    yaw = np.asarray(yaw_of(odometry.quat_xyzw))
    xy = odometry.position[:, :2]
    return drive_of(name, odometry.stamp_s, xy, yaw, command_s, command, load=load)


def _in_space(name: str, odometry: Motion, command_s: np.ndarray, command: np.ndarray, load: int) -> Drive:
    pose = np.column_stack((odometry.position, odometry.quat_xyzw))
    return drive_in_space(name, odometry.stamp_s, pose, command_s, command, load=load)


# From a name, odometry, stamps [s] and values of commands, and the number of the load.
DRIVES: dict[str, Callable[..., Drive]] = {
    "planar": _in_plane,
    "rolling": _in_plane,
    "free_flyer": _in_space,
    "satellite": _in_space,
    "aircraft": _in_space,
}
