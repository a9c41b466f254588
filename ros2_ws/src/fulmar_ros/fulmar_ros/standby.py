"""A controller that is ready to act at the next step: loaded, checked, warm, with everything that goes with it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.controllers.controller import Controller

WARM_UP = 20  # the first inferences are slow; they happen before anything moves


@dataclass(frozen=True)
class Standby:
    """One controller and its company."""

    controller: Controller
    metadata: str  # JSON, ready to publish
    sha256: str


def ready(controller: Controller, *, said: dict[str, Any] | None = None) -> Standby:
    """Warm a controller up.

    Args:
        controller: Loaded and checked.
        said: What its metadata shall say beside what it says itself.
    """
    for _ in range(WARM_UP):
        controller.act(np.zeros(len(controller.observation_names)))
    controller.reset()
    metadata = {**controller.metadata(), **(said or {})}
    text = json.dumps(metadata, sort_keys=True)
    return Standby(controller, text, str(metadata.get("sha256", "")))
