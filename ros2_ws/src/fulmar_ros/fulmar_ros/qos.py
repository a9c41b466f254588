"""Quality of service of each wire, for publishers and for subscribers.

Follows `Wire.delivery`. No deadline is requested anywhere: a publisher that offers none would never match.
"""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from fulmar_core.topics import Wire

STREAM_DEPTH = 50  # a recorder that the machine holds up for as many steps still gets them all
EVERYTHING = 0  # as depth: whatever has not been taken yet; the middleware sets an end to it at 5000


def publisher_qos(wire: Wire, *, lockstep: bool = False) -> QoSProfile:
    """How publishers of a wire offer it.

    Args:
        wire: The wire.
        lockstep: Overwrite nothing that a reliable reader has not got; see `publish_patiently`.
    """
    stream = EVERYTHING if lockstep and wire.delivery == "stream" else STREAM_DEPTH
    return _profile(
        reliable=wire.delivery != "best_effort",
        latched=wire.delivery == "latched",
        depth=wire.latest if wire.delivery == "latched" else stream,
    )


def subscriber_qos(
    wire: Wire, *, reliable: bool | None = None, depth: int | None = None, latched: bool | None = None
) -> QoSProfile:
    """How subscribers of a wire ask for it.

    By default a subscriber wants the newest message only: best effort, the last 1 kept. Latched wires are
    asked for reliably, with what was published before, as much as their publishers keep.

    Args:
        wire: The wire.
        reliable: Ask for every message again that got lost; only where publishers offer it.
        depth: Messages that may wait for the callback, >= 1, or `EVERYTHING`.
        latched: Ask for what was published before; as the wire is by default.

    Returns:
        A profile that matches `publisher_qos(wire)`.
    """
    latched = wire.delivery == "latched" if latched is None else latched
    return _profile(
        reliable=latched if reliable is None else reliable and wire.delivery != "best_effort",
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
