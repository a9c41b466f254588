"""Diagnostics of a bag, which a reader of their own reads and checks."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_bags.gathered import Topic
from fulmar_bags.message_types import type_store, unreadable
from fulmar_bags.statuses import statuses, unreadable_statuses

KIND = "diagnostic_msgs/msg/DiagnosticArray"


@pytest.fixture(scope="module")
def message() -> bytes:
    """Statuses of two robots."""
    types = type_store().types
    stamp = types["builtin_interfaces/msg/Time"](12, 34)
    made = [
        types["diagnostic_msgs/msg/DiagnosticStatus"](
            level=level,
            name=f"{name}: plant",
            message="höher",
            hardware_id="",
            values=[types["diagnostic_msgs/msg/KeyValue"](key, "0.25") for key in ("rate", "mode")],
        )
        for level, name in enumerate(("alpha", "beta"))
    ]
    array = types[KIND](types["std_msgs/msg/Header"](stamp, "map"), made)
    return bytes(type_store().serialize_cdr(array, KIND))


def test_a_spoilt_message_is_found_as_by_a_walk_through_its_type(message: bytes) -> None:
    draws = np.random.default_rng(3)
    spoilt = [message, *(message[:end] for end in range(len(message))), message + bytes(5)]
    for at in range(len(message)):
        other = bytearray(message)
        other[at] = draws.integers(256)
        spoilt.append(bytes(other))
    found = set(unreadable_statuses(spoilt))
    assert found == {i for i, each in enumerate(spoilt) if unreadable(KIND, [each, each])}
    assert 0 not in found and len(message) in found


def test_messages_without_a_text_are_left_out(message: bytes) -> None:
    topic = Topic("/diagnostics", KIND, [message], [7])
    ((time_ns, reports),) = statuses(topic, "beta: ")
    assert time_ns == 7
    assert [(each.name, each.level, each.message) for each in reports] == [
        ("alpha: plant", 0, "höher"),
        ("beta: plant", 1, "höher"),
    ]
    assert reports[1].values == {"rate": "0.25", "mode": "0.25"}
    assert not list(statuses(topic, "gamma: "))
