"""The outcome of one check of `fulmar doctor`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal

Level = Literal["ok", "advice", "wrong"]


@dataclass(frozen=True)
class Finding:
    """Result of one check, and the command that repairs it."""

    what: str
    level: Level  # advice: it works, but worse than it could; wrong: it does not work
    found: str
    fix: str = ""  # a command; empty only where nothing has to be done

    @property
    def ok(self) -> bool:
        """Whether it works."""
        return self.level != "wrong"

    def as_dict(self) -> dict[str, Any]:
        """For JSON; `ok`, `warning` and `advice` say the same as `level` and `fix`, for scripts of before."""
        now = {"what": self.what, "level": self.level, "found": self.found, "fix": self.fix}
        return now | {"ok": self.ok, "warning": self.level == "advice", "advice": self.fix}


def healthy(findings: Iterable[Finding]) -> bool:
    """Whether nothing is wrong."""
    return all(finding.ok for finding in findings)
