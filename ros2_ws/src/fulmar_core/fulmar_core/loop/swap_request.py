"""Requests to change the controller of a running robot, and their answers, as the wires have them."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from fulmar_core.config.errors import ConfigError, did_you_mean

KEYS = ("id", "controller", "bundle", "by")
LONGEST_PATH = 4096  # characters of a bundle's folder, as of any path
LONGEST_NAME = 200  # of a controller, an id, or who asks [characters]
Id = str | int


@dataclass(frozen=True)
class SwapRequest:
    """One request."""

    text: str  # as it came
    id: Id = ""  # that the answer repeats; empty: a plain folder came
    controller: str = ""  # by its name; empty: that of `bundle`
    bundle: str = ""  # folder on the robot's disk
    by: str = ""  # who asks, as it says itself

    @property
    def what(self) -> str:
        """What is asked for, in words."""
        return self.controller or self.bundle

    def to_text(self) -> str:
        """As the wire has it."""
        chosen = {"controller": self.controller} if self.controller else {"bundle": self.bundle}
        return json.dumps({"id": self.id, **chosen, "by": self.by})


@dataclass(frozen=True)
class SwapResult:
    """The answer to one request."""

    id: Id
    accepted: bool
    reason: str
    controller: str = ""
    bundle: str = ""
    by: str = ""
    sha256: str = ""  # of what controls from now on
    stamp_ns: int = 0  # of the first measurement that it answers; 0: it has not taken over yet [ns]

    def to_text(self) -> str:
        """As the wire has it."""
        return json.dumps(vars(self))


def read_request(text: str) -> SwapRequest:
    """A request from the text of the wire: a JSON object, or the folder of a bundle alone.

    Raises:
        ConfigError: It is neither, with what is allowed.
    """
    if not text.lstrip().startswith("{"):
        if not 0 < len(text) <= LONGEST_PATH:
            raise ConfigError(f"a folder has 1 to {LONGEST_PATH} characters, found {len(text)}")
        return SwapRequest(text, bundle=text)
    found = _object(text)
    for key in found:
        if key not in KEYS:
            raise ConfigError(f"a request has no key '{key[:LONGEST_NAME]}'.{did_you_mean(key, KEYS)}")
    name, bundle = (_words(found, "controller", LONGEST_NAME), _words(found, "bundle", LONGEST_PATH))
    if bool(name) == bool(bundle):
        raise ConfigError("a request has either 'controller', a name, or 'bundle', a folder")
    by = _words(found, "by", LONGEST_NAME)
    return SwapRequest(text, request_id(text), controller=name, bundle=bundle, by=by)


def request_id(text: str) -> Id:
    """Id of a request, also of one that is refused; empty where it has none that an answer can repeat."""
    try:
        found = _object(text).get("id", "")
    except ConfigError:
        return ""
    fits = type(found) is int or (isinstance(found, str) and len(found) <= LONGEST_NAME)
    return found if fits else ""


def read_result(text: str) -> SwapResult | None:
    """An answer from the text of the wire; None for what is none."""
    try:
        found = _object(text)
        return SwapResult(**{key: found[key] for key in SwapResult.__dataclass_fields__ if key in found})
    except (ConfigError, TypeError):
        return None


def _object(text: str) -> dict[str, Any]:
    if len(text) > 2 * LONGEST_PATH:
        raise ConfigError(f"a request has at most {2 * LONGEST_PATH} characters, found {len(text)}")
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise ConfigError('a request is a JSON object such as {"id": 1, "controller": "lqr", "by": "me"}')
    return found


def _words(found: dict[str, Any], key: str, longest: int) -> str:
    value = found.get(key, "")
    if not isinstance(value, str) or len(value) > longest or not value.isprintable():
        raise ConfigError(f"'{key}' of a request is a text of at most {longest} printable characters")
    return value
