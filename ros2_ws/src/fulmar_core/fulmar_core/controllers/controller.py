"""The interface of controllers: a function from the inputs of one control step to an actuator command."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Generic, Protocol

import numpy as np

from fulmar_core.estimators.actuator_health.actuator_estimator import ActuatorEstimate
from fulmar_core.estimators.actuator_health.filters import HealthSettings
from fulmar_core.states.state import S
from fulmar_core.tasks.goal import Goal

INERTIA = "inertia"  # name of what an inertia estimator says: tensor of one robot, shape (3, 3) [kg·m²]
Readings = Mapping[str, np.ndarray]


@dataclass(frozen=True, slots=True)
class Inputs(Generic[S]):
    """Inputs of one control step, of n robots side by side; a node controls one, n = 1.

    Arrays are NumPy's, of float64. Lengths are in metres, angles in radians, and the frame is the odometry's.
    """

    state: S  # as measured, shapes (n,)
    goal: Goal  # with every target; `goal.current` (n, 3) is the one that counts now
    observation: np.ndarray  # terms of the task and the robot, in the order of `Observer.names`, shape (n, k)
    previous: np.ndarray  # command of the step before, after every limit, shape (n, m)
    estimates: ActuatorEstimate | None  # of an estimator that the controller asks for; None without one
    stamp_ns: int  # when the state was measured, on the plant's clock [ns]
    dt: float  # time of one control step [s]
    # Of what the controller names in `readings`, the newest, by the name of its sensor or estimator, shape (n, k): of
    # `wheels` the speeds of reaction wheels [rad/s]; `inertia`, see `INERTIA`. What is not measured, or is too old, is
    # not there.
    readings: Readings = field(default_factory=dict)
    believed: S | None = None  # of the controller's `observer`; None without one


class StateObserver(Protocol[S]):
    """What a controller believes of the state, from what is measured and what it commanded."""

    def reset(self) -> None:
        """Forget the past."""
        ...

    def update(self, measured: S, previous: np.ndarray) -> S:
        """The believed state after a measurement.

        Args:
            measured: State of n robots, shapes (n,).
            previous: Command of the step before, shape (n, m).
        """
        ...


class Controller(Protocol):
    """One interface for learned and classical controllers, on the robot and in evaluation.

    Attributes:
        name: Under which it was chosen.
        control_hz: How often it is asked [Hz].
        estimator: Settings of the actuator estimator whose estimate it wants among its inputs; None for none.
        observer: Makes the believed state that it acts on; None: it acts on the measured one. The control loop runs it,
            and its node publishes what it says.
        readings: What it wants to find in `Inputs.readings`: names of sensors of the robot, and of what estimators say.
    """

    name: str
    control_hz: float
    estimator: HealthSettings | None
    readings: tuple[str, ...]
    observer: StateObserver[Any] | None

    def reset(self) -> None:
        """Forget everything about the past: a new goal, a new episode, or time jumped."""
        ...

    def act(self, inputs: Inputs) -> np.ndarray:
        """Choose a command.

        A controller that remembers anything does so for each robot by itself, until `reset` or another number of them.

        Args:
            inputs: Of n robots.

        Returns:
            One value for each actuator, in the robot's order and units, shape (n, m).
        """
        ...

    def metadata(self) -> dict[str, Any]:
        """Identity of the controller, as JSON-ready values with a `sha256` of whatever defines its behaviour."""
        ...
