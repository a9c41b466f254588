"""Strict YAML: every mistake names its file and its line."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.strict_yaml import load_config


@dataclass(frozen=True)
class Inner:
    depth: float
    label: str = "none"


@dataclass(frozen=True)
class Bomb:
    a: dict[str, dict[str, dict[str, dict[str, int]]]]


@dataclass(frozen=True)
class Round:
    kind: Literal["round"]
    radius: float


@dataclass(frozen=True)
class Square:
    kind: Literal["square"]
    side: float


@dataclass(frozen=True)
class Everything:
    number: float
    whole: int = 0
    flag: bool = False
    mode: Literal["slow", "fast"] = "slow"
    pair: tuple[float, float] = (0.0, 0.0)
    many: tuple[int, ...] = ()
    maybe: float | None = None
    inner: Inner | None = None
    table: dict[str, float] = field(default_factory=dict)
    shape: Round | Square | None = None

    def __post_init__(self) -> None:
        if self.number < 0.0:
            raise ValueError("'number' must not be negative.")


@pytest.fixture
def read(tmp_path):
    def load(text: str | bytes) -> Everything:
        path = tmp_path / "file.yaml"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return load_config(Everything, path)

    return load


def test_every_supported_type_is_read_as_itself(read):
    text = """
number: 2
whole: 3
flag: true
mode: fast
pair: [1, 2.5]
many: [1, 2, 3]
maybe: 0.5
inner: {depth: 4.0}
table: {a: 1, b: 2.0}
shape: {kind: square, side: 3.0}
"""
    assert read(text) == Everything(
        2.0,
        3,
        True,
        "fast",
        (1.0, 2.5),
        (1, 2, 3),
        0.5,
        Inner(4.0),
        {"a": 1.0, "b": 2.0},
        Square("square", 3.0),
    )


def test_whole_numbers_become_floats_where_a_float_is_declared(read):
    assert isinstance(read("number: 2\n").number, float)


def test_null_is_none_where_a_field_may_be_absent(read):
    assert read("number: 1\nmaybe: null\ninner: ~\n") == Everything(1.0)


@pytest.mark.parametrize(
    ("text", "value"),
    [("1e-3", 1e-3), ("1.5E+2", 150.0), ("-2e0", -2.0), (".5e1", 5.0), ("1.e2", 100.0), ("-.5", -0.5)],
)
def test_exponents_without_a_dot_or_a_sign_are_numbers(read, text, value):
    assert read(f"number: 0\nmaybe: {text}\n").maybe == value


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("number: 1\n\nwhol: 3\n", 3, "unknown key 'whol'. Did you mean 'whole'?"),
        ("number: 1\nzzzzzz: 3\n", 2, "unknown key 'zzzzzz'. Known: flag, inner"),
        ("whole: 1\n", 1, "lacks the key 'number'"),
        ("number: 1\ninner:\n  label: x\n", 3, "'inner' lacks the key 'depth'"),
        ("number: 1\nwhole: 2\nnumber: 3\n", 3, "key 'number' is written twice"),
        ("number: one\n", 1, "'number' = 'one' must be a number"),
        ("number: true\n", 1, "'number' = True must be a number"),
        ("number: 1\nwhole: 1.5\n", 2, "'whole' = 1.5 must be a whole number"),
        ("number: 1\nwhole: true\n", 2, "'whole' = True must be a whole number"),
        ("number: 1\nflag: 1\n", 2, "'flag' = 1 must be true or false"),
        ("number: .nan\n", 1, "'number' = nan must be a finite number"),
        ("number: -.inf\n", 1, "must be a finite number"),
        ("number: 1e999\n", 1, "must be a finite number"),
        ("number: 1" + "0" * 400 + "\n", 1, "must be a finite number"),
        ("number: 1.2.3e5\n", 1, "must be a number"),
        ("number: 2020-13-45\n", 1, "must be a number; 2020-13-45 is a date"),
        ("number: 1:30\n", 1, "must be a number; 1:30 is no decimal number: give one, in one unit"),
        ("number: 12:30:15.5\n", 1, "must be a number; 12:30:15.5 is no decimal number"),
        ("number: 1_000\n", 1, "must be a number; 1_000 holds '_': leave it out"),
        ("number: 1_0.5\n", 1, "must be a number; 1_0.5 holds '_': leave it out"),
        ("number: 1\nwhole: 0b101\n", 2, "must be a whole number; 0b101 is no decimal number"),
        ("number: 1\nwhole: 0o17\n", 2, "must be a whole number; 0o17 is no decimal number"),
        ("number: on\n", 1, "must be a number; on may be a word or a truth"),
        ("number: +.INF\n", 1, "must be a finite number"),
        ("number: 1\n<<: {whole: 2}\n", 2, "merge keys ('<<') are not read: write the keys out"),
        ("number: 1\ntable:\n  <<: {a: 2}\n", 3, "merge keys ('<<') are not read: write the keys out"),
        ("number: 1\ninner:\n\tdepth: 4\n", 3, "a tab stands where only spaces may"),
        ("number: 1\nflag: !!bool maybe\n", 2, "cannot be read"),
        ("number: !!float ''\n", 1, "cannot be read"),
        ("number: !!python/object:os.system x\n", 1, "cannot be read"),
        ("number: [1]\n", 1, "'number' must be a single value"),
        ("number: null\n", 1, "'number' = None must be a number"),
        ("number: 1\nmode: fats\n", 2, "'mode' = 'fats' is not known. Did you mean 'fast'?"),
        ("number: 1\npair: [1, 2, 3]\n", 2, "'pair' has 3 entries, 2 are needed"),
        ("number: 1\npair: 3\n", 2, "'pair' must be a list"),
        ("number: 1\nmany:\n  - 1\n  - x\n", 4, "'many' entry 2 = 'x' must be a whole number"),
        ("number: 1\ntable: [1]\n", 2, "'table' must be a mapping"),
        ("number: 1\ninner: 3\n", 2, "'inner' must be a mapping"),
        ("number: 1\nshape:\n  kind: squar\n", 3, "'kind' = 'squar' is not known. Did you mean 'square'?"),
        ("number: 1\nshape:\n  side: 1\n", 3, "'shape' lacks the key 'kind' (one of: round, square)"),
        ("number: 1\nshape:\n  kind: round\n  side: 1\n", 4, "unknown key 'side'"),
        ("number: -1\n", 1, "'number' must not be negative"),
        ("- 1\n", 1, "the file must be a mapping"),
        ("number: 1\n? [a, b]\n: 2\n", 2, "a key of the file must be a single word"),
        ("number: 1\n  whole: 2\n", 2, "not valid YAML"),
        ("number: [1\n", 2, "not valid YAML"),
        ("number: 1\n---\nnumber: 2\n", 2, "not valid YAML"),
        ("", 1, "the file is empty"),
        ("# nothing but words\n", 1, "the file is empty"),
    ],
)
def test_a_mistake_is_reported_with_its_file_and_line(read, tmp_path, text, line, words):
    with pytest.raises(ConfigError) as caught:
        read(text)
    assert str(caught.value).startswith(f"{tmp_path / 'file.yaml'}:{line}: ")
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"number: \xff\n", "is not UTF-8 text (byte 8)"),
        (b"number: \x01\n", "not valid YAML: unacceptable character #x0001"),
        (b"[" * 3000, "not valid YAML: nested too deeply"),
    ],
)
def test_what_is_no_text_at_all_is_refused_in_one_line(read, tmp_path, content, words):
    with pytest.raises(ConfigError) as caught:
        read(content)
    assert str(caught.value).startswith(f"{tmp_path / 'file.yaml'}:1: ")
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_file_and_a_folder_are_refused_by_name(tmp_path):
    with pytest.raises(ConfigError, match=r"absent\.yaml: cannot be read \(No such file"):
        load_config(Everything, tmp_path / "absent.yaml")
    with pytest.raises(ConfigError, match="cannot be read"):
        load_config(Everything, tmp_path)


def test_a_union_of_dataclasses_is_distinguished_by_its_kind(tmp_path):
    path = tmp_path / "shape.yaml"
    path.write_text("kind: round\nradius: 2\n")
    assert load_config(Round | Square, path) == Round("round", 2.0)


# The function-scoped folder is no problem: each example overwrites the one file.
@settings(
    max_examples=150,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
    derandomize=True,
)
@given(
    content=st.one_of(
        st.binary(max_size=60), st.text(alphabet=":-[]{}?!&*'\"#\n numberpai0123.e", max_size=60)
    )
)
def test_whatever_the_bytes_the_answer_is_a_value_or_a_config_error(tmp_path, content):
    path = tmp_path / "any.yaml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    try:
        assert isinstance(load_config(Everything, path), Everything)
    except ConfigError as error:
        assert str(error).startswith(str(path))


@settings(
    max_examples=100,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
    derandomize=True,
)
@given(value=st.floats(min_value=0.0, allow_nan=False, allow_infinity=False))
def test_every_number_that_python_prints_is_read_back_exactly(tmp_path, value):
    path = tmp_path / "number.yaml"
    path.write_text(f"number: {value!r}\n")
    assert math.isclose(load_config(Everything, path).number, value, rel_tol=0.0, abs_tol=0.0)


def test_a_small_file_that_stands_for_billions_of_values_is_refused(tmp_path):
    def level(n: int) -> str:
        if n == 0:
            return "{" + ", ".join(f"k{i}: 1" for i in range(30)) + "}"
        again = ", ".join(f"k{i}: *x{n}" for i in range(1, 30))
        return f"{{k0: &x{n} {level(n - 1)}, {again}}}"

    path = tmp_path / "bomb.yaml"
    path.write_text(f"a: {level(3)}\n")
    with pytest.raises(ConfigError, match="more than"):
        load_config(Bomb, path)


def test_a_huge_file_is_not_read(tmp_path):
    path = tmp_path / "huge.yaml"
    path.write_text("# " + "x" * 1_000_001)
    with pytest.raises(ConfigError, match="at most 1000000"):
        load_config(dict, path)
