"""The shape of a benchmark: cells that are measured once and kept, figures beside limits, tables and plots."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from importlib import import_module
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, ClassVar

from fulmar_benchmarks.tables import Shown
from fulmar_core.config.errors import RunFailed

if TYPE_CHECKING:
    from fulmar_evaluation.report.page import Part

# Where a cell is measured; `ros`: on the workers of `ros_pool`; `here`: in this process, also where there is a cluster.
POOL, ALONE, ROS, HERE = "pool", "alone", "ros", "here"
Choice = SimpleNamespace  # what one run is asked for, by the names of `catalogue.Row.selectors` and `catalogue.SHARED`
Figures = dict[str, Any]  # JSON-ready, but that values may be arrays
AGAIN = "again"  # key of figures that are not kept, as one of the runs in them failed
Found = Mapping[str, Figures | str]  # by name of a cell; a sentence where it could not be measured
Progress = Callable[[float], None]  # how much of the cost of a cell is done


@dataclass(frozen=True, kw_only=True)
class Cell(ABC):
    """What is run at once and kept in one file. Subclasses have the fields that tell cells apart."""

    modules: ClassVar[tuple[str, ...]] = ()  # whose code its figures depend on, beside those of its class
    name: str  # of its file, without suffix; different for each cell of a benchmark
    title: str = ""  # for people; its name by default
    cost: float = 1.0  # how long it takes, beside other cells
    where: str = POOL  # ALONE for what needs the whole computer, ROS for what runs on deployed nodes
    way: str = "batch"  # which packages its figures depend on, of `outcomes.PACKAGES`

    def parts(self) -> dict[str, Any]:
        """Everything that its figures depend on beside code, configuration and libraries."""
        return {key: value for key, value in asdict(self).items() if key not in OF_EVERY_CELL}

    @abstractmethod
    def measure(self, progress: Progress, pool: Any = None) -> Figures:
        """Measure it, in any process; a `ROS` cell gets the pool."""


OF_EVERY_CELL = tuple(each.name for each in fields(Cell))


@dataclass(frozen=True)
class Check:
    """One requirement and what was measured."""

    name: str
    measured: float | None  # None: not measured
    limit: float
    met: bool | None  # None: not measured
    better: str = "more"  # or less

    @classmethod
    def least(cls, name: str, measured: float | None, limit: float) -> Check:
        """More is better."""
        return cls(name, measured, limit, None if measured is None else measured >= limit)

    @classmethod
    def most(cls, name: str, measured: float | None, limit: float) -> Check:
        """Less is better."""
        return cls(name, measured, limit, None if measured is None else measured <= limit, "less")

    @property
    def line(self) -> str:
        """As it is printed."""
        found = "not measured" if self.measured is None else f"{self.measured:.4g}"
        sign = "at least" if self.better == "more" else "at most"
        met = {True: "met", False: "NOT MET", None: "open"}[self.met]
        return f"{met:8} {self.name}: {found} (required: {sign} {self.limit:.4g})"


class Benchmark(ABC):
    """One run of a benchmark. `campaign.run` measures, keeps, resumes and puts the document together.

    Attributes:
        name: As in `fulmar benchmark NAME`.
        title: Of its page.
        style: Rules of the page.
        report: Function that draws its plots, as `module:function`.
        width: Columns of its tables, where the output is not a terminal.
        choice: What is asked for.
    """

    name: ClassVar[str]
    title: str = ""
    style: str = ""
    report: str = ""
    width: int = 110

    def __init__(self, choice: Choice) -> None:
        """Of what is asked for, as `catalogue.choice` makes it."""
        self.choice = choice

    def check(self) -> None:  # noqa: B027 - most have nothing to refuse
        """Refuse what cannot be measured, before anything is.

        Raises:
            ConfigError: Where it was asked for something that does not exist.
        """

    @abstractmethod
    def cells(self) -> Sequence[Cell]:
        """What is run."""

    @abstractmethod
    def document(self, found: Found) -> dict[str, Any]:
        """Its keys of the document, JSON-ready."""

    def checks(self, document: Mapping[str, Any]) -> Sequence[Check]:
        """What is required, beside what was measured."""
        return ()

    def check_lines(self, document: Mapping[str, Any]) -> list[str]:
        """A line for each requirement."""
        return [check.line for check in self.checks(document)]

    @abstractmethod
    def tables(self, document: Mapping[str, Any]) -> Sequence[Shown]:
        """Lines and tables, of terminal and page alike."""

    def drawn(self, document: Mapping[str, Any], found: Found) -> tuple[Any, ...]:
        """What `report` gets."""
        return (document,)

    def plots(self, document: Mapping[str, Any], found: Found) -> Sequence[Part]:
        """What is drawn; called inside `house_style`."""
        module, _, name = self.report.partition(":")
        if not module:
            return ()
        parts: Sequence[Part] = getattr(import_module(module), name)(*self.drawn(document, found))
        return parts

    def conclusion(self, document: Mapping[str, Any]) -> str:
        """One sentence on what was required and met."""
        unmeasured = f", {document['open']} could not be measured" if document["open"] else ""
        return f"{document['met']} of {document['asked']} requirements are met{unmeasured}."

    def said(self, cell: Cell, figures: Figures) -> str:
        """What is said of a cell once it is measured."""
        return "measured"


def known(found: Found, name: str) -> Figures:
    """Figures of a cell.

    Raises:
        RunFailed: It could not be measured.
    """
    figures = found[name]
    if isinstance(figures, str):
        raise RunFailed(
            f"{name}: {figures}; what was measured is kept, and the same command goes on from there."
        )
    return figures


def tally(met: Iterable[bool | None]) -> dict[str, int]:
    """How many requirements there are, how many are met, and how many could not be measured."""
    every = list(met)
    return {
        "asked": len(every),
        "met": sum(one is True for one in every),
        "open": sum(one is None for one in every),
    }
