"""Texts from outside that enter files which other programs obey: units, rules of udev, launch and layout files.

A line break in a unit begins a setting of its own, a quote ends a match of udev, `*` in a rule means every device. So
each such text is of a kind, and what is not of it is refused with the name of its field. Quoting is the writer's task.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable

from fulmar_core.config.errors import ConfigError, shortened

NAME, USER, LINE = "name", "user", "line"
LONGEST_LINE = 4096  # of a path: PATH_MAX [characters]
_KINDS = {  # what fits, and how to say it
    NAME: (
        re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}"),
        "begin with a letter, a digit or '_', and have only these, '.' and '-', 64 at most",
    ),
    # useradd(8). A number would be an id, which systemd takes as such.
    USER: (
        re.compile(r"[a-z_][a-z0-9_-]{0,31}"),
        "be a user's name: small letters, digits, '_' and '-', no digit first, 32 at most",
    ),
    LINE: (
        re.compile(rf".{{0,{LONGEST_LINE}}}", re.DOTALL),
        f"be one line of printable characters, {LONGEST_LINE} at most",
    ),
}
# Controls, marks that nobody sees or that turn the order of reading, halves of characters, line separators.
_UNPRINTED = {"Cc", "Cf", "Cs", "Zl", "Zp"}


def check_written(field: str, text: str, kind: str) -> str:
    """Refuse a text that would mean more than itself in a file.

    Args:
        field: Where it comes from, for the message: an option, a variable of the environment, a key of a file.
        text: What was given.
        kind: `NAME` (of a file, a device, a group), `USER`, or `LINE`: anything that a writer can quote.

    Returns:
        The text.

    Raises:
        ConfigError: With the field, what was found, and what is allowed.
    """
    allowed, words = _KINDS[kind]
    if not allowed.fullmatch(text) or any(unicodedata.category(letter) in _UNPRINTED for letter in text):
        raise ConfigError(f"{field} = {shortened(ascii(text))} must {words}.")
    return text


def check_lines(texts: Iterable[tuple[str, str | None]]) -> None:
    """Refuse the first of some fields that is no `LINE`; those without a text are left out. Raises ConfigError."""
    for field, text in texts:
        if text is not None:
            check_written(field, text, LINE)
