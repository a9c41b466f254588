"""Words over the frames of a film."""

from __future__ import annotations

import numpy as np

from fulmar_console.video.caption import Caption


def test_long_words_at_the_left_end_before_the_figures_at_the_right() -> None:
    frame = np.full((180, 320, 3), 255, dtype=np.uint8)
    words = Caption(320, 180).write(frame, ["robot", "a long task " * 12], ["3.0 s", "error 1.00 m"])
    columns = np.flatnonzero((words[8:20] < 250).any(axis=(0, 2)))
    assert (np.diff(columns) > 1).any()  # a gap between both boxes
    assert columns[-1] < 320


def test_a_frame_without_words_stays_as_it_is() -> None:
    frame = np.full((48, 64, 3), 77, dtype=np.uint8)
    assert np.array_equal(Caption(64, 48).write(frame, [], []), frame)
