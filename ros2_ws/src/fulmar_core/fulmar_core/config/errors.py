"""Errors that a person can act on, and the helpers that they share."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

LONGEST_NAME = 64  # that is quoted whole [characters]


class FulmarError(Exception):
    """A mistake or fault with a one-line message: where, found, allowed, what next."""


class ConfigError(FulmarError):
    """A configuration file or an argument is wrong."""


class ImplausibleError(ConfigError):
    """A configuration file can be read, and has values that nothing real has."""


class UnknownNameError(ConfigError):
    """A name that is not in a closed set, reported with the nearest known one."""

    def __init__(self, what: str, name: str, known: Iterable[str]) -> None:
        known = sorted(known)
        super().__init__(f"unknown {what} '{name}'.{did_you_mean(name, known)}")
        self.name = name
        self.known = known


class BundleError(FulmarError):
    """A policy bundle is damaged, or does not fit the robot, the task or the rate."""


class TaskError(ConfigError):
    """A user's own task raised, or returned what no task returns."""


class SafetyError(FulmarError):
    """A safety limit is set to something that would not protect."""


class LockstepError(FulmarError):
    """The other side of a lock-stepped pair did not answer in time."""


class RunFailed(FulmarError):  # noqa: N818 - it is an outcome, not a mistake of the caller
    """A run did not come to its planned end."""


class DeviceError(FulmarError):
    """A real device is not there, or does not answer."""


class BagError(FulmarError):
    """A bag cannot be read, or lacks what was asked of it."""


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Hint for an unknown name: the nearest known one, else all of them.

    Returns:
        A sentence that begins with a space, ready to be appended to a message.
    """
    known = sorted(known)
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.6)
    if near:
        return f" Did you mean '{near[0]}'?"
    return f" Known: {', '.join(known) if known else 'none'}."


def shortened(text: str) -> str:
    """A name from outside as messages for people quote it: what is too long to be a name is cut."""
    return text if len(text) <= LONGEST_NAME else f"{text[:LONGEST_NAME]}…"


DONE, FAILED, BAD_USAGE = 0, 1, 2
