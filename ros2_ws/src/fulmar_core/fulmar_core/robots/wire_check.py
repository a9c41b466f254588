"""Publishers that cannot reach the subscribers of a wire: another type, or an incompatible quality of service. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from fulmar_core.robots.topics import Wire

WIRE_WARNINGS = "wire_warnings"  # key of a health status under which a node reports them
WARNINGS = "warnings"  # key under which any node reports what else endangers its robot, one sentence each
BETWEEN = " | "  # what separates several of them there


@dataclass(frozen=True)
class Offer:
    """A publisher of a topic, as the graph of the ROS domain shows it."""

    node: str  # full name
    type: str  # of its messages
    reliable: bool
    latched: bool  # transient local


def wire_problems(wire: Wire, topic: str, offers: Iterable[Offer], *, reliable: bool) -> list[str]:
    """Describe the publishers of a topic from which its subscribers receive nothing, one sentence each, sorted.

    Durability is no problem: every latched wire is subscribed volatile too, see `operator_subscription`.

    Args:
        wire: What the topic should carry.
        topic: Its full name.
        offers: Its publishers.
        reliable: Whether the subscribers ask for reliable delivery.
    """
    problems = set()
    for offer in offers:
        if offer.type != wire.type:
            problems.add(
                f"{offer.node} publishes {offer.type} on {topic}, must be {wire.type}: nothing of it arrives"
            )
        elif reliable and not offer.reliable:
            problems.add(
                f"{offer.node} publishes best effort on {topic}, must be reliable: nothing of it arrives"
            )
    return sorted(problems)
