"""Which valves a run is remembered for as believed dead or open."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from fulmar_bags.run_record import HealthSample
from fulmar_evaluation.run_summary import believed


def record(*said):
    """A run with a status of the controller at each time [s]."""
    health = [
        HealthSample(time_s, "a: controller", 1, "", {"believed_dead": names}) for time_s, names in said
    ]
    return SimpleNamespace(health=tuple(health))


@pytest.mark.parametrize(
    ("said", "named"),
    [
        ([], []),
        ([(0.0, ""), (0.4, "")], []),
        ([(0.0, ""), (0.4, "b"), (0.8, ""), (5.0, "")], []),  # gone within a second
        ([(0.0, "b"), (0.4, "b"), (0.8, "a, b"), (1.2, "a"), (1.6, "")], ["b"]),
        ([(0.0, ""), (0.4, "c")], ["c"]),  # at the end
    ],
)
def test_a_belief_that_stood_for_a_second_or_at_the_end_is_named(said, named):
    assert believed(record(*said), "believed_dead") == named


def test_a_bag_from_before_beliefs_were_reported_names_none():
    old = HealthSample(0.0, "a: controller", 0, "", {"mode": "active"})
    assert believed(SimpleNamespace(health=(old,)), "believed_open") == []
