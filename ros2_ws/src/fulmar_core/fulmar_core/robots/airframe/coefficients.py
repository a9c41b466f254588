"""Aerodynamic coefficients as sums of terms: derivative sets, polynomials and look-up tables are one form.

A file names each term by its factors, such as `1`, `alpha`, `alpha^2 elevator` or `q`. Angles are in the file's unit;
`p`, `q`, `r` and `alphadot` are dimensionless: p b / 2V, q c / 2V, r b / 2V and α̇ c / 2V; `alphadot` is the one factor
of its terms. Axes are those of flight mechanics: x ahead, y right, z down; lift and drag are along the wind's.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from fulmar_core.config.errors import did_you_mean
from fulmar_core.states.arrays import clip, is_number, is_numpy
from fulmar_core.states.rotation import Array

NAMES = ("CL", "CD", "CY", "Cl", "Cm", "Cn")
SURFACES = ("elevator", "aileron", "rudder")
ANGLES = ("alpha", "beta", *SURFACES)
ALPHADOT = "alphadot"
RATES = ("p", "q", "r", ALPHADOT)
FACTORS = (*ANGLES, *RATES)
Factors = tuple[tuple[str, int], ...]  # with their powers
Term = tuple[float, Factors]
Flow = Mapping[str, Array]  # factors by name: angles [rad], rates dimensionless, shapes (...,)


@dataclass(frozen=True)
class Curve:
    """A look-up table over the angle of attack: linear between points, and on beyond the last ones."""

    alpha: tuple[float, ...]  # increasing, in the file's unit
    value: tuple[float, ...]  # [-]

    def __post_init__(self) -> None:
        if len(self.alpha) != len(self.value) or len(self.alpha) < 2:
            raise ValueError("'alpha' and 'value' need as many numbers each, two at least.")
        if any(b <= a for a, b in zip(self.alpha, self.alpha[1:], strict=False)):
            raise ValueError("'alpha' must increase.")

    def at(self, alpha: Array) -> Array:
        """Value, shape (...,); a sum of hinges, which every array library computes alike."""
        x, y = self.alpha, self.value
        slopes = [(y[i + 1] - y[i]) / (x[i + 1] - x[i]) for i in range(len(x) - 1)]
        found = y[0] + slopes[0] * (alpha - x[0])
        for corner, before, after in zip(x[1:-1], slopes, slopes[1:], strict=False):
            if after != before:
                found = found + (after - before) * clip(alpha - corner, 0.0, None)
        return found


@dataclass(frozen=True)
class Coefficients:
    """Six coefficients as the terms of a file.

    Signs of surfaces are normalised here: in Fulmar a positive elevator lowers the nose (trailing edge down), a
    positive aileron lowers the right wing, a positive rudder turns the nose to the left (trailing edge left). A source
    with other signs has −1 in `signs`, and its numbers stay as it prints them.
    """

    unit: Literal["deg", "rad"]  # of angles in `terms` and `tables`
    terms: dict[str, dict[str, float]] = field(hash=False)  # by coefficient, number by factors
    tables: dict[str, Curve] = field(default_factory=dict, hash=False)  # by coefficient, added to its terms
    signs: dict[str, float] = field(
        default_factory=dict, hash=False
    )  # of the source's surfaces; +1 where left out
    # Angles of attack that the terms are for, in the unit; beyond them coefficients go on in a straight line.
    alpha_range: tuple[float, float] | None = None
    alpha_zero: float = 0.0  # what `alpha` is counted from, in the unit
    elevator_zero: float = 0.0  # same of `elevator`, in the source's sign

    def __post_init__(self) -> None:
        for where in (self.terms, self.tables):
            for name in where:
                if name not in NAMES:
                    raise ValueError(
                        f"coefficient '{name}' is not known. Known: {', '.join(NAMES)}.{did_you_mean(name, NAMES)}"
                    )
        for name, sign in self.signs.items():
            if name not in SURFACES or abs(sign) != 1.0:
                raise ValueError(f"'signs' takes 1 or -1 for {', '.join(SURFACES)}, found {name}: {sign:g}.")
        if self.alpha_range is not None and self.alpha_range[0] >= self.alpha_range[1]:
            raise ValueError("'alpha_range' must be [low, high] with low < high.")
        parsed = {name: self._terms_of(name) for name in NAMES}
        object.__setattr__(self, "_parsed", parsed)
        object.__setattr__(self, "_plans", (_Plan(parsed, slopes=False), _Plan(parsed, slopes=True)))

    def _terms_of(self, name: str) -> tuple[Term, ...]:
        return tuple((number, _powers(words)) for words, number in self.terms.get(name, {}).items())

    @property
    def parsed(self) -> dict[str, tuple[Term, ...]]:
        """Terms of each coefficient, angles in the file's unit and the source's signs."""
        return self._parsed  # type: ignore[attr-defined, no-any-return]

    def scaled_flow(self, flow: Flow) -> dict[str, Array]:
        """Factors in the file's unit, signs and origin; those that are missing count as 0."""
        per = math.degrees(1.0) if self.unit == "deg" else 1.0
        own = {}
        for name, value in flow.items():
            if name in SURFACES:
                value = self.signs.get(name, 1.0) * per * value
            elif name in ANGLES:
                value = per * value
            own[name] = value
        own["alpha"] = own["alpha"] - self.alpha_zero
        if "elevator" in own:
            own["elevator"] = own["elevator"] - self.elevator_zero
        return own

    def at(self, flow: Flow) -> dict[str, Array]:
        """Coefficients by name, shapes (...,).

        Args:
            flow: Factors; `alpha` and `beta` at least.
        """
        own = self.scaled_flow(flow)
        alpha, beyond = own["alpha"], None
        if self.alpha_range is not None:
            low, high = (end - self.alpha_zero for end in self.alpha_range)
            own["alpha"] = clip(alpha, low, high)
            beyond = alpha - own["alpha"]
            if beyond == 0.0 if is_number(beyond) else is_numpy(beyond) and not beyond.any():
                beyond = None  # but what is traced has no numbers yet
        plans: tuple[_Plan, _Plan] = self._plans  # type: ignore[attr-defined]
        inside, outside = plans
        found = inside.sums(own, alpha) if beyond is None else outside.sums(own, alpha, beyond)
        for name, table in self.tables.items():
            found[name] = found[name] + table.at(alpha + self.alpha_zero)
        return found


class _Plan:
    """The sums of terms, compiled: each product of factors is computed once, from a shorter one and a factor."""

    def __init__(self, parsed: Mapping[str, tuple[Term, ...]], *, slopes: bool) -> None:
        """List the products that terms need, and with `slopes` their derivatives by the angle of attack."""
        self._numbers: dict[Factors, int] = {(): 0}  # of each product
        self._steps: list[
            tuple[int, str]
        ] = []  # the shorter product, and the factor that is multiplied to it
        self._terms = {
            name: [
                (
                    number,
                    self._number(factors),
                    [
                        (slope, self._number(rest))
                        for slope, rest in (slopes_of(number, factors) if slopes else ())
                    ],
                )
                for number, factors in terms
            ]
            for name, terms in parsed.items()
        }

    def _number(self, factors: Factors) -> int:
        if factors not in self._numbers:
            name, power = factors[-1]
            shorter = self._number((*factors[:-1], *(((name, power - 1),) if power > 1 else ())))
            self._steps.append((shorter, name))
            self._numbers[factors] = len(self._steps)
        return self._numbers[factors]

    def sums(self, own: Mapping[str, Array], alpha: Array, beyond: Array = None) -> dict[str, Array]:
        """Each coefficient without its table, shapes (...,).

        Args:
            own: Factors as `Coefficients.scaled_flow` gives them.
            alpha: Angle of attack, of whose shape the sums are.
            beyond: How far it lies out of the range of the terms; only a plan with slopes takes it.
        """
        products: list[Any] = [1.0]
        for shorter, name in self._steps:
            value = own.get(name, 0.0)
            products.append(products[shorter] * value if shorter else value)
        sums = {}
        for name, terms in self._terms.items():
            found = 0.0 * alpha
            for number, product, slopes in terms:
                found = found + number * products[product]
                if slopes:
                    for slope, rest in slopes:
                        found = found + beyond * slope * products[rest]
            sums[name] = found
        return sums


def slopes_of(number: float, factors: Factors) -> tuple[Term, ...]:
    """Derivative of a term by the angle of attack, as terms; none where it does not depend on it."""
    return tuple(
        (number * power, (*factors[:at], *(((factor, power - 1),) if power > 1 else ()), *factors[at + 1 :]))
        for at, (factor, power) in enumerate(factors)
        if factor == "alpha"
    )


def _powers(words: str) -> Factors:
    """Factors of a term such as `alpha^2 elevator`; none for `1`.

    Raises:
        ValueError: A factor is not known, its power is no whole number of 1 or more, or one goes with `alphadot`.
    """
    found: dict[str, int] = {}
    for word in () if words.strip() == "1" else words.split():
        name, hat, power = word.partition("^")
        if name not in FACTORS:
            raise ValueError(
                f"factor '{name}' of the term '{words}' is not known. Known: {', '.join(FACTORS)}, and '1' for a "
                f"number alone.{did_you_mean(name, FACTORS)}"
            )
        if hat and (not power.isdigit() or int(power) < 1):
            raise ValueError(f"the term '{words}': a power must be a whole number of 1 or more.")
        found[name] = found.get(name, 0) + (int(power) if hat else 1)
    if ALPHADOT in found and found != {ALPHADOT: 1}:
        raise ValueError(f"the term '{words}': '{ALPHADOT}' stands alone, since its terms are solved for.")
    return tuple(found.items())
