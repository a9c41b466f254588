"""Intervals of success rates and of their difference."""

from __future__ import annotations

import pytest

from fulmar_evaluation.success_interval import gain_interval


def test_the_interval_of_a_gain_is_that_of_newcombe_s_example():
    # Newcombe 1998, table II: 10/10 and 0/10.
    assert gain_interval(0.0, 1.0, 10) == pytest.approx((0.6075, 1.0), abs=1e-3)


def test_two_equal_rates_have_an_interval_around_zero():
    low, high = gain_interval(0.9, 0.9, 256)
    assert low == pytest.approx(-high)
    assert 0.03 < high < 0.07


def test_more_episodes_make_it_narrower():
    widths = [high - low for low, high in (gain_interval(0.8, 0.95, n) for n in (64, 256, 4096))]
    assert widths == sorted(widths, reverse=True)
