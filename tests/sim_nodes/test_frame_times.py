"""When a camera takes an image."""

import itertools

import pytest

from sim_nodes.camera.frame_times import NS, FrameTimes


def made(rate_hz, times_ns):
    times = FrameTimes(rate_hz)
    return [time for time in times_ns if times.is_due(time)], times


def steps(hz, count):
    return [NS + round(i * NS / hz) for i in range(count)]


def test_at_the_rate_of_states_every_state_is_seen_once():
    times = steps(10.0, 50)
    seen, account = made(10.0, [each for time in times for each in (time, time)])
    assert seen == times and (account.made, account.missed) == (50, 0)


@pytest.mark.parametrize("hz", [40.0, 100.0, 240.0])
def test_of_more_states_those_at_the_rate_are_seen(hz):
    seen, account = made(10.0, steps(hz, round(10.0 * hz)))
    assert len(seen) == 100 and account.missed == 0
    assert max(abs(b - a - NS // 10) for a, b in itertools.pairwise(seen)) < NS / hz


def test_of_fewer_states_every_one_is_seen_and_the_others_are_counted():
    seen, account = made(10.0, steps(5.0, 10))
    assert len(seen) == 10 and account.missed == 9


def test_a_state_that_is_lost_delays_one_image_and_no_other():
    times = steps(40.0, 40)
    del times[8]
    seen, account = made(10.0, times)
    assert seen[2] == NS + round(9 * NS / 40.0) and seen[3] == NS + round(12 * NS / 40.0)
    assert account.missed == 0


def test_after_a_jump_back_or_a_long_gap_the_rate_begins_anew():
    seen, account = made(10.0, [*steps(10.0, 5), NS // 2, NS // 2 + NS // 10, 100 * NS])
    assert len(seen) == 8 and account.missed == 0
