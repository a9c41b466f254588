"""What counts as the latency of a stretch."""

from __future__ import annotations

import numpy as np

from tests.benchmarks.recorder.cost import with_missing


def test_commands_that_were_not_taken_count_as_late_as_the_stretch_is_long():
    taken = np.full(206, 2.0)
    stalled = with_missing(taken, 5.0)
    assert len(stalled) == 250
    assert np.percentile(taken, 99) == 2.0
    assert np.percentile(stalled, 99) == 5000.0


def test_a_stretch_that_lacks_nothing_stays_as_it_is():
    assert with_missing(np.full(251, 2.0), 5.0).tolist() == [2.0] * 251
