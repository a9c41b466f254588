"""YAML by libyaml: what it says, and nothing that ends the process."""

from __future__ import annotations

import pytest
import yaml

from fulmar_core.paths import config_directory
from fulmar_core.yaml_text import DEEPEST, TooDeep, compose, load

FILES = sorted(config_directory().rglob("*.yaml"))


@pytest.mark.parametrize("opening", ["[", "- ", "{a: ", "? "], ids=["lists", "dashes", "mappings", "keys"])
@pytest.mark.parametrize("read", [compose, load])
def test_what_is_nested_too_deeply_is_refused_before_anything_is_built(read, opening):
    with pytest.raises(TooDeep, match="nested too deeply: at most 100 levels"):
        read(opening * 100_000)  # libyaml itself would overflow its stack


def test_as_many_levels_as_are_allowed_are_read():
    told = load("[" * DEEPEST + "]" * DEEPEST)
    for _ in range(DEEPEST - 1):
        (told,) = told
    assert told == []


@pytest.mark.parametrize("text", ["a: [1", "a: b: c", "*unknown", "\t- a"])
def test_what_is_no_yaml_is_an_error_of_yaml(text):
    for read in (compose, load):
        with pytest.raises(yaml.YAMLError):
            read(text)


def test_every_configuration_says_what_pyyaml_s_own_reader_has_it_say():
    assert len(FILES) > 50
    for path in FILES:
        text = path.read_text(encoding="utf-8")
        assert load(text) == yaml.safe_load(text), path


def test_nothing_is_nothing():
    assert compose("# only words\n") is None
    assert load("") is None
