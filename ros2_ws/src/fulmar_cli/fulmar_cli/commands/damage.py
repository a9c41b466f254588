"""Damage of bags: every command that reads bags warns of it and ends with exit code 1."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from fulmar_bringup.console import warn
from fulmar_core.config.errors import DONE, FAILED

if TYPE_CHECKING:
    from fulmar_bags.bag_reading import BagReading
    from fulmar_bags.contents import Bag


def open_and_warn(path: Path, reading: BagReading | None = None) -> Bag:
    """Open a bag, and warn of parts that could not be read.

    Raises:
        BagError: As `open_bag`.
    """
    from fulmar_bags.bag_reading import AS_IT_IS
    from fulmar_bags.contents import open_bag

    bag = open_bag(path, reading or AS_IT_IS)
    warn(bag.warnings)
    return bag


def finish(*bags: Bag, good: bool = True) -> typer.Exit:
    """The end of a command: done only if it found nothing wrong, and every bag was read whole."""
    return typer.Exit(DONE if good and not any(bag.warnings for bag in bags) else FAILED)
