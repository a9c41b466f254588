"""A robot's place in a formation: where its goal is, from where the leader is.

The place keeps its offset from the leader along the axes of the room. The law aims ahead of it by the leader's velocity
times `lead`, the law's own ratio of velocity to position gain: that is the velocity part of a tracking law,
K_p (p - x) + K_v (v - x') with K_v = lead K_p (Åström and Murray, "Feedback Systems", §8.5).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fulmar_core.controllers.controller import Controller, Readings
from fulmar_core.tasks.goal import Goal
from fulmar_core.wires.neighbours import DRIVEN, NEIGHBOURS

FROZEN_NS = (
    1_000_000_000  # for which a place may stay the same to the last bit while its velocity is not 0 [ns]
)
MOVES_M_S = 0.02  # slower than that the place of a leader may well stay the same


@dataclass(frozen=True)
class ShapePlace:
    """A place in a formation."""

    leader: str
    x: float  # from the leader, along the axes of the room [m]
    y: float  # [m]
    heading: float  # in the room [rad]

    @classmethod
    def of(cls, text: str) -> ShapePlace:
        """From `LEADER X Y HEADING` [m, m, deg].

        Raises:
            ValueError: The text is none.
        """
        parts = text.split()
        try:
            x, y, heading = (float(part) for part in parts[1:])
        except ValueError:
            x = math.nan
        if not math.isfinite(x) or not math.isfinite(y) or not math.isfinite(heading):
            raise ValueError(f"'formation' is '{text}', and must be LEADER X Y HEADING [m, m, deg].")
        return cls(parts[0], x, y, math.radians(heading))


class FormationGoal:
    """The goal of n robots that hold one place about the leader of each.

    Attributes:
        words: Why the first robot holds its own place instead; empty while it follows.
    """

    def __init__(self, place: ShapePlace, others: Sequence[str], controller: Controller) -> None:
        """Begin without a leader.

        Args:
            place: In the shape.
            others: Names of the robots in the reading `NEIGHBOURS`, in their order.
            controller: Its law may have a `lead` [s].

        Raises:
            ValueError: The leader is none of the others.
        """
        if place.leader not in others:
            raise ValueError(
                f"'formation' follows '{place.leader}', and 'neighbours' has {', '.join(others) or 'no robot'}."
            )
        self._place, self._leader, self.words = place, list(others).index(place.leader), ""
        self.use(controller)
        self._held: np.ndarray | None = (
            None  # where robots without a leader stay, shape (n, 3); NaN: they follow
        )
        self._last: np.ndarray | None = None  # place of the leader, shape (n, 2)
        self._changed_ns = 0  # when it changed last

    def use(self, controller: Controller) -> None:
        """Aim for another controller from now on."""
        self._lead_s = float(getattr(controller, "lead", 0.0))

    def follow(self, goal: Goal, own: np.ndarray, readings: Readings, stamp_ns: int) -> tuple[Goal, Goal]:
        """The goal now, and where the law is to aim.

        Args:
            goal: Of n robots, whose targets are replaced.
            own: Where the robots are, shape (n, 3): x, y [m], heading [rad].
            readings: With `NEIGHBOURS` and `DRIVEN`; without them nothing is known of the leader.
            stamp_ns: Of the measurement [ns].

        Returns:
            The place in the shape, and the same ahead of it; both where a robot lost its leader, from then on.
        """
        place, velocity, lost = self._leader_of(readings, own, stamp_ns)
        if self._held is None or len(self._held) != len(own):
            self._held = np.full_like(own, np.nan)
        held = np.where(np.isnan(self._held), own, self._held)
        self._held = np.where(lost[:, None], held, np.nan)
        wanted = np.column_stack(
            (place + np.array((self._place.x, self._place.y)), np.full(len(own), self._place.heading))
        )
        target = np.where(lost[:, None], held, wanted)
        ahead = target.copy()
        ahead[:, :2] += np.where(lost[:, None], 0.0, self._lead_s * velocity)
        return replace(goal, targets=target[:, None]), replace(goal, targets=ahead[:, None])

    def _leader_of(
        self, readings: Readings, own: np.ndarray, stamp_ns: int
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Place and velocity of the leaders, shapes (n, 2), and which robots have lost theirs, shape (n,)."""
        leader, seen = self._place.leader, readings.get(NEIGHBOURS)
        if seen is None:
            self.words = f"holds its place: it does not know where its leader '{leader}' is"
            self._last = None
            return own[:, :2], np.zeros((len(own), 2)), np.ones(len(own), dtype=bool)
        motion = seen.reshape(len(own), -1, 4)[:, self._leader]
        driven = (
            readings[DRIVEN][:, self._leader] > 0.0 if DRIVEN in readings else np.ones(len(own), dtype=bool)
        )
        place, velocity = motion[:, :2], motion[:, 2:]
        if self._last is None or not np.array_equal(self._last, place):
            self._last, self._changed_ns = place.copy(), stamp_ns
        still = stamp_ns - self._changed_ns > FROZEN_NS
        frozen = still & (np.linalg.norm(velocity, axis=-1) > MOVES_M_S)
        self.words = ""
        if not driven[0]:
            self.words = f"holds its place: nothing drives its leader '{leader}'"
        elif frozen[0]:
            self.words = (
                f"holds its place: the place of its leader '{leader}' is frozen, and its velocity is not 0"
            )
        return place, velocity, ~driven | frozen

    def reset(self) -> None:
        """Forget the leader."""
        self._held = self._last = None
        self.words = ""
