"""How fast actuators follow their commands, the same numbers for every family."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Response:
    """From a command to what an actuator does; 0 or nothing switches a part off."""

    delay_s: float = 0.0  # before anything happens; of valves that open late at most one control step [s]
    slew: tuple[float, ...] = ()  # fastest change of each actuator, in its command's unit [per s]
    lag_s: float = 0.0  # time constant of a first-order lag [s]
    opening_delay_s: float = 0.0  # by which closed valves open later than others close [s]
    gain: tuple[float, ...] = ()  # applied over commanded, of each actuator; empty: 1 [-]

    def __post_init__(self) -> None:
        if min(self.delay_s, self.lag_s, self.opening_delay_s) < 0.0:
            raise ValueError("delay_s, lag_s and opening_delay_s must not be negative.")
        if any(rate <= 0.0 for rate in (*self.slew, *self.gain)):
            raise ValueError("every slew and every gain must be greater than 0.")

    def refuse_lag_beside_slew(self) -> None:
        """Reject a lag beside a slew; only the servos of wheels have both.

        Raises:
            ValueError: Both are given.
        """
        if self.slew and self.lag_s > 0.0:
            raise ValueError("give 'slew' or 'lag_s', not both: what slews has no lag here.")

    @property
    def latest_s(self) -> float:
        """Until the latest command acts [s]."""
        return self.delay_s + self.opening_delay_s

    @property
    def remembers(self) -> bool:
        """Whether what an actuator does depends on more than the newest command."""
        return bool(self.slew) or self.lag_s > 0.0
