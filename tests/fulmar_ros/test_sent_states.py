"""What a plant remembers of the states that it sent."""

from __future__ import annotations

from fulmar_ros.sent_states import SentStates

MS = 1_000_000


def sent(*stamps_ms: int) -> SentStates:
    """Each sent at the steady time of its stamp."""
    states = SentStates(200 * MS)
    for stamp in stamps_ms:
        states.note(stamp * MS, stamp * MS)
    return states


def test_a_state_may_be_answered_for_as_long_as_it_is_young_and_so_may_those_after_it():
    states = sent(1000, 1100)
    assert not states.outdated(1000 * MS, 1200 * MS)
    assert states.outdated(1000 * MS, 1201 * MS)
    assert states.outdated(900 * MS, 1201 * MS)
    assert not states.outdated(1100 * MS, 1201 * MS)


def test_what_another_plant_sent_before_the_first_state_is_too_old():
    assert sent(1000).outdated(999 * MS, 1001 * MS)


def test_an_answer_without_a_stamp_has_no_age():
    assert not sent(1000).outdated(0, 9000 * MS)


def test_the_first_sending_counts():
    states = sent(1000)
    states.note(1000 * MS, 1150 * MS)
    assert states.answered(1000 * MS, 1160 * MS) == 160 * MS
    assert states.answered(1000 * MS, 1170 * MS) is None


def test_after_a_clock_was_set_back_its_new_stamps_are_as_good():
    states = sent(9000)
    assert states.outdated(9000 * MS, 9300 * MS)
    states.note(5000 * MS, 9300 * MS)
    assert not states.outdated(5000 * MS, 9310 * MS)


def test_what_was_sent_before_a_pause_is_not_answered_after_it():
    states = sent(1000)
    states.close()
    assert states.outdated(1000 * MS, 1010 * MS)
    assert states.answered(1000 * MS, 1010 * MS) is None
    states.note(1100 * MS, 1100 * MS)
    assert not states.outdated(1100 * MS, 1110 * MS)
