"""YAML as libyaml reads it, where there is one: ten times as fast as PyYAML's own reader.

PyYAML's bridge to libyaml builds what is nested by calling itself in C, where nothing counts how deep: a file of `[[[[`
would end the process. So depth is looked at first, event by event.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import yaml
from yaml.nodes import Node, ScalarNode
from yaml.reader import ReaderError

DEEPEST = 100  # levels; a configuration has five
_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
# What PyYAML's converters let slip where a value is not what its tag says, as in `!!bool maybe` or `!!timestamp x`.
_STUMBLES = (ValueError, LookupError, AttributeError)


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


def load(text: str) -> Any:
    """What a document says, of plain types.

    Raises:
        YamlError: It is none, nested too deeply, or a value is not what its tag says.
    """
    with _yaml_errors(text):
        _check_depth(text)
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
        return yaml.SafeLoader("").construct_object(node)
    except (yaml.YAMLError, *_STUMBLES) as error:
        raise YamlError(" ".join(str(error).split()), node.start_mark.line + 1) from error


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
        if error.context and error.context_mark:
            what += f" ({error.context} of line {_line(error.context_mark)})"
        lines = text.count("\n") + 1  # libyaml has a text without a last newline end in a line of its own
        raise YamlError(what, min(_line(error.problem_mark), lines)) from error


def _line(mark: Any) -> int:
    """Counted from 1."""
    return mark.line + 1 if mark else 1
