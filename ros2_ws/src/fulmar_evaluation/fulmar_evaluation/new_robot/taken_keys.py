"""Keys of a robot's file that a URDF or an MJCF gives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_evaluation.new_robot.actuator_parts import take_actuators
from fulmar_evaluation.new_robot.by_kind import RULES
from fulmar_evaluation.new_robot.description import Description, Gap
from fulmar_evaluation.new_robot.look_parts import look_of_solids
from fulmar_evaluation.new_robot.outline import outline_of
from fulmar_evaluation.new_robot.settings import OPTION

DIGITS = 12
ASIDE_M = 0.01  # of a hull's middle beside its origin: what is less is no matter
PRODUCTS = 0.02  # of the largest moment: what is less is no matter [-]
CAMERA, IMU = "camera_link", "imu"


@dataclass
class Taken:
    """What was taken.

    Attributes:
        keys: Dotted keys of the robot's file.
        gaps: What was not.
        meshes: Files to copy, by their path beside the robot's file.
    """

    keys: list[str] = field(default_factory=list)
    gaps: list[Gap] = field(default_factory=list)
    meshes: dict[str, Path] = field(default_factory=dict)


def take_description(
    robot: dict[str, Any],
    like: Robot,
    description: Description,
    names: Sequence[str],
    settings: Mapping[str, Any],
) -> Taken:
    """Put what a description has into a robot's keys, in place.

    Args:
        robot: Keys of the new file, as those of `like`.
        like: Has the family of actuators.
        description: Of a URDF or an MJCF.
        names: Of actuators in it.
        settings: What a user sets, and need not be in the file.

    Raises:
        ConfigError: It has no mass or no inertia, and the user sets none; or a name is none of it.
    """
    found = take_actuators(description, like, names)
    taken = Taken(gaps=[*description.gaps, *found.gaps])
    robot["actuators"] |= found.keys
    others = {gap.key for gap in found.gaps if like.name in gap.why}  # of the other robot, in the end
    taken.keys += [key for each in found.keys if (key := f"actuators.{each}") not in others]
    there = description.moved(found.origin)
    _check_mass(there, settings)
    _take_mass(robot, like, there, taken)
    _take_outline(robot, like, there, taken)
    _take_sensors(robot, like, there, taken)
    look = look_of_solids(there, robot["name"])
    taken.gaps += look.gaps
    taken.meshes |= look.meshes
    robot.pop("look", None)
    if look.parts:
        robot["look"] = look.parts
        taken.keys.append("look")
    return taken


def _check_mass(description: Description, settings: Mapping[str, Any]) -> None:
    needed = {"body.mass", "body.inertia"} - set(settings)
    moments = np.linalg.eigvalsh(description.lump.tensor)
    if description.lump.mass > 0.0 and moments[0] > 0.0:
        return
    if needed and not (description.lump.mass > 0.0 and needed == {"body.mass"}):
        lacks = "no inertia" if description.lump.mass > 0.0 else "no mass"
        raise ConfigError(
            f"{description.source}: its links have {lacks} ('inertial'). Weigh it, and give {OPTION} body.mass=KG "
            f"{OPTION} 'body.inertia=[XX, YY, ZZ]' (kg·m² about the centre of mass)."
        )


def _take_mass(robot: dict[str, Any], like: Robot, description: Description, taken: Taken) -> None:
    """Mass, inertia about the centre of mass, and its place: in the plane without what has no effect there."""
    lump, body, axes = description.lump, robot["body"], like.state_type.AXES
    if not lump.mass:
        return
    tensor = lump.tensor
    inertia = [tensor[i, i] for i in range(3)]
    products = [tensor[0, 1], tensor[0, 2], tensor[1, 2]]
    share = max(map(abs, products)) / max(max(inertia), 1e-300)
    if axes == 3 and share > 1e-9:
        inertia += products
    elif share > PRODUCTS:
        taken.gaps.append(
            Gap("body.inertia", f"products of inertia, up to {share:.0%} of the largest moment, count for nothing")
        )  # fmt: skip
    body["mass"], body["inertia"] = _plain(lump.mass), [_plain(each) for each in inertia]
    com = [_plain(each) for each in lump.com[:axes]]
    body.pop("center_of_mass", None)
    if any(com):
        body["center_of_mass"] = com
    moments = np.linalg.eigvalsh(tensor)
    if 2.0 * moments[2] <= moments.sum() * (1.0 + 1e-9):
        body.pop("as_printed", None)
    moving = sorted({joint.link for joint in description.joints})
    if moving:
        taken.gaps.append(Gap("", f"what moves counts as a fixed part of the body's mass: {_some(moving)}"))
    taken.keys += ["body.mass", "body.inertia", "body.center_of_mass"]


def _take_outline(robot: dict[str, Any], like: Robot, description: Description, taken: Taken) -> None:
    """What must not touch anything: radius, height, and the box where it is no disc."""
    outline, body = outline_of(description), robot["body"]
    if outline is None:
        taken.gaps.append(
            Gap(
                "body.radius",
                f"the file has no shapes: the outline of '{like.name}' stands there",
                "measure it",
            )
        )
        return
    if outline.drawn:
        taken.gaps.append(Gap("body.radius", "no shape touches: the outline is that of what is drawn"))
    height = RULES[like.kind.name].height(outline.low, outline.high, robot["actuators"])
    body |= {"radius": _plain(outline.radius), "height": _plain(height)}
    for key in ("footprint", "footprint_x"):
        body.pop(key, None)
    if outline.footprint is not None:
        body["footprint"] = [_plain(each) for each in outline.footprint]
        if _plain(outline.middle[0]):
            body["footprint_x"] = _plain(outline.middle[0])
    if abs(outline.middle[1]) > ASIDE_M:
        taken.gaps.append(
            Gap("body.footprint", f"the hull's middle is {outline.middle[1]:.3g} m to the left of the origin, and is "
                "taken for 0", "make the box wider by twice of it")
        )  # fmt: skip
    taken.keys += ["body.radius", "body.height", "body.footprint", "body.footprint_x"]


def _take_sensors(robot: dict[str, Any], like: Robot, description: Description, taken: Taken) -> None:
    """Where the camera looks from; the inertial unit sits at the origin."""
    place = description.frames.get(CAMERA)
    if place is not None:
        mount = [*(_plain(each) for each in place.position)]
        mount += [_plain(each) for each in Rotation.from_matrix(place.rotation).as_quat()]
        if isinstance(robot["sensors"].get("camera"), dict):
            robot["sensors"]["camera"]["mount"] = mount
            taken.keys.append("sensors.camera.mount")
        else:
            taken.gaps.append(
                Gap("sensors.camera", f"'{like.name}' has none", f"write {{mount: {mount}}} below sensors")
            )
    for name, frame in description.named((IMU,)).items():
        if np.linalg.norm(frame.position) > ASIDE_M or np.abs(frame.rotation - np.eye(3)).max() > 1e-3:
            where = ", ".join(f"{each:.3g}" for each in frame.position)
            taken.gaps.append(
                Gap("sensors.imu", f"{name} sits at ({where}) m, and Fulmar's at the origin with its axes",
                    "let your driver turn and move its readings")
            )  # fmt: skip


def _plain(value: float) -> float:
    return round(float(value), DIGITS) + 0.0


def _some(names: Sequence[str]) -> str:
    return ", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "")
