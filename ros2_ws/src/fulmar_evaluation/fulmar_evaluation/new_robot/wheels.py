"""Wheels, casters and steering of a URDF or an MJCF, as the drives of Fulmar have them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.robots.actuators.ackermann import Ackermann
from fulmar_core.robots.actuators.differential_drive import DifferentialDrive
from fulmar_core.robots.actuators.rolling import CLEARANCE, Rolling
from fulmar_core.robots.robot import Robot
from fulmar_core.states.gravity import GRAVITY
from fulmar_evaluation.new_robot.description import NAME_THEM, Description, Gap, Joint

WHEEL, CASTER, STEER = "wheel", "caster", "steer"
BESIDE = (CASTER, STEER)  # in the names of joints about the same axis that drive nothing
ACROSS = 0.9  # of an axis that counts as along y, its part along y [-]
DIGITS = 9
FLOOR = "base_footprint"  # by the habit of ROS, a frame on the floor below the base


@dataclass(frozen=True)
class Wheel:
    """One wheel.

    Attributes:
        name: Of its link.
        position: Of its middle, shape (3,) [m].
        joint: That turns it; None: the file has a frame alone.
    """

    name: str
    position: np.ndarray
    joint: Joint | None = None


def drive_of(
    description: Description, like: Robot, chosen: tuple[str, ...]
) -> tuple[dict[str, Any], np.ndarray, list[Gap]]:
    """Keys of `differential_drive`, the place of its origin (middle of the axle) [m], and what was not found.

    Four driven wheels are taken for two in the middle between the axles, with casters in place of the others.
    """
    other = like.actuated_by(DifferentialDrive)
    wheels = _wheels(description, tuple(other.wheels), chosen)
    left, right = _sides(wheels)
    if not left or not right:
        return {}, np.zeros(3), [_no_wheels(description, like)]
    middle = np.mean([np.mean([w.position for w in side], axis=0) for side in (left, right)], axis=0)
    track = float(np.mean([w.position[1] for w in left]) - np.mean([w.position[1] for w in right]))
    radius, gaps = _radius(description, wheels, middle, other.wheel_radius, like)
    length = max(w.position[0] for w in wheels) - min(w.position[0] for w in wheels)
    caster, more = _caster_x(description, middle, 0.5 * float(length), like, radius)
    keys = {"wheel_radius": radius, "track": _plain(track), "caster_x": caster}
    if length > 0.5 * radius:
        more.append(
            Gap("actuators.track", f"{len(wheels)} driven wheels skid in turns: they are taken for two in their middle",
                "`fulmar identify` measures the factor on the turn rate")
        )  # fmt: skip
    top = other.max_wheel_speed * other.wheel_radius
    motors, unknown = _motors(description, wheels, like, radius, per=len(left), top=top)
    fastest = motors["max_wheel_speed"] * radius
    motors["max_speed"] = _plain(min(other.max_speed, fastest))
    motors["max_yaw_rate"] = _plain(min(other.max_yaw_rate, 2.0 * fastest / track))
    return keys | motors, middle, [*gaps, *more, *unknown]


def ackermann_of(
    description: Description, like: Robot, chosen: tuple[str, ...]
) -> tuple[dict[str, Any], np.ndarray, list[Gap]]:
    """Keys of `ackermann`, the place of its origin (middle of the rear axle) [m], and what was not found."""
    other = like.actuated_by(Ackermann)
    wheels = _wheels(description, tuple(other.wheels), chosen)
    ahead = 0.5 * (
        max((w.position[0] for w in wheels), default=0.0) + min((w.position[0] for w in wheels), default=0.0)
    )
    rear, front = (
        [w for w in wheels if bool(w.position[0] > ahead) == is_front] for is_front in (False, True)
    )
    (left, right) = _sides(rear)
    if not left or not right or not front:
        return {}, np.zeros(3), [_no_wheels(description, like)]
    middle = np.mean([left[0].position, right[0].position], axis=0)
    radius, gaps = _radius(description, wheels, middle, other.wheel_radius, like)
    keys = {
        "wheel_radius": radius,
        "track": _plain(left[0].position[1] - right[0].position[1]),
        "wheelbase": _plain(float(np.mean([w.position[0] for w in front])) - middle[0]),
    }
    angles = [
        joint.limit
        for joint in description.joints
        if joint.kind == "swings" and abs(joint.axis[2]) > ACROSS and joint.limit is not None
    ]
    if angles and 0.0 < min(angles) < 0.5 * np.pi:
        keys["max_steering"] = _plain(min(angles))
    else:
        gaps.append(
            Gap("actuators.max_steering", f"no joint about z has limits: it is that of '{like.name}'", "measure it")
        )  # fmt: skip
    motors, unknown = _motors(description, wheels, like, radius, per=len(wheels), top=other.max_speed)
    return keys | {"wheel_force": motors["wheel_force"]}, middle, [*gaps, *unknown]


def _wheels(description: Description, names: Sequence[str], chosen: tuple[str, ...]) -> list[Wheel]:
    """Wheels by the joints that turn about y; without any, by frames with the names of the other robot's wheels."""
    found = []
    for joint in description.joints:
        words = f"{joint.name} {joint.link}".lower()
        named = joint.name in chosen or joint.link in chosen
        usual = not chosen and WHEEL in words and not any(word in words for word in BESIDE)
        if joint.kind != "slides" and abs(joint.axis[1]) > ACROSS and (named or usual):
            found.append(Wheel(joint.link, joint.place.position, joint))
    wanted = chosen or tuple(f"{name}_link" for name in names)
    return found or [
        Wheel(name, place.position)
        for name, place in description.frames.items()
        if name.rpartition("/")[2] in wanted
    ]


def _sides(wheels: Sequence[Wheel]) -> tuple[list[Wheel], list[Wheel]]:
    """Wheels to the left and to the right."""
    middle = float(np.mean([w.position[1] for w in wheels])) if wheels else 0.0
    return [w for w in wheels if w.position[1] > middle], [w for w in wheels if w.position[1] < middle]


def _radius(
    description: Description, wheels: Sequence[Wheel], axle: np.ndarray, usual: float, like: Robot
) -> tuple[float, list[Gap]]:
    """Radius of the wheels: of their shapes, else of the axle's height above the floor or of the hull [m]."""
    names = {wheel.name for wheel in wheels}
    for solids in (description.contacts, description.visuals):
        for solid in solids:
            if solid.link in names:
                tall = solid.size[0] if solid.shape in ("cylinder", "sphere") else np.ptp(solid.corners[:, 2])
                return _plain(0.5 * float(tall)), []
    if FLOOR in description.frames:
        height = float(axle[2] - description.frames[FLOOR].position[2])
        if height > 0.0:
            return _plain(height), []
    solids = description.contacts or description.visuals
    low = min((float(solid.corners[:, 2].min()) for solid in solids), default=0.0) - float(axle[2])
    radius = low / (CLEARANCE - 1.0)
    key, todo = "actuators.wheel_radius", "measure it"
    if radius > 0.0:
        return _plain(radius), [
            Gap(key, "wheels have no shape: the hull's clearance gives their radius", todo)
        ]
    return usual, [Gap(key, f"wheels have no shape: that of '{like.name}' stands there", todo)]


def _caster_x(
    description: Description, axle: np.ndarray, usual: float, like: Robot, radius: float
) -> tuple[float, list[Gap]]:
    """Where casters are, ahead of the axle; behind alone is negative [m]."""
    places = [place.position[0] - axle[0] for place in description.named((CASTER,)).values()]
    if places:
        far = max(places, key=abs)
        both = min(places) < -1e-6 and max(places) > 1e-6
        return _plain(abs(far) if both else -abs(far)), []
    if usual > 0.5 * radius:
        return _plain(usual), []
    x = (
        like.actuated_by(DifferentialDrive).caster_x
        * radius
        / like.actuated_by(DifferentialDrive).wheel_radius
    )
    return _plain(x), [
        Gap("actuators.caster_x", "no link has 'caster' in its name: it is that of "
            f"'{like.name}', scaled by the wheels", "write where the third point stands [m]")
    ]  # fmt: skip


def _motors(
    description: Description, wheels: Sequence[Wheel], like: Robot, radius: float, *, per: int, top: float
) -> tuple[dict[str, float], list[Gap]]:
    """Fastest wheel [rad/s] and force of one side or of all wheels [N]: of the joints' limits where those can be."""
    gaps = []
    weight = description.lump.mass or like.body.mass
    drive = like.actuated_by(Rolling)
    grip = drive.friction * weight * GRAVITY
    efforts = [w.joint.effort for w in wheels if w.joint is not None and w.joint.effort]
    speeds = [w.joint.velocity for w in wheels if w.joint is not None and w.joint.velocity]
    force = per * min(efforts) / radius if efforts else 0.0
    if not 0.01 * grip < force < grip:
        gaps.append(_no_limit("wheel_force", "effort", like))
        force = drive.wheel_force * weight / like.body.mass
    speed = min(speeds) if speeds else 0.0
    if not 0.2 * top < speed * radius < 20.0 * top:
        gaps.append(_no_limit("max_wheel_speed", "velocity", like))
        speed = top / radius
    return {"wheel_force": _plain(force), "max_wheel_speed": _plain(speed)}, gaps


def _no_limit(key: str, limit: str, like: Robot) -> Gap:
    return Gap(
        f"actuators.{key}", f"the wheels' joints have no '{limit}' that a motor can have: it is that of '{like.name}', "
        "scaled", "write that of the data sheet",
    )  # fmt: skip


def _no_wheels(description: Description, like: Robot) -> Gap:
    return Gap(
        "actuators", f"{description.source.name} has no joints about y with 'wheel' in their names on both sides; the "
        f"wheels of '{like.name}' stand there", f"write yours, or {NAME_THEM} LEFT,RIGHT",
    )  # fmt: skip


def _plain(value: float) -> float:
    return round(float(value), DIGITS) + 0.0
