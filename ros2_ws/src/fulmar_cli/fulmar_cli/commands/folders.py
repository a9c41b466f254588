"""Names of the folders that commands write, by the time and by what is in them."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fulmar_bringup.run_plan import RunPlan


def recorded(plan: RunPlan) -> RunPlan:
    """A complete plan with a folder for its bag, which is named after what runs; one that was given stays."""
    return replace(plan, record=plan.record or str(dated_folder("runs", plan.robot_name, plan.controller)))


def dated_folder(parent: str, *names: str) -> Path:
    """A new folder, named by the time and by what is in it; of a class of one's own the module is left out."""
    return Path(
        parent, "_".join((time.strftime("%Y%m%d_%H%M%S"), *(name.rpartition(":")[2] for name in names)))
    )
