"""YAML as libyaml reads it, where there is one: ten times as fast as PyYAML's own reader.

PyYAML's bridge to libyaml builds what is nested by calling itself in C, where nothing counts how deep: a file of `[[[[`
would end the process. So depth is looked at first, event by event.
"""

from __future__ import annotations

from typing import Any

import yaml
from yaml.nodes import Node

DEEPEST = 100  # levels; a configuration has five
_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class TooDeep(yaml.YAMLError):
    """Lists and mappings within one another, more than `DEEPEST` of them."""

    def __init__(self) -> None:
        """Say so."""
        super().__init__(f"is nested too deeply: at most {DEEPEST} levels are read")


def compose(text: str) -> Node | None:
    """The nodes of a document, None if it is empty.

    Raises:
        yaml.YAMLError: It is no YAML, told with the line as PyYAML's own reader has it, or `TooDeep`.
    """
    try:
        _check_depth(text)
        root: Node | None = yaml.compose(text, Loader=_LOADER)
    except TooDeep:
        raise
    except yaml.YAMLError:
        return yaml.compose(text, Loader=yaml.SafeLoader)  # it knows better what was amiss, and where
    return root


def load(text: str) -> Any:
    """What a document says, of plain types.

    Raises:
        yaml.YAMLError: It is no YAML, or `TooDeep`.
    """
    _check_depth(text)
    loader = _LOADER(text)
    try:
        return loader.get_single_data()
    finally:
        loader.dispose()


def _check_depth(text: str) -> None:
    depth = 0
    for event in yaml.parse(text, Loader=_LOADER):
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > DEEPEST:
            raise TooDeep
