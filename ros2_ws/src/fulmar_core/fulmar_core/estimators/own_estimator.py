"""A user's own estimator, loaded by its dotted path: `mypackage.mymodule:MyEstimator`, see docs/own-estimator.md.

It is made as `MyEstimator(robot, settings)`, and has `reset()`, `take(name, reading)` and `estimate(stamp_ns)` as in
`estimators.motion.estimator.Estimator`. Its settings are the mapping in the YAML file of the same name beside its
module, empty without such a file.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from fulmar_core.config.errors import ConfigError, did_you_mean
from fulmar_core.config.own_class import construct, load_class, settings_beside
from fulmar_core.estimators.motion.estimator import Estimate
from fulmar_core.estimators.motion.settings import EstimatorSettings
from fulmar_core.robots.robot import Robot
from fulmar_core.states.state import RigidBodyState
from fulmar_core.wires.reading import Reading

MEMBERS = ("takes", "reset", "take", "estimate")
MOTION = 12  # numbers of a covariance: place, attitude, velocity and turn rate, of three axes each
SILENT = "no estimate yet"
BRIDGE_S = 0.5  # where the class says nothing [s]


def own_class(path: str) -> type[Any]:
    """The class.

    Raises:
        ConfigError: It cannot be loaded, or lacks a member.
    """
    return load_class(path, members=MEMBERS, what="estimator")


def own_settings(path: str) -> EstimatorSettings:
    """What the node asks of an estimator's settings: how long it bridges, `bridge_s` of the class."""
    cls = own_class(path)
    try:
        return EstimatorSettings(
            title=path,
            bridge_s=float(getattr(cls, "bridge_s", BRIDGE_S)),
            latency_s=float(getattr(cls, "latency_s", 0.0)),
        )
    except (TypeError, ValueError) as error:
        raise ConfigError(f"estimator '{path}': {error}") from None


def own_takes(path: str, attribute: str, known: Iterable[str], *, strict: bool = True) -> tuple[str, ...]:
    """Names of readings that a class lists in `takes` or `takes_if_there`.

    Args:
        path: Dotted path of the class.
        attribute: `takes` or `takes_if_there`.
        known: Names that there are.
        strict: Whether to refuse others, which are left out else.

    Raises:
        ConfigError: One is not known.
    """
    given, known = getattr(own_class(path), attribute, ()), tuple(known)
    names = (given,) if isinstance(given, str) else tuple(given)
    if not strict:
        return tuple(name for name in names if name in known)
    for name in names:
        if name not in known:
            raise ConfigError(
                f"estimator '{path}': '{attribute}' has '{name}'. Known: {', '.join(known)}."
                f"{did_you_mean(str(name), known)}"
            )
    return names


class OwnEstimator:
    """A user's class behind the interface of estimators; what it leaves out has a default.

    Attributes:
        outliers: See `Estimator`; the user's own, or 0.
        epoch: See `Estimator`; how often it was reset.
        problem: See `Estimator`; the user's own where there is no estimate.
    """

    def __init__(self, path: str, robot: Robot) -> None:
        """Make one.

        Raises:
            ConfigError: The class cannot be loaded, lacks a member, or its constructor raises.
        """
        cls = own_class(path)
        call = "MyEstimator(robot, settings)"
        self._own = construct(cls, call, "estimator", robot, settings_beside(cls))
        self.outliers, self.epoch, self.problem = 0, 0, SILENT

    def reset(self) -> None:
        """Begin anew; see `Estimator.reset`."""
        self.epoch, self.problem = self.epoch + 1, SILENT
        self._own.reset()

    def take(self, name: str, reading: Reading) -> str | None:
        """Take a reading in; see `Estimator.take`."""
        refusal = self._own.take(name, reading)
        self.outliers = int(getattr(self._own, "outliers", 0))
        return None if refusal is None else str(refusal)

    def status(self) -> dict[str, str]:
        """See `Estimator.status`."""
        return {str(name): str(value) for name, value in self._asked("status", dict).items()}

    def warnings(self) -> tuple[str, ...]:
        """See `Estimator.warnings`."""
        return tuple(map(str, self._asked("warnings", tuple)))

    def estimate(self, stamp_ns: int | None = None) -> Estimate | None:
        """See `Estimator.estimate`.

        Raises:
            TypeError: It is no `Estimate` of a `RigidBodyState` with finite numbers and a covariance.
        """
        found = self._own.estimate(stamp_ns)
        self.problem = str(getattr(self._own, "problem", "") or SILENT) if found is None else ""
        if found is None:
            return None
        if not isinstance(found, Estimate) or not isinstance(found.value, RigidBodyState):
            raise TypeError("estimate() has to return an Estimate of a RigidBodyState, or None")
        if np.shape(found.covariance) != (MOTION, MOTION):
            raise TypeError(f"the covariance of an estimate has to have shape ({MOTION}, {MOTION})")
        its = found.value
        parts = (its.position_in_world, its.quat_xyzw, its.velocity_in_world, its.angular_velocity_in_body)
        if not all(np.isfinite(part).all() for part in (*parts, found.covariance)):
            raise TypeError("an estimate has a number that is not finite")
        return found

    def _asked(self, name: str, empty: Callable[[], Any]) -> Any:
        method = getattr(self._own, name, None)
        return method() if callable(method) else empty()
