"""Which node gave the goal that counts: as its sender says, else as the graph shows."""

from __future__ import annotations

import time
from collections.abc import Sequence

from rclpy.node import Node
from std_msgs.msg import String

from fulmar_core.robots.topics import OPERATOR_ACTION, Wire
from fulmar_core.wires.operator_action import GOAL, read_action
from fulmar_ros.operator_actions import publishers_of
from fulmar_ros.operator_subscription import destroy_all, subscribe_every

REMEMBERED = 200  # claims, of which the oldest is forgotten
LOOK_S = 0.5  # between two looks in the graph


class GoalGivers:
    """Remembers who gave which goal."""

    def __init__(self, node: Node, wires: Sequence[Wire], *, streamed: bool) -> None:
        """Subscribe what senders say.

        Args:
            node: The controller.
            wires: On which its goals come.
            streamed: A goal comes with each odometry, so that its stamp does not tell one giver from another.
        """
        self._node, self._topics, self._streamed = node, [wire.name for wire in wires], streamed
        self._claims: dict[int, str] = {}
        self._guess: tuple[int, str] = (-1, "")  # of the goal of a stamp
        self._looked_s = 0.0
        self._subscriptions = subscribe_every(node, String, OPERATOR_ACTION, self._on_action)

    def by(self, stamp_ns: int) -> str:
        """Who gave the goal of a stamp [ns]; empty where there is none, or where it is not known yet."""
        if not stamp_ns:
            return ""
        if not self._streamed and stamp_ns in self._claims:
            return self._claims[stamp_ns]
        return self._guess[1] if self._streamed or self._guess[0] == stamp_ns else ""

    def look(self, stamp_ns: int) -> None:
        """Ask the graph who publishes goals, if no sender has claimed that of a stamp; call it often [ns]."""
        now_s = time.monotonic()
        if not stamp_ns or stamp_ns in self._claims or now_s - self._looked_s < LOOK_S:
            return
        known = self._guess[1] and (self._streamed or self._guess[0] == stamp_ns)
        if known:
            return
        self._looked_s = now_s
        names, complete = publishers_of(self._node, self._topics, but=self._claimers)
        if not names:
            names, complete = publishers_of(self._node, self._topics)
        if names and complete:
            self._guess = stamp_ns, names[0] if len(names) == 1 else f"one of {', '.join(names)}"

    def destroy(self, node: Node) -> None:
        """Destroy the subscriptions."""
        destroy_all(node, [self._subscriptions])

    @property
    def _claimers(self) -> set[str]:
        """Full names of nodes that claim their goals: one that is not claimed is of another node."""
        return {by.partition(" ")[0] for by in self._claims.values()}

    def _on_action(self, message: String) -> None:
        action = read_action(message.data)
        if action is None or action.does != GOAL or not action.stamp_ns:
            return
        self._claims.setdefault(action.stamp_ns, action.by)
        while len(self._claims) > REMEMBERED:
            self._claims.pop(next(iter(self._claims)))
