"""How far an estimator of the actuators' health trusts its model and its measurements."""

from __future__ import annotations

from dataclasses import dataclass, fields

MAY_BE_0 = ("held", "retry_s")


@dataclass(frozen=True)
class Suspicion:
    """Standard deviations and chances; our values, chosen on the conditions of the DRIFT benchmark."""

    position: float = 0.0015  # of a measured coordinate [m]
    heading: float = 0.003  # [rad]
    velocity: float = 0.03  # of a measured velocity; uniform ± 0.04 m/s are 0.023 m/s [m/s]
    yaw_rate: float = 0.03  # [rad/s]
    model_force: float = 0.087  # of what the model leaves out, anew at each step [N]
    model_torque: float = 0.035  # same [N·m]
    push_force: float = 0.3  # of a force from outside at the beginning [N]
    push_torque: float = 0.05  # same [N·m]
    drift_force: float = 0.06  # of its change in one second; an uneven floor changes with the place [N]
    drift_torque: float = 0.003  # same [N·m]
    failure: float = 0.02  # chance that an actuator is lost, before anything is seen [-]
    change: float = 1e-3  # chance that what is lost changes, in one second [-]
    # Evidence that the body is held rather than its valves dead, as log-likelihood: two dead valves are 8, and a hold
    # is rarer than they are. 0: it is never taken for held [-].
    held: float = 12.0
    # A valve that is believed dead is opened once more after so long, and again after twice as long: a trial of a dead
    # valve costs one opening without effect. 0: never [s].
    retry_s: float = 6.0
    surprise: float = 16.0  # largest weight of one measurement against a hypothesis, as log-likelihood [-]

    def __post_init__(self) -> None:
        """Refuse what no filter exists for."""
        if min(getattr(self, field.name) for field in fields(self) if field.name not in MAY_BE_0) <= 0.0:
            raise ValueError(
                "every number of a suspicion must be greater than 0; 'held' and 'retry_s' may be 0."
            )
        if min(getattr(self, name) for name in MAY_BE_0) < 0.0:
            raise ValueError("'held' and 'retry_s' must not be negative.")
        if max(self.failure, self.change) >= 0.5:
            raise ValueError("'failure' and 'change' must be less than one half.")
