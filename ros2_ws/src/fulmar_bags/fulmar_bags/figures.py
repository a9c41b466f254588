"""Statistics of a bag: rates, gaps, late and dropped messages, and where it comes from."""

from __future__ import annotations

import hashlib
from dataclasses import asdict
from typing import Any

import numpy as np

from fulmar_bags.contents import Bag, span_ns
from fulmar_bags.decode import messages, stamps_ns
from fulmar_bags.frame_topics import describe_frames
from fulmar_bags.fuel import fuel_of
from fulmar_bags.gathered import Topic, json_object
from fulmar_bags.stored_bytes import lengths_of
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_path
from fulmar_core.config.provenance import MADE_BY, PATCH
from fulmar_core.robots.topics import COMMAND, METADATA, ODOMETRY, VELOCITY_COMMAND

NS = 1_000_000_000
GAP = 2.5  # periods without a message that count as a gap
LATE = 1.0  # periods between stamp and record, beyond the usual, that count as late
CARRIED = {"robot.yaml": "robots", "task.yaml": "tasks", "scenario.yaml": "scenarios"}
ASKED = {"robot.yaml": "robot", "task.yaml": "task", "scenario.yaml": "scenario"}


def describe(bag: Bag) -> dict[str, Any]:
    """The output of `fulmar bag info`, ready for JSON."""
    start_ns, end_ns = span_ns(bag.topics.values())
    topics = [_of_topic(topic, bag) for topic in bag.topics.values() if len(topic)]
    return {
        "bag": str(bag.path),
        "storage": bag.storage,
        "files": [file.name for file in bag.files],
        "size_bytes": bag.size,
        "start_ns": start_ns,
        "duration_s": (end_ns - start_ns) / NS,
        "messages": sum(len(topic) for topic in bag.topics.values()),
        "topics": topics,
        "silent_topics": [name for name, topic in bag.topics.items() if not len(topic)],
        "faults": [asdict(fault) for fault in bag.faults],
        "fuel": None if bag.robots else fuel_of(bag),
        "robots": {name: provenance(bag.of_robot(name)) for name in bag.robots},
        "provenance": provenance(bag),
        "damage": list(bag.warnings),
    }


def provenance(bag: Bag) -> dict[str, Any]:
    """Which code, configuration, weights and robot made a bag; None for what it does not say."""
    info = bag.info or {}
    controller = controller_of(bag)
    keys = ("robot", "task", "controller", "backend", "scenario", "seed", "control_hz", "lockstep", "command")
    return {
        "recorded_by_fulmar": bag.info is not None,
        **{key: bag.reading.named.get(key) or info.get(key) for key in keys},
        "name": bag.name or None,
        "fulmar_version": info.get("fulmar_version"),
        "git_revision": info.get("git_revision"),
        "policy": info.get("policy") or None,
        "thing": info.get("thing") or None,
        "controller_sha256": controller.get("sha256"),
        "made_by": json_object(bag.attachments.get(MADE_BY, b"").decode(errors="replace")),
        "uncommitted_changes": PATCH in bag.attachments,
        "recorded_to_its_end": bag.recording.get("complete"),
        "attachments": {name: hashlib.sha256(data).hexdigest() for name, data in bag.attachments.items()},
        "config_changed_since": changed_config(bag),
    }


def controller_of(bag: Bag) -> dict[str, Any]:
    """Newest metadata of the controller; empty where there is none."""
    return (controllers_of(bag) or [{}])[-1]


def controllers_of(bag: Bag) -> list[dict[str, Any]]:
    """Metadata of each controller that acted, in their order."""
    texts = (json_object(message.data) for _, message in messages(bag.of(METADATA)))
    found: list[dict[str, Any]] = []
    for text in texts:
        if text and found[-1:] != [text]:
            found.append(text)
    return found


def changed_config(bag: Bag) -> list[str]:
    """Files that the bag carries along and that are different here and now."""
    changed = []
    for name, kind in CARRIED.items():
        asked = (bag.info or {}).get(ASKED[name])
        if name not in bag.attachments or not isinstance(asked, str):
            continue
        try:
            same = config_path(kind, asked).read_bytes() == bag.attachments[name]
        except (ConfigError, OSError):
            same = False
        if not same:
            changed.append(f"{kind}/{asked}.yaml")
    return changed


def _of_topic(topic: Topic, bag: Bag) -> dict[str, Any]:
    read = topic.readable()
    log_ns = np.array(read.log_ns, dtype=np.int64)
    stamps, unstamped = stamps_ns(read), 0
    if stamps is not None:
        unstamped = int(np.sum(stamps == 0))
        # 0 means "not set": as a time it would lie decades before the other stamps.
        stamps, log_ns = stamps[stamps != 0], log_ns[stamps != 0]
    # In lock step messages come as fast as the computer goes: only stamps have a rate.
    by_stamp = stamps is not None and len(np.unique(stamps)) > 1
    times = np.sort(stamps) if by_stamp and stamps is not None else np.array(read.log_ns, dtype=np.int64)
    steps = np.diff(times)
    steps = steps[steps > 0]
    period_ns = float(np.median(steps)) if len(steps) else None
    late_ms, late = _lateness(stamps, log_ns, period_ns, bag) if by_stamp else (None, None)
    return {
        "name": topic.name,
        "type": topic.type,
        "count": len(topic),
        "bytes": int(lengths_of(topic.data).sum()),
        "rate_hz": NS / period_ns if period_ns else None,
        "by": "stamp" if by_stamp else "record",
        "unstamped": unstamped,
        "gaps": int(np.sum(steps > GAP * period_ns)) if period_ns else 0,
        "longest_gap_s": float(np.max(steps)) / NS if len(steps) else None,
        "out_of_order": int(np.sum(np.diff(stamps) < 0)) if stamps is not None else 0,
        "late": late,
        "delay_ms": late_ms,
        "dropped": _dropped(topic, bag),
        "frames": describe_frames(read),
    }


def _lateness(
    stamps: np.ndarray | None, log_ns: np.ndarray, period_ns: float | None, bag: Bag
) -> tuple[dict[str, float] | None, int | None]:
    """How much later than the quickest message each came, and how many by more than a period.

    The clock of the stamps need not be that of the recorder: only differences count. In lock step, or where simulated
    time goes faster, a delay has no meaning.
    """
    info = bag.info or {}
    if stamps is None or period_ns is None or info.get("lockstep") or bag.number("rate", 1.0) != 1.0:
        return None, None
    delay_ns = (log_ns - stamps).astype(float)
    delay_ns -= delay_ns.min()
    p50, p99 = np.percentile(delay_ns, (50, 99)) / 1e6
    spread = {"p50": float(p50), "p99": float(p99), "max": float(delay_ns.max() / 1e6)}
    return spread, int(np.sum(delay_ns > np.median(delay_ns) + LATE * period_ns))


def _dropped(topic: Topic, bag: Bag) -> int | None:
    """Number of messages that are known to be missing; None where it is unknown.

    The recorder notes messages that found no room in its memory, and numbers those that it writes, so that those lost
    with a damaged file are known. An odometry that a command answers and that is not in the bag is missing, too.
    """
    known = (bag.recording.get("dropped") or {}).get(topic.name)
    numbers = np.array(topic.sequence, dtype=np.int64)
    if len(numbers) and numbers.min() > 0 and len(np.unique(numbers)) == len(numbers):
        known = (known or 0) + int(numbers.max() - len(numbers))
    if topic is bag.of(ODOMETRY):
        answered = [stamps_ns(bag.of(wire)) for wire in (COMMAND, VELOCITY_COMMAND) if len(bag.of(wire))]
        own = stamps_ns(topic)
        if answered and answered[0] is not None and own is not None:
            wanted = answered[0][answered[0] > 0]
            known = (known or 0) + int(np.sum(~np.isin(np.unique(wanted), own)))
    return known
