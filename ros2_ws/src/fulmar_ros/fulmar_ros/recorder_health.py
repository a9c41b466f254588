"""Diagnostics of a recorder, once a second, and so in the bag too."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path

from rclpy.node import Node

from fulmar_bags.ring import RECORDER
from fulmar_bags.writer_thread import SLOW_S, Account
from fulmar_ros.health import Health

PERIOD_S = 1.0
COMMANDERS = "command_publishers"  # key of the publishers of commands that the recorder is matched with
LITTLE_ROOM = 200_000_000  # bytes free on the disk; below, it is a warning


class RecorderHealth:
    """Publishes the account of a recording."""

    def __init__(
        self,
        node: Node,
        robot: str,
        directory: Path,
        account: Callable[[], Account],
        mode: Callable[[], str],
        commanders: Callable[[], int],
        *,
        warnings: Sequence[str] = (),
    ) -> None:
        """Begin to publish.

        Args:
            node: Publishes and keeps the time.
            robot: Name of the robot.
            directory: The bag; its disk is watched.
            account: The account of the recording now.
            mode: What the recorder is doing, in a word or two.
            commanders: Number of publishers of commands that the recorder is matched with.
            warnings: What a reader of the bag should know, from the start on.
        """
        self._warnings = tuple(warnings)
        self._commanders = commanders
        self._account, self._mode, self._directory = account, mode, directory
        self._health = Health(node, f"{robot}: {RECORDER}")
        node.create_timer(PERIOD_S, self.publish)

    def publish(self) -> None:
        """Publish what became of the messages so far."""
        account, free = self._account(), _free_bytes(self._directory)
        level, message = status_of(account, free)
        values = {
            "mode": self._mode(),
            COMMANDERS: str(self._commanders()),
            "received": str(account.received),
            "recorded": str(account.recorded),
            "dropped": str(sum(account.dropped.values())),
            **{f"dropped {topic}": str(count) for topic, count in account.dropped.items()},
            "waiting_bytes": str(account.waiting),
            "slowest_write_s": f"{account.slowest_write_s:.3f}",
            "files": str(account.files),
            "size_bytes": str(account.size),
            "free_bytes": str(free),
        }
        self._health.publish(level, message or self._mode(), values, warnings=self._warnings)


def status_of(account: Account, free_bytes: int) -> tuple[str, str]:
    """Level (`ok`, `warn` or `error`) and problem, empty if there is none, of an account and the room on its disk."""
    dropped = sum(account.dropped.values())
    lost = f"; {dropped} messages were dropped" if dropped else ""
    if account.problem:
        return "error", f"{account.problem}{lost}"
    if dropped:
        return (
            "error",
            f"the disk was full or too slow: {dropped} of {account.received} messages were dropped",
        )
    if account.slowest_write_s > SLOW_S:
        return "warn", f"slow disk: it took {account.slowest_write_s:.1f} s for one batch; nothing is lost"
    if free_bytes < LITTLE_ROOM:
        return "warn", f"the disk has {free_bytes / 1e6:.0f} MB left"
    return "ok", ""


def _free_bytes(directory: Path) -> int:
    try:
        there = os.statvfs(directory)
    except OSError:
        return 0
    return there.f_bavail * there.f_frsize
