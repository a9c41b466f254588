"""`fulmar benchmark console`: what the page costs, how soon it is there, and how surely its e-stop works."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fulmar_benchmarks.shape import ALONE, Benchmark, Cell, Check, Figures, Found, Progress

PARTS = ("server", "first", "latency", "stop", "unconfirmed", "bag")
CORES, BYTES_PER_S, FIRST_S, RATIO, LATE, OPEN_S = 0.15, 20_000.0, 3.0, 1.10, 0.0, 3.0


@dataclass(frozen=True, kw_only=True)
class ConsoleCell(Cell):
    """One part."""

    modules = (f"{__package__}.measures", f"{__package__}.systems", f"{__package__}.fleet")
    part: str
    rounds: int
    seconds: float
    robots: int
    folder: Path

    def parts(self) -> dict[str, Any]:
        """Not where bags lie."""
        return {"part": self.part, "rounds": self.rounds, "seconds": self.seconds, "robots": self.robots}

    def measure(self, progress: Progress, pool: Any = None) -> Figures:
        """As in `measures`."""
        from fulmar_benchmarks.console import measures

        folder = (self.folder / "runs").resolve()  # commands run elsewhere
        folder.mkdir(parents=True, exist_ok=True)
        ways: dict[str, Callable[[], Figures]] = {
            "server": lambda: measures.server_cost(folder, self.robots, 1, self.seconds),
            "first": lambda: measures.first_image(folder, self.rounds),
            "latency": lambda: measures.latency_pairs(folder, self.rounds, self.seconds),
            "stop": lambda: measures.stops(folder, self.rounds),
            "unconfirmed": lambda: measures.unconfirmed(folder, self.rounds),
            "bag": lambda: measures.bag_opening(folder, self.seconds),
        }
        return ways[self.part]()


class Console(Benchmark):
    """The operator's page, measured in a real browser."""

    name = "console"
    title = "The operator's page"

    def cells(self) -> list[ConsoleCell]:
        """One for each part."""
        choice = self.choice
        asked = {
            "server": (1, 20.0, choice.robots), "first": (choice.rounds, 0.0, 1), "latency": (choice.pairs, 25.0, 1),
            "stop": (choice.clicks, 0.0, 1), "unconfirmed": (choice.clicks, 0.0, 1), "bag": (1, 300.0, 3),
        }  # fmt: skip
        return [
            ConsoleCell(
                name=f"{part}_{rounds}_{seconds:g}_{robots}", part=part, rounds=rounds, seconds=seconds, robots=robots,
                folder=choice.out, where=ALONE, way="ros", cost=60.0,
            )
            for part, (rounds, seconds, robots) in asked.items() if part in choice.parts
        ]  # fmt: skip

    def document(self, found: Found) -> dict[str, Any]:
        """Figures of each part; a sentence where it could not be measured."""
        return {"console": {cell.part: found[cell.name] for cell in self.cells()}}

    def checks(self, document: Mapping[str, Any]) -> list[Check]:
        """What was asked for."""
        parts = document["console"]

        def figure(part: str, key: str) -> float | None:
            figures = parts.get(part)
            return float(figures[key]) if isinstance(figures, Mapping) else None

        clicks = figure("unconfirmed", "clicks")
        rows = {
            "server": [
                Check.most("processor time of the server [cores]", figure("server", "cores"), CORES),
                Check.most("bytes to a page [1/s]", figure("server", "bytes_per_s"), BYTES_PER_S),
            ],
            "first": [
                Check.most("time to the first image, median [s]", figure("first", "median_s"), FIRST_S)
            ],
            "latency": [
                Check.most("latency p99 with a page by that without", figure("latency", "ratio"), RATIO)
            ],
            "stop": [Check.most("clicks that took 300 ms or more", figure("stop", "late"), LATE)],
            "unconfirmed": [
                Check.least(
                    "clicks said to be NOT CONFIRMED", figure("unconfirmed", "not_confirmed"), clicks or 0.0
                )
            ],
            "bag": [
                Check.most("time until a bag of three robots is open [s]", figure("bag", "open_s"), OPEN_S),
                Check.most("requests while scrubbing", figure("bag", "requests_while_scrubbing"), 0.0),
            ],
        }
        return [check for part in parts for check in rows[part]]

    def tables(self, document: Mapping[str, Any]) -> list[str]:
        """A line for each requirement."""
        return self.check_lines(document)
