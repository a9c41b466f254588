"""The phase of arrivals: the least delayed measurement states it."""

from __future__ import annotations

from fulmar_ros.deadline import LEAD_NS, LISTEN, ArrivalPhase

TICK = 20_000_000


def anchors(delays: list[int], rate: float = 1.0) -> list[int | None]:
    """What is returned for measurements that come so much later than the least delayed one [ns]."""
    phase = ArrivalPhase(rate)
    sent = [5_000 + i * round(TICK / rate) for i in range(len(delays))]
    return [
        phase.anchor_ns(i * TICK, at + late) for i, (at, late) in enumerate(zip(sent, delays, strict=True))
    ]


def test_the_anchor_comes_once_after_enough_arrivals():
    found = anchors([0] * (LISTEN + 5))
    assert [i for i, anchor in enumerate(found) if anchor is not None] == [LISTEN - 1]


def test_late_first_arrivals_do_not_shift_the_phase():
    late = [70_000_000, 9_000_000] + [300_000] * (LISTEN - 3) + [0]
    expected = 5_000 + (LISTEN - 1) * TICK - LEAD_NS
    assert anchors(late)[-1] == expected


def test_stamps_that_run_faster_than_the_clock_have_a_phase_too():
    expected = 5_000 + (LISTEN - 1) * TICK // 2 - LEAD_NS // 2
    assert anchors([0] * LISTEN, rate=2.0)[-1] == expected
