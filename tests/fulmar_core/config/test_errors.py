"""Errors that a person can act on."""

from __future__ import annotations

import pytest

from fulmar_core.config.errors import ConfigError, UnknownNameError, did_you_mean


@pytest.mark.parametrize(
    ("name", "known", "hint"),
    [
        ("lqp", ["lqr", "policy"], " Did you mean 'lqr'?"),
        ("xyz", ["lqr", "policy"], " Known: lqr, policy."),
        ("xyz", [], " Known: none."),
    ],
)
def test_an_unknown_name_gets_the_nearest_one_or_all_of_them(name, known, hint):
    assert did_you_mean(name, known) == hint


def test_an_unknown_name_is_a_configuration_error_that_knows_what_exists():
    error = UnknownNameError("task", "go", {"b": 1, "a": 2})
    assert isinstance(error, ConfigError)
    assert (error.name, error.known) == ("go", ["a", "b"])
    assert str(error) == "unknown task 'go'. Known: a, b."
