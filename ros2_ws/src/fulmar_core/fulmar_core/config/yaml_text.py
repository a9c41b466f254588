"""YAML as libyaml reads it, where there is one: ten times as fast as PyYAML's own reader.

Values are those of the core schema of YAML 1.2 (https://yaml.org/spec/1.2.2, section 10.3.2), where PyYAML follows
YAML 1.1: `045` is 45 and not 37, `1e-3` is a number. What YAML 1.1 alone takes for something else than text, such as
`1:30` for 90, is text, see `unclear`. Keys that stand twice and merge keys (`<<`) are refused.

PyYAML's bridge to libyaml builds what is nested by calling itself in C, where nothing counts how deep: a file of `[[[[`
would end the process. So depth is looked at first, event by event.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, ClassVar

import yaml
from yaml.nodes import MappingNode, Node, ScalarNode
from yaml.reader import ReaderError

DEEPEST = 100  # levels; a configuration has five
_C_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_TAG, _MERGE = "tag:yaml.org,2002:", "<<"
_INT = re.compile(r"[-+]?[0-9]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(
    r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)"
)
# In the order in which they are asked; each may begin with one of the characters alone.
_PLAIN_VALUES = (
    ("bool", re.compile(r"true|True|TRUE|false|False|FALSE"), "tTfF"),
    ("int", _INT, "-+0123456789"),
    ("float", _FLOAT, "-+.0123456789"),
    ("null", re.compile(r"~|null|Null|NULL|"), ("~", "n", "N", "")),
)
SWITCHES = {"yes": True, "on": True, "no": False, "off": False}  # where true or false is wanted
_UNCLEAR = (
    (
        re.compile(r"[-+]?[0-9][0-9_]*(:[0-5]?[0-9])+(\.[0-9_]*)?"),
        "is no decimal number: give one, in one unit",
    ),
    (re.compile(r"[-+]?[0-9.][0-9.]*_[0-9_.eE+-]*|0x[0-9a-fA-F]*_[0-9a-fA-F_]*"), "holds '_': leave it out"),
    (re.compile(r"[-+]?0[bBoO][0-9]+"), "is no decimal number: give one"),
    (re.compile("|".join(SWITCHES), re.IGNORECASE), "may be a word or a truth: write true or false"),
    (re.compile(r"[0-9]{4}-[0-9]{1,2}-[0-9]{1,2}([Tt ].*)?"), "is a date: give a number"),
)
# What PyYAML's converters let slip where a value is not what its tag says, as in `!!bool maybe` or `!!timestamp x`.
_STUMBLES = (ValueError, LookupError, AttributeError)


class _Loader(_C_LOADER):  # type: ignore[misc]
    """Safe loader of plain values by YAML 1.2."""

    yaml_implicit_resolvers: ClassVar[dict[Any, Any]] = {}

    def construct_mapping(self, node: MappingNode, deep: bool = False) -> dict[Any, Any]:
        """A mapping whose keys stand once."""
        check_keys(node)
        return dict(super().construct_mapping(node, deep))


def _int(loader: Any, node: ScalarNode) -> int:
    text = loader.construct_scalar(node)
    if not _INT.fullmatch(text):
        raise ValueError(f"{text!r} is no whole number")
    return int(text, 16 if text.startswith("0x") else 10)


def _float(loader: Any, node: ScalarNode) -> float:
    text = loader.construct_scalar(node)
    if not _FLOAT.fullmatch(text):
        raise ValueError(f"{text!r} is no number")
    return float(re.sub(r"\.(?=[iInN])", "", text))  # Python writes infinity without its dot


class _Dumper(yaml.SafeDumper):
    """Quotes every text that a reader of YAML 1.1 or of 1.2 would take for something else."""


for _kind, _pattern, _first in _PLAIN_VALUES:
    _whole = re.compile(f"(?:{_pattern.pattern})$")
    for _class in (_Loader, _Dumper):
        _class.add_implicit_resolver(_TAG + _kind, _whole, list(_first))
for _pattern, _ in _UNCLEAR:
    _Dumper.add_implicit_resolver("unclear", re.compile(f"(?:{_pattern.pattern})$", _pattern.flags), None)
_Loader.add_constructor(_TAG + "int", _int)
_Loader.add_constructor(_TAG + "float", _float)
_LOADER = _Loader


class YamlError(Exception):
    """A text is no YAML, or none that is read here."""

    def __init__(self, what: str, line: int) -> None:
        super().__init__(what)
        self.line = line


def compose(text: str) -> Node | None:
    """The nodes of a document, None if it is empty.

    Raises:
        YamlError: It is none, or nested too deeply.
    """
    with _yaml_errors(text):
        _check_depth(text)
        root: Node | None = yaml.compose(text, Loader=_LOADER)
    return root


def load(text: str, *, ours: bool = False) -> Any:
    """What a document says, of plain types.

    Args:
        text: The document.
        ours: Whether it is written for Fulmar: then what is `unclear` is refused; in files of others it is text.

    Raises:
        YamlError: It is none, nested too deeply, a key stands twice, or a value is not what its tag says.
    """
    with _yaml_errors(text):
        _check_depth(text)
        if ours:
            _refuse_unclear(compose(text))
        loader = _LOADER(text)
        try:
            return loader.get_single_data()
        except _STUMBLES as error:
            raise YamlError("a value is not what its tag says", 1) from error
        finally:
            loader.dispose()


def plain(node: ScalarNode) -> Any:
    """The value of a single node.

    Raises:
        YamlError: It is not what its tag says.
    """
    try:
        return _Loader("").construct_object(node)
    except (yaml.YAMLError, *_STUMBLES) as error:
        raise YamlError(" ".join(str(error).split()), node.start_mark.line + 1) from error


def dump(value: Any) -> str:
    """A document that every reader, of YAML 1.1 or of 1.2, reads back as what was written; keys keep their order."""
    text: str = yaml.dump(value, Dumper=_Dumper, sort_keys=False, allow_unicode=True)
    return text


def unclear(node: Node) -> str:
    """Why a value without quotes that is text here may be meant as something else; empty where it may not."""
    if not isinstance(node, ScalarNode) or node.style or node.tag != f"{_TAG}str":
        return ""
    return next((why for pattern, why in _UNCLEAR if pattern.fullmatch(node.value)), "")


def check_keys(node: MappingNode) -> None:
    """Refuse keys that stand twice, and merge keys.

    Raises:
        YamlError: With the line of the first such key.
    """
    seen: set[str] = set()
    for key, _ in node.value:
        if not isinstance(key, ScalarNode):
            continue
        if key.value == _MERGE and not key.style:
            raise YamlError("merge keys ('<<') are not read: write the keys out", _line(key.start_mark))
        if key.value in seen:
            raise YamlError(f"key '{key.value}' is written twice", _line(key.start_mark))
        seen.add(key.value)


def _refuse_unclear(root: Node | None) -> None:
    """Refuse the first value that may be meant as something else; aliases are looked at once."""
    waiting, seen = [("the file", root)], set[int]()
    while waiting:
        where, node = waiting.pop()
        if node is None or id(node) in seen:
            continue
        seen.add(id(node))
        if isinstance(node, MappingNode):
            waiting += [(f"'{key.value}'", value) for key, value in reversed(node.value)]
        elif isinstance(node, ScalarNode):
            if why := unclear(node):
                raise YamlError(f"{where} = {node.value} {why}, or quote it for text", _line(node.start_mark))
        else:
            waiting += [(where, value) for value in reversed(node.value)]


def _check_depth(text: str) -> None:
    depth = 0
    for event in yaml.parse(text, Loader=_LOADER):
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > DEEPEST:
            raise YamlError(f"nested too deeply, at most {DEEPEST} levels are read", _line(event.start_mark))


@contextmanager
def _yaml_errors(text: str) -> Iterator[None]:
    """PyYAML's errors as `YamlError`."""
    try:
        yield
    except ReaderError as error:  # the first such character: none before it was refused
        before = text[: text.index(chr(error.character))]
        what = f"unacceptable character #x{error.character:04x}, {error.reason}"
        raise YamlError(what, before.count("\n") + 1) from error
    except yaml.MarkedYAMLError as error:
        what = str(error.problem)
        if "'\\t'" in what or ("character that cannot start" in what and _is_tab(text, error.problem_mark)):
            what = "a tab stands where only spaces may: indent by spaces"
        if error.context and error.context_mark:
            what += f" ({error.context} of line {_line(error.context_mark)})"
        lines = text.count("\n") + 1  # libyaml has a text without a last newline end in a line of its own
        raise YamlError(what, min(_line(error.problem_mark), lines)) from error


def _is_tab(text: str, mark: Any) -> bool:
    """Whether a tab stands where an error is."""
    lines = text.splitlines()
    return mark is not None and mark.line < len(lines) and "\t" in lines[mark.line][mark.column :][:1]


def _line(mark: Any) -> int:
    """Counted from 1."""
    return mark.line + 1 if mark else 1
