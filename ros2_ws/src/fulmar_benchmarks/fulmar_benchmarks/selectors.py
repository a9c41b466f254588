"""What a benchmark can be asked for: its options, and where it is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.config.paths import config_names

if TYPE_CHECKING:
    from fulmar_benchmarks.shape import Benchmark, Choice

CONFIGS = "configs/"  # how `Selector.known` begins where files are meant


@dataclass(frozen=True)
class Selector:
    """One option of a benchmark, named like its value in a choice unless `names` say otherwise."""

    name: str
    metavar: str
    help: str
    default: Any = None
    kind: Any = str
    least: float | None = None
    most: float | None = None
    family: str = ""  # its value is names of these, with commas between
    known: str = ""  # all of them: `module:NAME`, or `configs/FOLDER`
    usual: str = ""  # same, where nothing is given
    every: str = "all"  # stands for all of them
    nothing: str = ""  # stands for none of them
    without: tuple[str, ...] = ()  # of those known
    single: bool = False  # one of them alone
    as_given: bool = False  # the order of names is kept
    numbers: tuple[float, float] | None = (
        None  # its value is numbers from one to the other, with commas between
    )
    names: tuple[str, ...] = ()
    positional: bool = False

    def read(self, value: Any) -> Any:
        """The value of a choice, from what was given.

        Raises:
            ConfigError: What is wrong with it, and what is allowed.
        """
        if value is None and self.usual:
            return known_names(self.usual)
        if not isinstance(value, str):
            return value
        if self.numbers:
            return self._numbers(value, *self.numbers)
        if self.nothing and value == self.nothing:
            return ()
        if self.single:
            if value not in known_names(self.known):
                raise UnknownNameError(self.family, value, known_names(self.known))
            return value
        return read_names(value, self) if self.family else value

    def _numbers(self, text: str, low: float, high: float) -> tuple[float, ...]:
        try:
            values = tuple(float(part) for part in text.split(","))
        except ValueError:
            values = ()
        if not values or not all(low <= value <= high for value in values):
            raise ConfigError(
                f"--{self.name} = '{text}' must be numbers from {low:g} to {high:g}, with commas between."
            )
        return tuple(dict.fromkeys(values))


def known_names(place: str) -> tuple[str, ...]:
    """Names that `Selector.known` and `usual` stand for."""
    if place.startswith(CONFIGS):
        return tuple(config_names(place.removeprefix(CONFIGS)))
    module, _, name = place.partition(":")
    return tuple(getattr(import_module(module), name))


def read_names(text: str, selector: Selector) -> tuple[str, ...]:
    """Names with commas between them, in the order of those known, or as given.

    Raises:
        UnknownNameError: For the first that is not known.
        ConfigError: There is none.
    """
    known, every = known_names(selector.known), selector.every
    known = tuple(name for name in known if name not in selector.without)
    names = list(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    for name in names:
        if name not in (*known, every):
            raise UnknownNameError(selector.family, name, known)
    if not names:
        raise ConfigError(f"'{text}' names no {selector.family}; known: {', '.join(known)}, or {every}.")
    if selector.as_given and every not in names:
        return tuple(names)
    return tuple(name for name in known if name in names or every in names)


@dataclass(frozen=True)
class Row:
    """One benchmark."""

    name: str
    where: str  # its class, as `module:Class`
    help: str
    selectors: Sequence[Selector]
    needs: Callable[[Choice], Sequence[str]] = lambda choice: ()  # modules of extras
    shared: Sequence[str] = ("seed", "jobs", "ray", "resume", "report", "check")  # of SHARED, beside out
    always_checked: bool = False  # it ends with code 1 even without `--check`
    timed: bool = False  # its figures are times: they are measured again unless one says `--resume`
    dated: bool = False  # its folder is a new one each time: runs/benchmark/TIME_NAME
    measures: str = "measuring"  # beside the bar; empty: it has bars of its own

    def load(self) -> type[Benchmark]:
        """Import it."""
        module, _, name = self.where.partition(":")
        found: type[Benchmark] = getattr(import_module(module), name)
        return found
