"""Hypotheses about parts are compared all at once, with the numbers that each has alone."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.estimators.actuator_health import response_bank
from fulmar_core.estimators.actuator_health.response_bank import ResponseBank, _median, _Prior, _Sums


def alone(prior: _Prior, sums: _Sums) -> float:
    """Evidence by Bishop (3.86), one hypothesis at a time."""
    posterior, evidence = prior.precision + sums.matrix, prior.weighed + sums.vector
    volume = prior.volume - float(np.linalg.slogdet(posterior)[1])
    fit = float(evidence @ np.linalg.solve(posterior, evidence))
    return 0.5 * (volume - sums.squares - prior.square + fit)


@pytest.mark.parametrize("fades_s", [0.0, 1.0])
def test_hypotheses_are_compared_at_once_with_the_bits_that_each_has_alone(fades_s, monkeypatch):
    rng, faults = np.random.default_rng(1), []
    settings = {"offsets": np.array([5.0, 4.0]), "pushes": np.array([0.1]), "changes": np.array([0.01])}
    at_once, each = (ResponseBank(2, adds_up=True, fades_s=fades_s, **settings) for _ in range(2))
    together = response_bank._evidences
    calls: list[int] = []

    def one_by_one(asked):
        calls.append(len(asked))
        return [alone(*one) for one in asked]

    for step in range(60):
        rows = np.array([[*rng.normal(size=2), 0.1, 0.1, 0.1]])
        values = rows[:, :2] @ np.array([0.0 if step > 20 else 1.0, 1.0]) + rng.normal(0.0, 0.01, 1)
        gains = []
        for bank, evidences in ((at_once, together), (each, one_by_one)):
            monkeypatch.setattr(response_bank, "_evidences", evidences)
            bank.add(0.1, rows, values, np.array([0.05]))
            gains.append(bank._gains())
        assert gains[0] == gains[1]
        faults.append(at_once.fault)
    assert faults[0] == ()
    assert faults[-1] == each.fault == (0,)
    assert set(calls) == {3 * (1 + len(at_once._faults))}  # one call for every onset and fault


@pytest.mark.parametrize("count", [14, 15])
def test_the_median_is_that_of_numpy(count):
    numbers = np.random.default_rng(2).normal(size=count).tolist()
    assert _median(numbers) == float(np.median(numbers))
    assert np.isnan(_median([*numbers, float("nan")]))
