"""Which commands bring up a wanted wrench, for every family that pushes one way."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from fulmar_core.actuators.pushing import Pushing
from fulmar_core.controllers.opening_allocation import OpeningAllocation
from fulmar_core.controllers.thrust_allocation import ThrustAllocation
from fulmar_core.controllers.valve_allocation import ValveAllocation
from fulmar_core.rotation import Array


class Allocation(Protocol):
    """From wrenches to commands."""

    def best(self, wanted: Array, alive: Array | None = None, dearer: Array | None = None) -> Array:
        """Commands with the least weighted error and price.

        Args:
            wanted: Wrench [F_x, F_y, M_z] in the body frame, shape (..., 3) [N, N, N·m].
            alive: 1, or 0 for actuators that are dead, shape (..., n); all live by default.
            dearer: Cost of each actuator at full command beyond the usual one, shape (...,); none by default.

        Returns:
            Shape (..., n).
        """
        ...


def allocation_of(actuators: Pushing, *, weight: np.ndarray, cost: float) -> Allocation:
    """The allocation for a family.

    Args:
        actuators: On/off ones, those that share a supply by degrees, or any others that push one way by degrees.
        weight: Cost of a wrench error [F_x, F_y, M_z], symmetric positive definite, shape (3, 3).
        cost: Of each actuator at full command, >= 0.

    Raises:
        ValueError: They do not push one way.
    """
    if not actuators.one_way:
        raise ValueError(
            f"wrenches are allocated to actuators that push one way; {actuators.kind} push both."
        )
    if actuators.binary:
        return ValveAllocation(actuators, weight=weight, valve_cost=cost)
    if actuators.shared_pressure:
        return OpeningAllocation(actuators, weight=weight, valve_cost=cost)
    return ThrustAllocation(actuators, weight=weight, cost=cost)
