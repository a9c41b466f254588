"""What the envelope guard did in a recorded run, ready for JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fulmar_bags.run_record import RunRecord
from fulmar_core.loop.envelope import watches_envelope
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.envelope.event import Event
from fulmar_core.safety.geofence import NO_AREA


def guard_figures(record: RunRecord, robot: Robot | None) -> dict[str, Any] | None:
    """Trips of a run, and the share of its time in which the backup drove.

    Args:
        record: The run.
        robot: That drove; None where that is not known.

    Returns:
        `trips`, each with `t_s` since the first measurement, `cause`, `room` [m], the `side` that it is of and `held_s`
        for which the backup drove then, and `backup_share`; None where the run had no such guard.
    """
    guards = record.info.get("guards") or {}
    area = tuple(guards.get("area") or NO_AREA)
    if robot is None or not watches_envelope(robot, str(guards.get("guard") or ""), area):
        return None
    times = record.commanded.stamp_s
    span = (float(times[0]), float(times[-1])) if len(times) else (0.0, 0.0)
    return trips_of(record.envelope, *span)


def trips_of(events: Sequence[Event], began_s: float, ended_s: float) -> dict[str, Any]:
    """See `guard_figures`, of a run that began and ended at these times of the plant's clock [s]."""
    trips, held_s = [], 0.0
    for number, event in enumerate(events):
        if not event.tripped:
            continue
        since_s = event.stamp_ns / 1e9
        ends_s = events[number + 1].stamp_ns / 1e9 if number + 1 < len(events) else ended_s
        trips.append(
            {
                "t_s": since_s - began_s,
                "cause": event.cause,
                "room": event.room,
                "side": event.side,
                "held_s": ends_s - since_s,
            }
        )
        held_s += ends_s - since_s
    return {"trips": trips, "backup_share": held_s / (ended_s - began_s) if ended_s > began_s else 0.0}


def guard_text(figures: dict[str, Any] | None) -> list[str]:
    """The same in lines for people; none where the guard never took over."""
    if not figures or not figures["trips"]:
        return []
    first = figures["trips"][0]
    count = len(figures["trips"])
    return [
        f"  the envelope guard took over {count} time{'s' if count > 1 else ''}, {figures['backup_share']:.1%} of the "
        f"time; first after {first['t_s']:.1f} s: {first['cause']}"
    ]
