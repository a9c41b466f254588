"""Topics of a run under other names: `FROM:=TO`, as ROS writes it."""

from __future__ import annotations

import re
from collections.abc import Sequence

from fulmar_core.errors import ConfigError, UnknownNameError
from fulmar_core.topics import COMMAND, IMU, MOCAP, ODOMETRY, TRUTH, VELOCITY_COMMAND

# What a plant, a controller and an estimator say to each other. Goals, e-stop and reports keep their names: the run
# itself and every other command of `fulmar` use them.
REMAPPABLE = tuple(wire.name for wire in (MOCAP, ODOMETRY, IMU, TRUTH, COMMAND, VELOCITY_COMMAND))
TOPIC = re.compile(r"/?[A-Za-z][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*")


def read_remappings(texts: Sequence[str]) -> dict[str, str]:
    """Read what was asked for.

    Args:
        texts: Each `FROM:=TO`; TO without a leading slash lies in the robot's namespace.

    Returns:
        New names by the wires' own.

    Raises:
        ConfigError: Not of this form, no topic that may be renamed, no name of a topic, or two topics of one name.
    """
    found: dict[str, str] = {}
    for text in texts:
        wire, separator, name = text.partition(":=")
        if not separator or not wire or not name:
            raise ConfigError(
                f"--remap {text} must be FROM:=TO, such as {MOCAP.name}:=/vrpn_mocap/body/pose."
            )
        if wire not in REMAPPABLE:
            raise UnknownNameError("topic to remap", wire, REMAPPABLE)
        if wire in found:
            raise ConfigError(f"--remap gives '{wire}' two names: {found[wire]} and {name}. Leave one out.")
        if not TOPIC.fullmatch(name):
            raise ConfigError(
                f"--remap {text}: '{name}' is no name of a topic; it takes letters, digits, _ and /, such as "
                "/vrpn_mocap/body/pose."
            )
        found[wire] = name
    taken = [found.get(wire, wire) for wire in REMAPPABLE]
    twice = [name for name in taken if taken.count(name) > 1]
    if twice:
        raise ConfigError(f"--remap gives two topics the name '{twice[0]}'. Give each a name of its own.")
    return found
