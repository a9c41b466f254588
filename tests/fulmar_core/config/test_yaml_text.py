"""YAML by libyaml: what it says, and nothing that ends the process."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import example, given, settings
from hypothesis import strategies as st

from fulmar_core.config.paths import config_directory
from fulmar_core.config.yaml_text import DEEPEST, YamlError, compose, dump, load, plain

REPOSITORY = Path(__file__).parents[3]
SOURCES = ("ros2_ws/src", "hardware_drivers", "policy_server", "sim_nodes", "training")

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
    "value",
    ["!!timestamp x", '!!int ""', "!!int 1:30", "!!float 1_0", "!!bool maybe", "!!float x", "!mine 1"],
)
def test_a_value_that_is_not_what_its_tag_says_is_refused(value):
    with pytest.raises(YamlError):
        load(f"a: {value}")


def test_every_configuration_says_what_pyyaml_s_own_reader_has_it_say():
    assert len(FILES) > 50
    for path in FILES:
        text = path.read_text(encoding="utf-8")
        assert load(text) == _in_yaml_1_2(yaml.safe_load(text)), path


def _in_yaml_1_2(value: Any) -> Any:
    """What PyYAML reads, with the numbers that it leaves as text, such as 1e-3."""
    if isinstance(value, dict):
        return {key: _in_yaml_1_2(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_in_yaml_1_2(part) for part in value]
    return float(value) if isinstance(value, str) and re.fullmatch(r"[-+.0-9]+e[-+0-9]+", value) else value


NUMBERS = {
    "045": 45, "010": 10, "-007": -7, "090": 90, "012.50": 12.5, "0x1F": 31, "1e-3": 1e-3, "-.5": -0.5, "+3": 3,
}  # fmt: skip


@pytest.mark.parametrize(("text", "number"), NUMBERS.items())
def test_numbers_are_decimal_whatever_zeros_they_begin_with(text, number):
    assert load(text) == number
    assert load(f"[{text}]", ours=True) == [number]
    assert plain(compose(text)) == number


UNCLEAR = ["1:30", "-1:30", "190:20:30.5", "1_000", "0b11", "0o17", "yes", "No", "ON", "off", "2026-01-01"]


@pytest.mark.parametrize("text", UNCLEAR)
def test_what_readers_of_yaml_disagree_about_is_refused_in_files_of_ours_and_text_in_those_of_others(text):
    assert load(f"a: {text}") == {"a": text}
    assert load(f"a: '{text}'", ours=True) == {"a": text}
    with pytest.raises(YamlError, match=re.escape(f"'a' = {text} ")) as caught:
        load(f"b: 1\na: {text}", ours=True)
    assert caught.value.line == 2


@pytest.mark.parametrize("text", ["a: 1\na: 2", "b: {a: 1, a: 2}", "b:\n- <<: {a: 1}"])
def test_keys_that_stand_twice_and_merge_keys_are_refused(text):
    with pytest.raises(YamlError, match=r"is written twice|merge keys"):
        load(text)


SINGLE = st.text("019:_.eE+-xobYysNn~ ", max_size=8) | st.integers() | st.floats(allow_nan=False)
VALUES = st.recursive(
    st.none() | st.booleans() | SINGLE,
    lambda some: st.lists(some, max_size=3) | st.dictionaries(st.text("ab01:", max_size=3), some, max_size=3),
    max_leaves=6,
)


@settings(max_examples=100)
@given(value=VALUES)
@example(value=["1e10", "089", "010", "1:30", "yes", "2026-01-01", "0x1F", "<<"])
def test_what_is_written_is_read_back_by_both_kinds_of_reader(value):
    assert load(dump(value), ours=True) == value
    assert yaml.safe_load(dump(value)) == value


def test_no_file_of_ours_is_read_past_the_one_loader():
    """PyYAML itself is used by its writers alone."""
    sources = [path for folder in SOURCES for path in (REPOSITORY / folder).rglob("*.py")]
    reads = re.compile(r"yaml\.(safe_|full_|unsafe_)?(load|compose|parse)(_all)?\(")
    found = [path.name for path in sources if reads.search(path.read_text(encoding="utf-8"))]
    assert found == ["yaml_text.py"]


def test_nothing_is_nothing():
    assert compose("# only words\n") is None
    assert load("") is None
