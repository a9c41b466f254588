"""A page's side of the console's source: it asks, waits for the answer, and reads what is known."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from fulmar_console.source import Answer
from tests.ros.neighbour import until

Do = Callable[[dict[str, Any], Answer, str], None]


@dataclass(frozen=True)
class Answered:
    """What a page got back: whether it was done, words, and after how long [s]."""

    accepted: bool
    words: str
    after_s: float


class Page:
    """One page. `do` is that of a source, or of its orders."""

    def __init__(self, do: Do, robot: str, name: str = "page 1") -> None:
        self._do, self.robot, self.name = do, robot, name

    def send(self, do: str, **fields: Any) -> list[Answered]:
        """Ask; the list has the answer once it is there."""
        answered: list[Answered] = []
        began_s = time.monotonic()

        def take(accepted: bool, words: str) -> None:
            answered.append(Answered(accepted, words, time.monotonic() - began_s))

        self._do({"do": do, "robot": self.robot, **fields}, take, self.name)
        return answered

    def ask(self, do: str, *, within_s: float = 30.0, **fields: Any) -> Answered:
        """Ask, and wait for the answer."""
        answered = self.send(do, **fields)
        until(lambda: bool(answered), within_s)
        return answered[0]
