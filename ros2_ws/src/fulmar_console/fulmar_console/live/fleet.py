"""Every robot that is known, shared by the ROS side, which writes, and the server, which reads. Knows no ROS."""

from __future__ import annotations

import threading
from typing import Any

from fulmar_console.live.robot_state import RobotState

MOST_ROBOTS = 200  # what a domain can be made to announce has an end


class Fleet:
    """Robots by name, in the order in which they were found.

    Attributes:
        lock: Held around each change and each look.
        robots: By name; only ever added to, so that an index stays what it was.
        version: Rises when a robot comes, or what it is changes.
    """

    def __init__(self) -> None:
        """Know none."""
        self.lock = threading.RLock()
        self.robots: dict[str, RobotState] = {}
        self.version = 0

    def find(self, name: str, info: dict[str, Any] | None = None) -> RobotState | None:
        """That of a name; a new one, if it is not known and there is room."""
        with self.lock:
            robot = self.robots.get(name)
            if robot is None and len(self.robots) < MOST_ROBOTS:
                robot = self.robots[name] = RobotState(len(self.robots), name, info)
                self.version += 1
            return robot

    def changed(self) -> None:
        """What a robot is has changed."""
        with self.lock:
            self.version += 1
