"""Controllers that estimate the health of their actuators: what they receive before a step, and what they believe."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from fulmar_core.controllers.controller import Controller
from fulmar_core.health.applied import Applied, AppliedHistory
from fulmar_core.health.thruster_health import Health


@runtime_checkable
class ActuatorObserver(Protocol):
    """A controller with an observer that compares actuators with motion; `Controller` itself does not ask for it."""

    @property
    def health(self) -> Health | None:
        """The estimate that the last `act` used, of the observation's leading shape; None where there is none."""
        ...

    def see_applied(self, applied: Applied | None) -> None:
        """Receive what the actuators did since the last observation, right before `act`.

        Without this call the observer takes the controller's own command for it.

        Args:
            applied: For one robot; None where it is not known, and nothing can be learned from the motion.
        """
        ...


def report_applied(controller: Controller, applied: Applied | None) -> None:
    """Give a controller's observer, if it has one, what the actuators did since its last observation."""
    if isinstance(controller, ActuatorObserver):
        controller.see_applied(applied)


def health_of(controller: Controller) -> Health | None:
    """The estimate of the actuators' health that a controller used last; None where it estimates none."""
    return controller.health if isinstance(controller, ActuatorObserver) else None


class AppliedFeed:
    """What the actuators did from one observation to the next, by the stamps of `actuators/state`.

    Attributes:
        history: Takes every message of `actuators/state`.
    """

    def __init__(self, pause_ns: int, hold_ns: int) -> None:
        """Begin with the next observation.

        Args:
            pause_ns: After a longer gap between two observations nothing is known of it [ns].
            hold_ns: As of `AppliedHistory` [ns].
        """
        self._pause_ns = pause_ns
        self.history = AppliedHistory(hold_ns)
        self.forget()

    def forget(self) -> None:
        """Begin with the next observation."""
        self._observed_ns = 0

    def lacks(self, stamp_ns: int, answered_ns: int) -> bool:
        """Whether the state of the actuators is still to come that a lock-stepped plant publishes before a measurement.

        Args:
            stamp_ns: Of the measurement [ns].
            answered_ns: Of the measurement before, which a command has answered; -1 without one [ns].
        """
        return 0 < stamp_ns - answered_ns <= self._pause_ns and self.history.newest_ns < answered_ns

    def since_observation(self, stamp_ns: int) -> Applied | None:
        """What was applied since the last call, until a measurement; None where it is not known.

        Args:
            stamp_ns: Of the measurement [ns].
        """
        before, self._observed_ns = self._observed_ns, stamp_ns
        return self.history.between(before, stamp_ns) if stamp_ns - before <= self._pause_ns else None
