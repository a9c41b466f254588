"""Plain numbers of one robot: the same bits as arrays of one."""

from __future__ import annotations

import math

import array_api_compat
import numpy as np
import pytest

from fulmar_core.states import plain_numbers
from fulmar_core.states.arrays import array_namespace, clip, is_number, is_single, power
from fulmar_core.states.attitude import from_euler, length

NUMPY = array_api_compat.array_namespace(np.zeros(1))
RANGES = {
    "sqrt": (0.0, 9.0), "exp": (-9.0, 3.0), "log": (0.01, 5.0), "sin": (-4.0, 4.0), "cos": (-4.0, 4.0),
    "asin": (-1.0, 1.0), "abs": (-1.0, 1.0),
}  # fmt: skip


def bits(value) -> bytes:
    return np.asarray(value, dtype=float).tobytes()


@pytest.mark.parametrize("name", RANGES)
def test_functions_of_a_number_have_the_bits_of_an_array_and_are_numbers(name):
    for x in np.random.default_rng(1).uniform(*RANGES[name], 2000).tolist():
        found = getattr(plain_numbers, name)(x)
        assert is_number(found)
        assert bits(found) == bits(getattr(NUMPY, name)(np.array([x]))[0])


def test_functions_of_two_numbers_have_the_bits_of_an_array():
    for x, y in np.random.default_rng(2).uniform(0.01, 2.0, (2000, 2)).tolist():
        assert bits(plain_numbers.atan2(y, x)) == bits(NUMPY.atan2(np.array([y]), np.array([x]))[0])
        assert bits(power(x, 4.2558797)) == bits((np.array([x]) ** 4.2558797)[0])


@pytest.mark.parametrize(
    "low, high", [(0.0, None), (None, 0.0), (-0.0, None), (0.0, 1.0), (-1.0, 0.0), (-1.0, -0.0)]
)
def test_clipping_chooses_among_zeros_as_arrays_do(low, high):
    for x in (0.0, -0.0, 0.5, -0.5, 2.0, -2.0, math.inf, -math.inf, math.nan):
        assert bits(clip(x, low, high)) == bits(clip(np.array([x]), low, high)[0])


def test_a_root_of_a_negative_number_is_none_and_raises_nothing():
    assert math.isnan(plain_numbers.sqrt(-1.0))
    assert math.isnan(plain_numbers.sqrt(math.nan))


def test_the_library_of_a_plain_number_has_all_else_of_numpy():
    xp = array_namespace(0.5)
    assert xp.where(True, 1.0, 2.0) == 1.0
    assert (xp.stack((1.0, 2.0)) == np.array([1.0, 2.0])).all()


def test_single_precision_is_not_computed_in_plain_numbers():
    assert is_single(np.zeros(1))
    assert not is_single(np.zeros(1, dtype=np.float32))
    assert not is_single(np.zeros(2))
    assert not is_single(0.0)


def test_a_vector_of_a_number_and_arrays_is_turned_as_one_of_arrays():
    yaw = np.linspace(-2.0, 2.0, 5)
    mixed, arrays = from_euler(0.0, 0.0, yaw), from_euler(0.0 * yaw, 0.0 * yaw, yaw)
    np.testing.assert_array_equal(np.broadcast_arrays(*mixed), arrays)
    np.testing.assert_array_equal(length((0.0, yaw, yaw)), length((0.0 * yaw, yaw, yaw)))
