"""Names of robots: namespace, and frames where name and type differ."""

from __future__ import annotations

import re
from dataclasses import dataclass

from fulmar_core.config.errors import ConfigError, shortened

FLEET = "fleet"  # namespace of the nodes that the robots of a fleet share, and so the name of no such robot
LONGEST = 64  # of a name [characters]; topics below it have 255 in all
_NAME = re.compile(rf"[a-z][a-z0-9_]{{0,{LONGEST - 1}}}")


def check_robot_name(name: str) -> None:
    """Refuse a name that ROS cannot take for a namespace.

    Raises:
        ValueError: With what is allowed.
    """
    if not _NAME.fullmatch(name):
        raise ValueError(
            f"the name '{shortened(name)}' of a robot must begin with a small letter and have only small letters, "
            f"digits and underscores, {LONGEST} at most. Example: alpha_2"
        )


def checked_name(name: str) -> str:
    """The name itself, where ROS can take it.

    Raises:
        ConfigError: It cannot; with what is allowed.
    """
    try:
        check_robot_name(name)
    except ValueError as error:
        raise ConfigError(str(error)) from error
    return name


def namespace_of(name: str) -> str:
    """Namespace of a robot's nodes and topics."""
    return f"/{name}"


SHARED = ("earth", "inertial", "map")  # frames that belong to no robot


@dataclass(frozen=True)
class Frames:
    """Names of a robot's frames; without a prefix those of a robot that is called as its type."""

    prefix: str = ""  # such as `alpha/`

    @property
    def odom(self) -> str:
        """Where the robot began."""
        return f"{self.prefix}odom"

    @property
    def base(self) -> str:
        """The body."""
        return f"{self.prefix}base_link"

    def named(self, frame: str) -> str:
        """A frame as messages name it: with the prefix, unless all robots share it."""
        return frame if frame in SHARED else f"{self.prefix}{frame}"

    def plain(self, frame: str) -> str:
        """A received frame without the robot's own prefix: senders may leave it out."""
        return frame.removeprefix(self.prefix)


PLAIN = Frames()


def frames_of(name: str, robot: str) -> Frames:
    """Frames of a robot with a name and a type."""
    return PLAIN if name == robot else Frames(f"{name}/")
