"""Digests see every bit of a number, and nothing of the names of classes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from tests.freeze.digest import digest


@dataclass
class Gains:
    """Numbers with names."""

    position: float
    rates: np.ndarray


@dataclass
class Moved:
    """The same numbers, in another class."""

    position: float
    rates: np.ndarray


def test_the_last_bit_of_a_number_counts():
    assert digest(0.1) != digest(np.nextafter(0.1, 1.0).item())
    assert digest(np.float32([1.0, 2.0])) != digest(np.float64([1.0, 2.0]))
    assert digest(Gains(1.0, np.ones(2))) != digest(Gains(1.0, np.array([1.0, np.nextafter(1.0, 2.0)])))


def test_the_name_of_a_class_does_not_count_and_the_order_of_keys_neither():
    assert digest(Gains(1.0, np.ones(2))) == digest(Moved(1.0, np.ones(2)))
    assert digest({"a": 1, "b": 2}) == digest({"b": 2, "a": 1})


def test_what_is_no_number_is_refused():
    with pytest.raises(TypeError, match="not object"):
        digest(object())
