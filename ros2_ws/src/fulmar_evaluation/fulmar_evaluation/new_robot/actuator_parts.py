"""Actuators of a robot's file from the joints, links and sites of a URDF or an MJCF, by their names."""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fulmar_core.config.errors import ConfigError, did_you_mean
from fulmar_core.robots.robot import Robot
from fulmar_evaluation.new_robot.description import NAME_THEM, Description, Gap, Place
from fulmar_evaluation.new_robot.wheels import ackermann_of, drive_of

WORDS = {
    "thrusters": ("thruster", "nozzle", "jet", "valve"),
    "propellers": ("propeller", "prop", "screw", "thruster", "engine"),
    "fans": ("fan", "rotor", "propeller"),
    "reaction_wheels": ("wheel",),
}
LISTS = {"thrusters": "nozzles", "propellers": "propellers", "fans": "fans", "reaction_wheels": "wheels"}
LINK = "_link"


@dataclass(frozen=True)
class Taken:
    """What was found of a robot's actuators.

    Attributes:
        keys: Of `actuators`, in place of those of the robot that it is like.
        origin: Where the body's frame has to be, in that of the description, shape (3,) [m].
        gaps: What was not found.
    """

    keys: dict[str, Any] = field(default_factory=dict)
    origin: np.ndarray = field(default_factory=lambda: np.zeros(3))
    gaps: tuple[Gap, ...] = ()


def take_actuators(description: Description, like: Robot, names: Sequence[str] = ()) -> Taken:
    """Find the actuators of the family of the robot that it is like.

    Args:
        description: Of the file.
        like: Has the family.
        names: Of links, sites or joints, or patterns such as `jet_*`; empty: by the words of the family.

    Raises:
        ConfigError: A name is none of the file.
    """
    find = FINDERS.get(like.actuators.kind)
    if find is None:
        return Taken(
            origin=description.lump.com,
            gaps=(Gap("airframe", f"a file of shapes has no coefficients: those of '{like.name}' stand there",
                      "`fulmar new airframe` computes them from a geometry"),),
        )  # fmt: skip
    return find(description, like, _chosen(description, names))


def _chosen(description: Description, names: Sequence[str]) -> tuple[str, ...]:
    """Names of the file that the given ones and patterns stand for."""
    known = [*description.frames, *(joint.name for joint in description.joints)]
    known += [thrust.name for thrust in description.thrusts]
    found: dict[str, None] = {}
    for name in names:
        fitting = fnmatch.filter(dict.fromkeys(known), name)
        if not fitting:
            raise ConfigError(
                f"{description.source}: has no link, site or joint '{name}'.{did_you_mean(name, known)}"
            )
        found |= dict.fromkeys(fitting)
    return tuple(found)


def _pushing(description: Description, like: Robot, chosen: tuple[str, ...]) -> Taken:
    """Thrusters, propellers and fans: sites with actuators, else frames by name, their x axis along the force."""
    family, origin = like.actuators.kind, _middle(description, like)
    key = LISTS[family]
    thrusts = [each for each in description.thrusts if not chosen or each.name in chosen]
    if thrusts:
        entries = [_entry(each.name, each.position - origin, each.direction, family) for each in thrusts]
        keys: dict[str, Any] = {key: entries}
        forces = {round(each.newtons, 9) for each in thrusts if each.newtons > 0.0}
        gaps: tuple[Gap, ...] = ()
        if len(forces) == 1 and "thrust" in vars(like.actuators):
            keys["thrust"] = forces.pop()
        else:
            gaps = (_strength(like, "has no single range of thrust" if forces else "has no range of thrust"),)
        return Taken(keys, origin, gaps)
    frames = _frames(description, like, chosen)
    if not frames:
        return Taken(origin=origin, gaps=(_none_found(description, like, key),))
    entries = [
        _entry(name, place.position - origin, place.rotation[:, 0], family) for name, place in frames.items()
    ]
    axis = Gap(
        f"actuators.{key}", f"the x axis of each link is taken for the direction of its force ({len(frames)})",
        "turn a 'direction' round where it is that of the jet",
    )  # fmt: skip
    aside = () if family == "propellers" else (axis,)
    return Taken({key: entries}, origin, (*aside, _strength(like, "a file of shapes has no thrust")))


def _middle(description: Description, like: Robot) -> np.ndarray:
    """Where the body's frame has to be: of a hull on a floor at half its height [m]."""
    solids = description.contacts or description.visuals
    if not like.body.planar or not solids:
        return np.zeros(3)
    heights = np.concatenate([solid.corners[:, 2] for solid in solids])
    return np.array([0.0, 0.0, 0.5 * float(heights.min() + heights.max())])


def _spinning(description: Description, like: Robot, chosen: tuple[str, ...]) -> Taken:
    """Reaction wheels: joints that turn, by name, else frames with their x axis along the wheel's."""
    origin = description.lump.com
    joints = {
        joint.name: joint.axis
        for joint in description.joints
        if (joint.name in chosen or joint.link in chosen)
        or (not chosen and joint.kind == "turns" and _has_word(joint.name, WORDS["reaction_wheels"]))
    }
    axes = joints or {
        name: place.rotation[:, 0] for name, place in _frames(description, like, chosen).items()
    }
    if not axes:
        return Taken(origin=origin, gaps=(_none_found(description, like, "wheels"),))
    wheels = [{"name": _part_name(name), "axis": _numbers(axis)} for name, axis in axes.items()]
    strength = Gap(
        "actuators.torque", "a file of shapes has no motors: torque, spin_inertia and top_speed of the wheels are "
        f"those of '{like.name}', scaled", "write those of the data sheet",
    )  # fmt: skip
    return Taken({"wheels": wheels}, origin, (strength,))


def _frames(description: Description, like: Robot, chosen: tuple[str, ...]) -> dict[str, Place]:
    """Frames of actuators: those chosen, else by the words of the family, else by the names of the other robot's."""
    if chosen:
        return {name: place for name, place in description.frames.items() if name in chosen}
    found = description.named(WORDS[like.actuators.kind])
    names = {f"{part.name}{LINK}" for part in like.actuators.fixtures}
    return found or {
        name: place for name, place in description.frames.items() if name.rpartition("/")[2] in names
    }


def _entry(name: str, position: np.ndarray, direction: np.ndarray, family: str) -> dict[str, Any]:
    entry: dict[str, Any] = {"name": _part_name(name), "position": _numbers(position)}
    return entry if family == "propellers" else entry | {"direction": _numbers(direction)}


def _part_name(name: str) -> str:
    """A name that an actuator can have."""
    short = re.sub(r"\W", "_", name.rpartition("/")[2]).removesuffix(LINK).removesuffix("_joint")
    return short if short[:1].isalpha() else f"part_{short}"


def _numbers(vector: np.ndarray) -> list[float]:
    """Numbers without rounding errors, which are below 1e-12."""
    return [round(float(each), 12) + 0.0 for each in vector]


def _has_word(name: str, words: Sequence[str]) -> bool:
    return any(word in name.lower() for word in words)


def _strength(like: Robot, why: str) -> Gap:
    key = "actuators.curve" if like.actuators.kind == "propellers" else "actuators.thrust"
    return Gap(key, f"{why}: that of '{like.name}' stands there", "measure it with a load cell or a balance")


def _none_found(description: Description, like: Robot, key: str) -> Gap:
    words = ", ".join(WORDS[like.actuators.kind])
    return Gap(
        f"actuators.{key}",
        f"{description.source.name} has no link, site or joint with one of {words} in its name; those of "
        f"'{like.name}' stand there",
        f"write yours, or {NAME_THEM} NAME,NAME",
    )


def _rolling(
    reading: Callable[..., tuple[dict[str, Any], np.ndarray, list[Gap]]],
) -> Callable[[Description, Robot, tuple[str, ...]], Taken]:
    def find(description: Description, like: Robot, chosen: tuple[str, ...]) -> Taken:
        keys, origin, gaps = reading(description, like, chosen)
        return Taken(keys, origin, tuple(gaps))

    return find


FINDERS: dict[str, Callable[[Description, Robot, tuple[str, ...]], Taken]] = {
    "thrusters": _pushing,
    "propellers": _pushing,
    "fans": _pushing,
    "reaction_wheels": _spinning,
    "differential_drive": _rolling(drive_of),
    "ackermann": _rolling(ackermann_of),
}
