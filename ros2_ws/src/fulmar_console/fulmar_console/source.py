"""What the server shows and commands: robots of a ROS domain, or bags."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

Answer = Callable[[bool, str], None]  # whether a command was done, and words about it


@dataclass(frozen=True)
class Expected:
    """A robot that is being started, as the command line asks for it; what is empty is as usual."""

    system: str = ""
    robot: str = ""
    name: str = ""
    task: str = ""


@dataclass(frozen=True)
class RobotSample:
    """Where one robot is, and what its actuators do.

    Attributes:
        index: Of its record.
        age_s: Of the pose; infinite before the first [s].
        pose: x, y, z [m] and the quaternion x, y, z, w, in `map`.
        shares: Of full command, -1 to 1, in the order of the record's actuators; averages since the last sample.
    """

    index: int
    age_s: float
    pose: Sequence[float]
    shares: Sequence[float]


@dataclass(frozen=True)
class Image:
    """An encoded image of a robot's camera; `kind` is 0 for colours, 1 for depth, 2 for semantic ids."""

    index: int
    kind: int
    data: bytes


class Source(Protocol):
    """What a page can show. The server asks from its event loop, so that nothing here may wait."""

    mode: str  # live or bags

    def start(self) -> None:
        """Begin; pages can load already."""

    def hello(self) -> dict[str, Any]:
        """Further keys of the first message to each page."""

    def version(self) -> int:
        """Rises when `robots` changes."""

    def robots(self) -> list[dict[str, Any]]:
        """A record of each robot: `index`, `name`, `color` and `info`, which is its `robot_info` or None."""

    def frame(self) -> tuple[list[RobotSample], float]:
        """The newest sample of each robot, and how long ago the ROS side was last alive [s]."""

    def health(self) -> Mapping[str, Mapping[str, Any]]:
        """What is known of each robot, by name, as JSON has it."""

    def events(self) -> list[dict[str, Any]]:
        """What happened since it was asked last: `robot`, `t_s`, `kind`, `words`."""

    def images(self) -> list[Image]:
        """CameraImages that came since it was asked last."""

    def do(self, command: Mapping[str, Any], answer: Answer, client: str) -> None:
        """Do what a page asks; `answer` may be called later, from any thread.

        Args:
            command: As `protocol.read_command` checked it.
            answer: Takes the result.
            client: Name of the page that asks.
        """

    def forget(self, client: str) -> None:
        """A page has gone: whatever it held down is released."""

    def file(self, path: str) -> bytes | None:
        """Content at a path of the source's own, such as a bag's tracks; None where there is none."""

    def close(self) -> None:
        """End; no more is asked."""
