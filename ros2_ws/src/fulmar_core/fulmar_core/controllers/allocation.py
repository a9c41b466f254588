"""Which commands bring up a wanted wrench, for every family that pushes one way."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from fulmar_core.controllers.opening_allocation import OpeningAllocation
from fulmar_core.controllers.thrust_allocation import ThrustAllocation
from fulmar_core.controllers.valve_allocation import ValveAllocation
from fulmar_core.robots.actuators.pushing import WRENCH, Pushing
from fulmar_core.states.rotation import Array


class Allocation(Protocol):
    """From wrenches to commands."""

    def best(self, wanted: Array, alive: Array | None = None, dearer: Array | None = None) -> Array:
        """Commands with the least weighted error and price.

        Args:
            wanted: Wrench in the body frame, shape (..., 3) as [F_x, F_y, M_z] in the plane, or (..., 6) [N, N·m].
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
        weight: Cost of a wrench error, symmetric positive definite, shape (3, 3) or (6, 6); columns as of
            `wrench_columns`.
        cost: Of each actuator at full command, >= 0.

    Raises:
        ValueError: As in `check_allocation`.
    """
    check_allocation(actuators, len(weight))
    if actuators.binary:
        return ValveAllocation(actuators, weight=weight, valve_cost=cost)
    if actuators.shared_pressure:
        return OpeningAllocation(actuators, weight=weight, valve_cost=cost)
    return ThrustAllocation(actuators, weight=weight, cost=cost)


def check_allocation(actuators: Pushing, numbers: int) -> None:
    """Refuse actuators to which no wrench of so many numbers, 3 or 6, can be allocated.

    Raises:
        ValueError: They do not push one way, or are valves that open by degrees on one line, in space.
    """
    if not actuators.one_way:
        raise ValueError(
            f"wrenches are allocated to actuators that push one way; {actuators.kind} push both."
        )
    if numbers == WRENCH and actuators.shared_pressure and not actuators.binary:
        raise ValueError(
            "valves that open by degrees on one line are for robots on a floor or on water; in space use on/off valves "
            "('continuous: false'), or none that share ('shared_pressure: false')."
        )
