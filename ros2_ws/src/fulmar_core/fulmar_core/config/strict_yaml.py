"""Strict YAML into frozen dataclasses: every mistake names its file and line.

Knows types and files, not what a robot or a task is. The supported field types are
bool, int, float, str, `X | None`, `Literal`, `tuple[X, ...]`, `tuple[X, Y, Z]`, `dict[str, X]`,
nested dataclasses, unions of dataclasses distinguished by a field `kind`, `Annotated[X, Named({...})]`,
`Annotated[X, Kinds({...})]`, and `Any` for plain values of any shape. A member of a union whose `kind` is text stands
for every dotted path of a class.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import types
import typing
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from fulmar_core.config.bounded_file import CONFIG_BYTES, read_bounded
from fulmar_core.config.errors import ConfigError, ImplausibleError, did_you_mean
from fulmar_core.config.own_class import EXAMPLE, SEPARATOR
from fulmar_core.config.yaml_text import SWITCHES, YamlError, check_keys, compose, plain, unclear

T = TypeVar("T")
MOST_VALUES = 100_000  # of a file; anything beyond is no configuration


@dataclasses.dataclass(frozen=True)
class Named:
    """Values of a field that a file may give by name: `Annotated[X, Named({"name": value})]`."""

    values: Mapping[str, Any]


@dataclasses.dataclass(frozen=True)
class Kinds:
    """Classes of a field of which the file's `kind` picks one: `Annotated[Base, Kinds({"kind": Class})]`."""

    classes: Mapping[str, type]


def load_config(cls: type[T], path: Path) -> T:
    """Read one YAML file into a frozen dataclass.

    Args:
        cls: Dataclass that describes the file; its `__post_init__` may raise ValueError. A union of
            dataclasses works too: each has a field `kind: Literal["..."]`, and the file's `kind` picks one.
        path: YAML file.

    Returns:
        The filled dataclass.

    Raises:
        ConfigError: File missing, not YAML, unknown or missing key, wrong type, or refused value;
            the message starts with `file:line`.
    """
    root = _compose(path)
    return typing.cast(T, _Builder(path).build(cls, root, "the file"))


def line_of(path: Path, keys: Sequence[str]) -> int:
    """Line in which a key of a file stands, counted from 1; that of the nearest key above, where it does not.

    Args:
        path: YAML file that `load_config` has read.
        keys: From the outermost mapping inwards; digits for the entries of lists.
    """
    node, line = _compose(path), 1
    for key in keys:
        if isinstance(node, MappingNode):
            pairs = {name.value: (name, value) for name, value in node.value}
            if key not in pairs:
                break
            name, node = pairs[key]
            line = name.start_mark.line + 1
        elif isinstance(node, SequenceNode) and key.isdecimal() and int(key) < len(node.value):
            node = node.value[int(key)]
            line = node.start_mark.line + 1
    return line


def _compose(path: Path) -> Node:
    try:
        text = read_bounded(path, CONFIG_BYTES).decode("utf-8")
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror or error}).") from error
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise ConfigError(f"{path}:{line}: is not UTF-8 text (byte {error.start}).") from error
    try:
        root = compose(text)
    except YamlError as error:
        raise ConfigError(f"{path}:{error.line}: not valid YAML: {error}.") from error
    if root is None:
        raise ConfigError(f"{path}:1: the file is empty.")
    return root


@functools.cache
def _hints_of(cls: type) -> dict[str, Any]:
    """Types of a class's fields; to evaluate them again for each file takes most of the time of reading it."""
    return typing.get_type_hints(cls, include_extras=True)


class _Builder:
    """Turns YAML nodes into typed values and remembers where each came from."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._built = 0

    def fail(self, node: Node, message: str) -> typing.NoReturn:
        raise ConfigError(f"{self.path}:{node.start_mark.line + 1}: {message}")

    def build(self, kind: Any, node: Node, where: str) -> Any:
        """Dispatch on the declared type of one field."""
        self._built += 1
        if self._built > MOST_VALUES:  # aliases let a small file stand for billions
            self.fail(node, f"the file stands for more than {MOST_VALUES} values.")
        origin = typing.get_origin(kind)
        if origin is typing.Annotated:
            kind, *notes = typing.get_args(kind)
            names = [note.values for note in notes if isinstance(note, Named)]
            if names and isinstance(node, ScalarNode):
                return names[0][self._choice(tuple(names[0]), self._scalar(node, where), node, where)]
            for note in notes:
                if isinstance(note, Kinds):
                    kind = self._member(list(note.classes.values()), node, where)
            return self.build(kind, node, where)
        if kind is Any:
            return self._plain(node, where)
        if dataclasses.is_dataclass(kind) and isinstance(kind, type):
            return self._dataclass(kind, node, where)
        if origin is tuple:
            return self._tuple(typing.get_args(kind), node, where)
        if origin is dict:
            pairs = self._pairs(node, where)
            return {key: self.build(typing.get_args(kind)[1], value, f"'{key}'") for key, _, value in pairs}
        if origin in (typing.Union, types.UnionType):
            return self._union(typing.get_args(kind), node, where)
        value = self._scalar(node, where)
        if origin is typing.Literal:
            return self._choice(typing.get_args(kind), value, node, where)
        return self._checked(kind, value, node, where)

    def _plain(self, node: Node, where: str) -> Any:
        """Mappings with text for keys, lists, and single values of JSON's types."""
        if isinstance(node, MappingNode):
            return {key: self.build(Any, value, f"'{key}'") for key, _, value in self._pairs(node, where)}
        if isinstance(node, SequenceNode):
            return [self.build(Any, item, f"{where} entry {i + 1}") for i, item in enumerate(node.value)]
        value = self._scalar(node, where)
        if not isinstance(value, str | bool | int | float | None):
            self.fail(
                node, f"{where} = {node.value!r} must be text, a number, true or false; quote it for text."
            )
        if isinstance(node, ScalarNode) and (why := unclear(node)):
            self.fail(node, f"{where} = {node.value} {why}, or quote it for text.")
        if isinstance(value, float) and not math.isfinite(value):
            self.fail(node, f"{where} = {value!r} must be a finite number.")
        return value

    def _pairs(self, node: Node, where: str) -> list[tuple[str, Node, Node]]:
        if not isinstance(node, MappingNode):
            self.fail(node, f"{where} must be a mapping of keys to values.")
        for key_node, _ in node.value:
            if not isinstance(key_node, ScalarNode):
                self.fail(key_node, f"a key of {where} must be a single word.")
        try:
            check_keys(node)
        except YamlError as error:
            raise ConfigError(f"{self.path}:{error.line}: {error}.") from None
        return [(str(key.value), key, value) for key, value in node.value]

    def _dataclass(self, cls: type, node: Node, where: str) -> Any:
        hints = _hints_of(cls)
        fields = {field.name: field for field in dataclasses.fields(cls) if field.init}
        values: dict[str, Any] = {}
        for name, key_node, value in self._pairs(node, where):
            if name not in fields:
                self.fail(key_node, f"unknown key '{name}'.{did_you_mean(name, fields)}")
            values[name] = self.build(hints[name], value, f"'{name}'")
        missing = [
            name
            for name, field in fields.items()
            if name not in values
            and field.default is dataclasses.MISSING
            and field.default_factory is dataclasses.MISSING
        ]
        if missing:
            self.fail(node, f"{where} lacks the key '{missing[0]}'.")
        try:
            return cls(**values)
        except ValueError as error:
            line = node.start_mark.line + 1
            raise ImplausibleError(f"{self.path}:{line}: {where}: {error}") from None

    def _tuple(self, kinds: tuple[Any, ...], node: Node, where: str) -> tuple[Any, ...]:
        if not isinstance(node, SequenceNode):
            self.fail(node, f"{where} must be a list.")
        if kinds[-1] is Ellipsis:
            kinds = (kinds[0],) * len(node.value)
        if len(kinds) != len(node.value):
            self.fail(node, f"{where} has {len(node.value)} entries, {len(kinds)} are needed.")
        items = zip(kinds, node.value, strict=True)
        return tuple(self.build(kind, item, f"{where} entry {i + 1}") for i, (kind, item) in enumerate(items))

    def _union(self, kinds: tuple[Any, ...], node: Node, where: str) -> Any:
        if isinstance(node, ScalarNode) and self._scalar(node, where) is None:
            if type(None) in kinds:
                return None
            self.fail(node, f"{where} must not be empty.")
        some = [kind for kind in kinds if kind is not type(None)]
        return self.build(some[0] if len(some) == 1 else self._member(some, node, where), node, where)

    def _member(self, members: list[Any], node: Node, where: str) -> Any:
        """The member of a union of dataclasses that the key `kind` names."""
        hints = {member: _hints_of(member)["kind"] for member in members}
        kinds = {typing.get_args(hint)[0]: member for member, hint in hints.items() if hint is not str}
        own = next((member for member, hint in hints.items() if hint is str), None)
        more = f" Or name a class of your own: {EXAMPLE}." if own else ""
        for name, _, value in self._pairs(node, where):
            if name == "kind":
                kind = self._scalar(value, "'kind'")
                if own and isinstance(kind, str) and SEPARATOR in kind:
                    return own
                return kinds[self._choice(tuple(kinds), kind, value, "'kind'", more)]
        self.fail(node, f"{where} lacks the key 'kind' (one of: {', '.join(sorted(kinds))}).{more}")

    def _scalar(self, node: Node, where: str) -> Any:
        if not isinstance(node, ScalarNode):
            self.fail(node, f"{where} must be a single value.")
        try:
            return plain(node)
        except YamlError as error:
            self.fail(node, f"{where} = {node.value!r} cannot be read: {error}.")

    def _choice(self, allowed: tuple[Any, ...], value: Any, node: Node, where: str, more: str = "") -> Any:
        if value not in allowed:
            near = did_you_mean(str(value), map(str, allowed))
            self.fail(node, f"{where} = {value!r} is not known.{near}{more}")
        return value

    def _checked(self, kind: Any, value: Any, node: Node, where: str) -> Any:
        if kind is float and isinstance(value, int) and not isinstance(value, bool):
            try:
                value = float(value)
            except OverflowError:
                value = math.inf
        if kind is bool and isinstance(node, ScalarNode) and not node.style and isinstance(value, str):
            value = SWITCHES.get(value.lower(), value)
        if not isinstance(value, kind) or (kind in (int, float) and isinstance(value, bool)):
            why = unclear(node) if kind in (int, float) else ""
            more = f"; {node.value} {why}" if why else ""
            self.fail(node, f"{where} = {value!r} must be {_PLAIN_NAME.get(kind, kind)}{more}.")
        if isinstance(value, float) and not math.isfinite(value):
            self.fail(node, f"{where} = {value!r} must be a finite number.")
        return value


_PLAIN_NAME = {float: "a number", int: "a whole number", bool: "true or false", str: "text"}


def positive(**numbers: float) -> None:
    """Refuse numbers that are not greater than 0.

    Raises:
        ValueError: Names the first such number.
    """
    for name, number in numbers.items():
        if number <= 0.0:
            raise ValueError(f"'{name}' must be greater than 0.")


def at_least_1(**sizes: int | tuple[int, ...]) -> None:
    """Refuse sizes, or lists of them, that are less than 1.

    Raises:
        ValueError: Names the first such size.
    """
    for name, size in sizes.items():
        if min(size if isinstance(size, tuple) else (size,), default=1) < 1:
            raise ValueError(f"'{name}' must be at least 1.")


def shares(**numbers: float) -> None:
    """Refuse numbers outside of (0, 1].

    Raises:
        ValueError: Names the first such number.
    """
    for name, number in numbers.items():
        if not 0.0 < number <= 1.0:
            raise ValueError(f"'{name}' must lie in (0, 1].")
