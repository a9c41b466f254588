"""The robot of a bag as it was calibrated when the bag was recorded."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator
from pathlib import Path

from fulmar_bags.contents import Bag
from fulmar_bringup.bag_origin import CALIBRATION
from fulmar_bringup.domains import environment
from fulmar_core.calibration import VARIABLE


@contextlib.contextmanager
def calibrated_as(bag: Bag) -> Iterator[None]:
    """Load robots, here and in children, with the calibration that a bag carries along, or with none if it has none."""
    with tempfile.TemporaryDirectory(prefix="fulmar_calibration_") as scratch:
        path = Path(scratch) / CALIBRATION
        carried = bag.attachments.get(CALIBRATION)
        if carried is not None:
            path.write_bytes(carried)
        with environment({VARIABLE: str(path) if carried is not None else ""}):
            yield
