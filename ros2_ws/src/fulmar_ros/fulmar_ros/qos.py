"""Quality of service of each wire, and waiting for its readers.

Publishers follow `Wire.delivery`. No deadline is requested anywhere: a publisher that offers none would never match.

Subscribers receive from publishers of every kind, best effort and reliable, volatile and latched, in one of two ways:

- The newest value counts (odometry of a controller, commands, poses, a gamepad): `subscriber_qos(wire)`, best effort
  and volatile, which every publisher matches.
- Every message counts (readings of an estimator, operators, goals, diagnostics, a recorder):
  `operator_subscription.subscribe_every`, reliable, with a best-effort subscription beside it.

Where lock step counts messages, a reading is asked for reliably alone: a lost one would hold up the run. A best-effort
publisher is named in the node's diagnostics then, see `graph.WireWatch`.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any

# What rclpy raises where the history is full has no public name.
from rclpy._rclpy_pybind11 import RCLError
from rclpy.duration import Duration
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from fulmar_core.config.errors import LockstepError
from fulmar_core.robots.topics import ESTOP, ESTOP_RELEASED, Wire

# Subscribed best effort from the start; others as soon as a publisher offers nothing better, which takes a tenth of a
# second: a stop does not wait for it.
AT_ONCE = frozenset({ESTOP, ESTOP_RELEASED})
STREAM_DEPTH = 50  # a recorder that the machine holds up for as many steps still gets them all
EVERYTHING = 0  # as depth: whatever has not been taken yet; the middleware sets an end to it at 5000


def publisher_qos(
    wire: Wire, *, lockstep: bool = False, lossless: bool = False, depth: int | None = None
) -> QoSProfile:
    """How publishers of a wire offer it.

    Args:
        wire: The wire.
        lockstep: Overwrite nothing that a reliable reader has not got; see `publish_patiently`.
        lossless: Offer best-effort wires as streams: nodes between plant and controller count their messages.
        depth: Messages that are kept, >= 1, or `EVERYTHING`; by default as the wire's delivery says. A latched wire
            of which everything is kept holds the newest 5000 for readers to come.
    """
    is_stream = wire.delivery == "stream" or (lossless and wire.delivery == "best_effort")
    stream = EVERYTHING if lockstep and is_stream else STREAM_DEPTH
    usual = wire.latest if wire.delivery == "latched" else stream
    return _profile(
        reliable=wire.delivery != "best_effort" or lossless,
        latched=wire.delivery == "latched",
        depth=usual if depth is None else depth,
    )


def subscriber_qos(
    wire: Wire,
    *,
    reliable: bool | None = None,
    depth: int | None = None,
    latched: bool | None = None,
    lossless: bool = False,
) -> QoSProfile:
    """How subscribers of a wire ask for it.

    By default a subscriber wants the newest message only: best effort, the last 1 kept. Latched wires are
    asked for reliably, with what was published before, as much as their publishers keep.

    Args:
        wire: The wire.
        reliable: Ask for every message again that got lost; only where publishers offer it.
        depth: Messages that may wait for the callback, >= 1, or `EVERYTHING`.
        latched: Ask for what was published before; as the wire is by default.
        lossless: Let `reliable` hold for best-effort wires, too; as in `publisher_qos`.

    Returns:
        A profile that matches `publisher_qos(wire)`.
    """
    latched = wire.delivery == "latched" if latched is None else latched
    return _profile(
        reliable=latched if reliable is None else reliable and (lossless or wire.delivery != "best_effort"),
        latched=latched,
        depth=wire.latest if depth is None else depth,
    )


def _profile(*, reliable: bool, latched: bool, depth: int) -> QoSProfile:
    return QoSProfile(
        history=HistoryPolicy.KEEP_ALL if depth == EVERYTHING else HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


PATIENCE_S = 4.0  # less than a plant waits for an answer, so that whoever is held up says why
LAST_WORDS_S = 0.3  # for readers in real time to get what was published last
SAFE_REPEATS = 5  # the safe command is published this often on the way out
FLUSH_S = 2.0  # at the end of a run; a launcher that asked for the end waits 4 s
PAUSE_S = 0.002  # the middleware waits with the interpreter held; here others get it


def publish_patiently(publisher: Publisher, message: Any) -> None:
    """Publish, as soon as the readers have room.

    A reader that lags behind holds up lock step. One whose process has died counts until the run is ended for that,
    or until the middleware misses it.

    Args:
        publisher: With everything kept, see `publisher_qos`.
        message: Of its type.

    Raises:
        LockstepError: No room was made for 4 s.
    """
    until = time.monotonic() + PATIENCE_S
    while True:
        try:
            publisher.publish(message)
            return
        except RCLError as error:
            if time.monotonic() > until:
                raise LockstepError(
                    f"{publisher.topic_name}: a reader has taken nothing for {PATIENCE_S:g} s and holds up lock step. "
                    f"Does the recorder hang? ({str(error).splitlines()[0]})"
                ) from error
            time.sleep(PAUSE_S)


def flush(publishers: Iterable[Publisher], limit_s: float) -> None:
    """Wait until every reader has what was published, not for ever.

    Args:
        publishers: Reliable ones.
        limit_s: For all of them together [s].
    """
    until = time.monotonic() + limit_s
    for publisher in publishers:
        publisher.wait_for_all_acked(Duration(seconds=max(0.0, until - time.monotonic())))
