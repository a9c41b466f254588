"""Radio link between a plant and its controller: what is late, lost or held up by the messages before it. No ROS.

Times are integers of the plant's clock, so that lock step and real time share one rule.
"""

from __future__ import annotations

import zlib
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from fulmar_core.config.errors import ConfigError

T = TypeVar("T")

NS = 1_000_000_000
# Bytes on the air, with headers of IP, UDP and RTPS: an odometry has 72 covariances, a command a number an actuator.
READINGS_BYTES, COMMAND_BYTES = 900, 300
QUEUE_S = 1.0  # of messages that wait for a narrow link; what finds a longer queue is lost [s]
TO_CONTROLLER, TO_PLANT = "to controller", "to plant"  # directions


@dataclass(frozen=True)
class Link:
    """What a link does to each message, in each of both directions; all zero: plant and controller share a computer."""

    delay_s: float = 0.0  # of a message, on average [s]
    jitter_s: float = 0.0  # the delay lies in `delay_s` ± this, uniform as with netem's default [s]
    loss: float = 0.0  # chance that a message is lost [-]
    # Whether messages overtake one another. A reader of DDS discards what was overtaken; else it is waited for.
    reorder: bool = False
    bandwidth: float = 0.0  # 0: without limit [bit/s]

    def __post_init__(self) -> None:
        if not 0.0 <= self.jitter_s <= self.delay_s:
            raise ValueError(
                f"'jitter_s' = {self.jitter_s:g} must lie in [0, 'delay_s' = {self.delay_s:g}] s: "
                "no message arrives before it is sent."
            )
        if not 0.0 <= self.loss < 1.0:
            raise ValueError(f"'loss' = {self.loss:g} must lie in [0, 1), the chance that a message is lost.")
        if self.bandwidth < 0.0:
            raise ValueError(f"'bandwidth' = {self.bandwidth:g} bit/s must not be negative; 0 is no limit.")

    @property
    def acts(self) -> bool:
        """Whether it does anything."""
        return self != Link()


def check_chain(link: Link, chain: Iterable[str]) -> None:
    """Reject nodes between plant and controller that would wait in lock step for readings that the link has lost.

    Args:
        link: Of a scenario.
        chain: Names of the nodes.

    Raises:
        ConfigError: There are some, and the link acts.
    """
    nodes = ", ".join(chain)
    if link.acts and nodes:
        raise ConfigError(
            f"in lock step a link needs a controller alone: {nodes} would wait for readings that the link has lost. "
            "Leave --lockstep out, or the nodes."
        )


class LinkDirection(Generic[T]):
    """Messages on their way in one direction, with random numbers of their own. Not thread-safe.

    What arrives is in the order of sending: what was overtaken is lost, or nothing overtakes; see `Link.reorder`.

    Attributes:
        sent: Messages so far.
        lost: Of those, that never arrive.
    """

    def __init__(self, link: Link, name: str, *, message_bytes: int) -> None:
        """Prepare; `begin` before the first message.

        Args:
            link: What happens to messages.
            name: `TO_CONTROLLER` or `TO_PLANT`: both directions draw numbers of their own.
            message_bytes: Size of each message.
        """
        self._link, self._name, self._bits = link, name, 8 * message_bytes
        self.sent = self.lost = 0
        self.begin(0, 0)

    def begin(self, seed: int, number: int) -> None:
        """Begin episode `number` of a seed with an empty link."""
        self._random = np.random.default_rng((seed, number, zlib.crc32(f"link {self._name}".encode())))
        self._under_way: deque[tuple[int, T]] = deque()  # arrival [ns], and message
        self._free_ns = 0  # when the last bit of all messages so far is on the air
        self.sent = self.lost = 0

    def send(self, message: T, now_ns: int) -> None:
        """Put a message on its way at a time of the plant's clock, never before that of the last call [ns]."""
        self.sent += 1
        # Both are drawn for each message, so that one parameter changes nothing but what it says.
        lottery, share = self._random.random(), self._random.uniform(-1.0, 1.0)
        leaves_ns = now_ns
        if self._link.bandwidth:
            begins_ns = max(now_ns, self._free_ns)
            if begins_ns - now_ns > QUEUE_S * NS:
                self.lost += 1
                return
            leaves_ns = self._free_ns = begins_ns + round(NS * self._bits / self._link.bandwidth)
        if lottery < self._link.loss:
            self.lost += 1
            return
        arrives_ns = leaves_ns + round(NS * (self._link.delay_s + share * self._link.jitter_s))
        if self._link.reorder:
            while self._under_way and self._under_way[-1][0] > arrives_ns:
                self._under_way.pop()
                self.lost += 1
        elif self._under_way:
            arrives_ns = max(arrives_ns, self._under_way[-1][0])
        self._under_way.append((arrives_ns, message))

    def arrived(self, now_ns: int) -> list[T]:
        """Messages that have arrived since the last call, in order, at a time of the plant's clock [ns]."""
        found = []
        while self._under_way and self._under_way[0][0] <= now_ns:
            found.append(self._under_way.popleft()[1])
        return found
