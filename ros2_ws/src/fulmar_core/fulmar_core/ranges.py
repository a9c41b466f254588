"""What numbers of a configuration may be; what is not is refused by its name."""

from __future__ import annotations


def positive(**numbers: float) -> None:
    """Refuse numbers that are not greater than 0.

    Raises:
        ValueError: Names the first such number.
    """
    for name, number in numbers.items():
        if number <= 0.0:
            raise ValueError(f"'{name}' must be greater than 0.")


def at_least_1(**sizes: int | tuple[int, ...]) -> None:
    """Refuse sizes, or lists of them, that are less than 1.

    Raises:
        ValueError: Names the first such size.
    """
    for name, size in sizes.items():
        if min(size if isinstance(size, tuple) else (size,), default=1) < 1:
            raise ValueError(f"'{name}' must be at least 1.")


def shares(**numbers: float) -> None:
    """Refuse numbers outside of (0, 1].

    Raises:
        ValueError: Names the first such number.
    """
    for name, number in numbers.items():
        if not 0.0 < number <= 1.0:
            raise ValueError(f"'{name}' must lie in (0, 1].")
