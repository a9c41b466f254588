"""What the array API lacks, or what its wrappers make slow for the single states of a robot."""

from __future__ import annotations

from typing import Any

from fulmar_core.rotation import Array


def clip(x: Array, low: Any, high: Any) -> Array:
    """Values cut to [low, high]; None leaves an end open. A tenth of the wrapped function's cost on short arrays."""
    return x.clip(low, high)
