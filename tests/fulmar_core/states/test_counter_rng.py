"""Random numbers by counter: as good as others, and the same whatever else is drawn."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy import stats

from fulmar_core.states.counter_rng import (
    NOISE,
    START,
    WORLD,
    Draws,
    normal_from,
    uniform_from,
    words,
    world_keys,
)

MANY = 20_000
P = 1e-4  # a right generator fails a test with this chance; the seeds are fixed, so it does so never or always


def draws(worlds=MANY, *, seed=1, repeat=0, stream=START, first=0):
    numbers = np.arange(first, first + worlds)
    return Draws(seed, numbers, np.full(worlds, repeat), stream)


def correlation_is_none(a, b):
    assert stats.pearsonr(a, b).pvalue > P


@pytest.mark.parametrize("seed", [0, 1, 2**32, 2**40 + 7])
def test_uniform_numbers_are_spread_evenly_over_worlds_and_over_time(seed):
    across = draws(seed=seed).uniform(0.0, 1.0)
    one_world = draws(1, seed=seed)
    along = np.concatenate([one_world.uniform(0.0, 1.0) for _ in range(MANY)])
    within = draws(1, seed=seed).uniform(0.0, 1.0, MANY)[0]
    for numbers in (across, along, within):
        assert stats.kstest(numbers, "uniform").pvalue > P


def test_normal_numbers_have_the_deviation_asked_for_and_the_shape_of_a_bell():
    numbers = draws().normal(0.3)
    assert stats.kstest(numbers / 0.3, "norm").pvalue > P
    pairs = normal_from(words(world_keys(3, np.arange(MANY), np.zeros(MANY), NOISE), 0, 6), np.float64)
    for row in pairs:
        assert stats.kstest(row, "norm").pvalue > P
    for a, b in itertools.combinations(pairs, 2):
        correlation_is_none(a, b)


def test_neighbours_of_every_kind_have_nothing_in_common():
    base = draws().uniform(0.0, 1.0, 3)
    correlation_is_none(base[:-1, 0], base[1:, 0])  # worlds
    correlation_is_none(base[:, 0], base[:, 1])  # numbers of one draw
    later = draws()
    later.uniform(0.0, 1.0, 3)
    correlation_is_none(base[:, 0], later.uniform(0.0, 1.0, 3)[:, 0])  # draws
    for other in (draws(seed=2), draws(repeat=1), draws(stream=NOISE), draws(stream=WORLD)):
        correlation_is_none(base[:, 0], other.uniform(0.0, 1.0, 3)[:, 0])


def test_words_repeat_no_more_often_than_chance_has_them():
    rows = [
        words(world_keys(seed, np.arange(50), np.full(50, repeat), stream), counter, 20)
        for seed, repeat, stream, counter in itertools.product((0, 1, 2**40), (0, 1), (START, WORLD, NOISE), range(5))
    ]  # fmt: skip
    drawn = np.concatenate([row.ravel() for row in rows])
    twice = drawn.size - len(np.unique(drawn))
    expected = drawn.size**2 / 2**33  # birthdays: 0.94 of 90,000 in 2^32
    assert twice <= expected + 6 * np.sqrt(expected)


def test_every_bit_of_a_word_is_set_half_of_the_time():
    bits = words(world_keys(5, np.arange(MANY), np.zeros(MANY), START), 0, 1)[0]
    share = [np.mean((bits >> i) & 1) for i in range(32)]
    np.testing.assert_allclose(share, 0.5, atol=4.5 * 0.5 / np.sqrt(MANY))


@pytest.mark.parametrize("worlds", [1, 3, 64])
def test_a_world_gets_the_same_numbers_in_a_batch_of_any_size(worlds):
    few, many = draws(worlds), draws(4096)
    for _ in range(3):
        np.testing.assert_array_equal(few.uniform(-1.0, 2.0, 2), many.uniform(-1.0, 2.0, 2)[:worlds])
        np.testing.assert_array_equal(few.normal(1.0), many.normal(1.0)[:worlds])


def test_a_world_gets_the_same_numbers_wherever_it_stands_in_a_batch():
    order = np.array([5, 0, 3])
    some = Draws(9, order, np.zeros(3)).uniform(0.0, 1.0, 4)
    np.testing.assert_array_equal(some, draws(6, seed=9).uniform(0.0, 1.0, 4)[order])
    np.testing.assert_array_equal(Draws.of_episode(9, 3).uniform(0.0, 1.0, 4)[0], some[2])


def test_no_number_of_a_world_is_handed_out_twice_however_many_are_asked_for_at_once():
    one = draws(1)
    numbers = np.concatenate([one.uniform(0.0, 1.0, count)[0] for count in (40, 40, 1, 200, 3, 63, 64, 65)])
    assert len(np.unique(numbers)) == numbers.size


def test_numbers_lie_between_the_bounds_and_bounds_may_differ_from_world_to_world():
    low = np.arange(MANY, dtype=float)[:, None]
    drawn = draws().uniform(low, low + 0.5, 2)
    assert drawn.shape == (MANY, 2)
    assert np.all((drawn > low) & (drawn < low + 0.5))


def test_numbers_of_single_precision_are_those_of_double_precision_rounded():
    bits = words(world_keys(1, np.arange(1000), np.zeros(1000), START), 0, 2)
    np.testing.assert_allclose(
        uniform_from(bits, np.float32), uniform_from(bits, np.float64), rtol=0, atol=1e-7
    )
    assert normal_from(bits, np.float32).dtype == np.float32


def test_the_extreme_words_give_finite_numbers():
    ends = np.array([[0, 0xFFFFFFFF], [0, 0xFFFFFFFF]], dtype=np.uint32)
    for dtype in (np.float32, np.float64):
        assert np.isfinite(normal_from(ends, dtype)).all()


@pytest.mark.parametrize("counter", [0, 12345, 2**31])
def test_torch_draws_what_numpy_does(counter):
    torch = pytest.importorskip("torch")
    numbers, repeats = np.arange(200), np.arange(200) % 7
    ours = words(world_keys(2**40 + 3, numbers, repeats, NOISE), counter, 7)
    theirs = words(
        world_keys(2**40 + 3, torch.as_tensor(numbers), torch.as_tensor(repeats), NOISE), counter, 7
    )
    np.testing.assert_array_equal(theirs.numpy(), ours)
    every = words(world_keys(3, numbers, repeats, NOISE), repeats, 2)
    each = words(
        world_keys(3, torch.as_tensor(numbers), torch.as_tensor(repeats), NOISE), torch.as_tensor(repeats), 2
    )
    np.testing.assert_array_equal(each.numpy(), every)
