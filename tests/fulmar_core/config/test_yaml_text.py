"""YAML by libyaml: what it says, and nothing that ends the process."""

from __future__ import annotations

import pytest
import yaml

from fulmar_core.config.paths import config_directory
from fulmar_core.config.yaml_text import DEEPEST, YamlError, compose, load

FILES = sorted(config_directory().rglob("*.yaml"))


@pytest.mark.parametrize(
    ("before", "opening"),
    [
        ("", "["),
        ("", "- "),
        ("", "{a: "),
        ("", "? "),
        ("x: [9:, 13]\ny: ", "["),
        ("%YAML 1.3\n---\n", "["),
    ],
    ids=["lists", "dashes", "mappings", "keys", "behind what only PyYAML reads", "of another YAML"],
)
@pytest.mark.parametrize("read", [compose, load])
def test_what_is_nested_too_deeply_is_refused_before_anything_is_built(read, before, opening):
    """By its depth, or by what stands before it; PyYAML's own reader would end in a traceback, libyaml the process."""
    with pytest.raises(YamlError):
        read(before + opening * 100_000)


def test_too_deep_nesting_is_reported_with_its_line():
    with pytest.raises(YamlError, match="nested too deeply, at most 100 levels are read") as caught:
        compose("a: 1\nb:\n  " + "- " * 1000)
    assert caught.value.line == 3


def test_as_many_levels_as_are_allowed_are_read():
    value = load("[" * DEEPEST + "]" * DEEPEST)
    for _ in range(DEEPEST - 1):
        (value,) = value
    assert value == []


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("a: [1", 1),
        ("a: [1\nb: 2\n", 2),
        ("a: b: c", 1),
        ("a: 1\nb: *unknown", 2),
        ("a: 1\n\t- a", 2),
        ("kind:\tpath\nb: 1\nx: [1\ny: 2\n", 4),  # a tab between tokens is none of the mistakes
        ("ä: 1\nb: \x07", 2),
        ("a: \x80", 1),
    ],
)
def test_invalid_yaml_is_reported_with_its_line(text, line):
    for read in (compose, load):
        with pytest.raises(YamlError) as caught:
            read(text)
        assert caught.value.line == line


def test_an_unclosed_part_is_reported_with_the_line_where_it_began():
    with pytest.raises(YamlError, match="while parsing a flow sequence of line 2"):
        compose("a: 1\nb: [1, 2\nc: 3\n")


@pytest.mark.parametrize(
    "value", ["!!timestamp x", '!!int ""', "2026-02-30", "!!bool maybe", "!!float x", "!mine 1"]
)
def test_a_value_that_is_not_what_its_tag_says_is_refused(value):
    with pytest.raises(YamlError):
        load(f"a: {value}")


def test_every_configuration_says_what_pyyaml_s_own_reader_has_it_say():
    assert len(FILES) > 50
    for path in FILES:
        text = path.read_text(encoding="utf-8")
        assert load(text) == yaml.safe_load(text), path


def test_nothing_is_nothing():
    assert compose("# only words\n") is None
    assert load("") is None
