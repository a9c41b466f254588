"""Trips and returns of the envelope guard, as a bag has them."""

from __future__ import annotations

from fulmar_bags.contents import Bag
from fulmar_bags.statuses import statuses
from fulmar_core.robots.topics import ENVELOPE_STATE
from fulmar_core.safety.envelope.event import Event, event_of


def envelope_events(bag: Bag) -> tuple[Event, ...]:
    """Every event of `envelope/state` that can be read, in the order of recording."""
    found: list[Event] = []
    for _, reports in statuses(bag.of(ENVELOPE_STATE)):
        for report in reports:
            try:
                found.append(event_of(report.values))
            except (KeyError, ValueError, TypeError):
                continue
    return tuple(found)
