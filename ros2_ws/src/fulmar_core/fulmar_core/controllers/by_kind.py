"""The tables of controllers by kind of robot: classical laws, and what excites a robot for identification.

Another law is one file here and one entry below.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.allocation import check_allocation
from fulmar_core.controllers.attitude_lqr import AttitudeLqr, AttitudeLqrWeights, attitude_lqr_weights
from fulmar_core.controllers.attitude_pd import (
    AdaptiveAttitude,
    AttitudePd,
    AttitudePdGains,
    attitude_pd_gains,
)
from fulmar_core.controllers.default_gains import (
    line_of_sight_gains,
    lqr_weights,
    polar_gains,
    pure_pursuit_gains,
)
from fulmar_core.controllers.excite import Excite, ExciteInSpace
from fulmar_core.controllers.excite_wheels import ExciteWheels
from fulmar_core.controllers.flight_hold import FlightHold, FlightHoldLqr
from fulmar_core.controllers.flight_lqi import (
    FlightLqi,
    FlightLqr,
    FlightWeights,
    flight_lqi_weights,
    flight_lqr_weights,
)
from fulmar_core.controllers.flight_mppi import FlightMppi, MppiSettings, mppi_settings
from fulmar_core.controllers.flight_pid import FlightPid, FlightPidGains
from fulmar_core.controllers.flight_pid_gains import flight_pid_gains
from fulmar_core.controllers.law import Law
from fulmar_core.controllers.line_of_sight import LineOfSight, LineOfSightGains
from fulmar_core.controllers.lqr import Lqr, LqrWeights
from fulmar_core.controllers.lqr_drift import DriftWeights, LqrDrift
from fulmar_core.controllers.mpc import Mpc, MpcGains
from fulmar_core.controllers.polar import Polar, PolarGains
from fulmar_core.controllers.pure_pursuit import PurePursuit, PurePursuitGains
from fulmar_core.controllers.space_gains import space_lqr_weights, space_pd_gains
from fulmar_core.controllers.space_lqr import SpaceLqr, SpaceLqrWeights
from fulmar_core.controllers.space_pd import SpacePd, SpacePdGains
from fulmar_core.robots.actuators.families import FAMILIES, row_of
from fulmar_core.robots.actuators.pushing import WRENCH, Pushing
from fulmar_core.robots.kinds import KINDS
from fulmar_core.robots.robot import Robot
from fulmar_core.tasks import Task

PLACES = ("go_to_position", "go_to_position_with_obstacles", "go_through_positions", "race_waypoints")
IN_PLANE = (*PLACES, "go_to_pose", "go_through_poses", "race_wayposes", "track_velocities")
IN_SPACE = (
    "go_to_position_3d", "go_to_pose_3d", "go_through_positions_3d", "go_through_poses_3d", "track_velocities_3d",
    "follow_pose_3d", "inspect", "dock",
)  # fmt: skip
HOLDS = ("hold_attitude", "hold_airspeed")
FLIGHTS = ("follow_reference", *HOLDS)


def _any_robot(robot: Robot) -> None:
    """Most laws take every robot of their families."""


def _one_way(robot: Robot) -> None:
    check_allocation(robot.actuated_by(Pushing), WRENCH)


@dataclass(frozen=True)
class Entry:
    """One law."""

    law: type[Law]
    gains: type[Any]  # what its YAML is read into
    tasks: tuple[str, ...]  # kinds that it does
    defaults: Callable[[Robot], Any] | None = None  # gains of a robot without a YAML; None: it needs one
    others: Mapping[str, type[Law]] = field(default_factory=dict)  # by kinds of tasks, in the place of `law`
    draws: bool = False  # noise, by the field `seed` of its gains; see `Law.seeds`
    check: Callable[[Robot], None] = _any_robot  # raises ValueError for a robot that it cannot drive

    def law_of(self, task: Task) -> type[Law]:
        """The class that does a task."""
        return self.others.get(task.kind, self.law)


_LQR = Entry(Lqr, LqrWeights, IN_PLANE, lqr_weights)
_PUSHED = {
    "lqr": Entry(SpaceLqr, SpaceLqrWeights, IN_SPACE, space_lqr_weights, check=_one_way),
    "pd": Entry(SpacePd, SpacePdGains, IN_SPACE, space_pd_gains, check=_one_way),
}
# By kind of robot and family of its actuators, or a base of some, each by the name that it is chosen by; the first one
# is the usual.
LAWS: dict[str, dict[str, dict[str, Entry]]] = {
    "planar": {
        "thrusters": {
            "lqr": _LQR,
            "mpc": Entry(Mpc, MpcGains, ("go_to_pose",)),
            "lqr_drift": Entry(LqrDrift, DriftWeights, ("go_to_pose",)),
        },
        "one_way": {"lqr": _LQR},
        "propellers": {"line_of_sight": Entry(LineOfSight, LineOfSightGains, IN_PLANE, line_of_sight_gains)},
    },
    "rolling": {
        "differential_drive": {"polar": Entry(Polar, PolarGains, IN_PLANE, polar_gains)},
        # No law here parks a car.
        "ackermann": {
            "pure_pursuit": Entry(
                PurePursuit, PurePursuitGains, (*PLACES, "track_velocities"), pure_pursuit_gains
            )
        },
    },
    "free_flyer": {"one_way": _PUSHED},
    "satellite": {
        "reaction_wheels": {
            "lqr": Entry(AttitudeLqr, AttitudeLqrWeights, ("point",), attitude_lqr_weights),
            "pd": Entry(AttitudePd, AttitudePdGains, ("point",), attitude_pd_gains),
            "adaptive": Entry(AdaptiveAttitude, AttitudePdGains, ("point",), attitude_pd_gains),
        }
    },
    "aircraft": {
        "control_surfaces": {
            "lqi": Entry(
                FlightLqi, FlightWeights, FLIGHTS, flight_lqi_weights, dict.fromkeys(HOLDS, FlightHold)
            ),
            "lqr": Entry(
                FlightLqr, FlightWeights, FLIGHTS, flight_lqr_weights, dict.fromkeys(HOLDS, FlightHoldLqr)
            ),
            "mppi": Entry(FlightMppi, MppiSettings, ("follow_reference",), mppi_settings, draws=True),
            "pid": Entry(FlightPid, FlightPidGains, ("follow_reference",), flight_pid_gains),
        }
    },
}
EVERY = {
    name: entry for families in LAWS.values() for laws in families.values() for name, entry in laws.items()
}

# Random commands crash robots of any other kind.
_EXCITING: dict[str, type[Excite] | type[ExciteWheels]] = {
    "planar": Excite,
    "rolling": Excite,
    "free_flyer": ExciteInSpace,
    "satellite": ExciteWheels,
}


def laws_of(robot: Robot) -> dict[str, Entry]:
    """Laws that drive a robot, by name, the usual one first.

    Raises:
        ConfigError: No law is for actuators of this kind.
    """
    laws = row_of(LAWS[robot.kind.name], type(robot.actuators))
    if laws is None:
        raise ConfigError(
            f"no classical law is for '{robot.name}' ({robot.actuators.kind}); of {robot.kind.plural} there is one "
            f"for: {', '.join(_laws_by_family(robot.kind.name))}. "
            "Use --controller policy, or your own: --controller mypackage.mymodule:MyController."
        )
    return laws


def _laws_by_family(kind: str) -> dict[str, dict[str, Entry]]:
    """Laws of a kind, by every family that has some."""
    rows = ((name, row_of(LAWS[kind], family)) for name, family in FAMILIES.items())
    return {name: laws for name, laws in rows if laws is not None}


def driven_by(law: str) -> str:
    """Robots that a law is for, in words."""
    kinds = {kind: [family for family, laws in _laws_by_family(kind).items() if law in laws] for kind in LAWS}
    return ", ".join(
        f"{KINDS[kind].plural} with {' or '.join(families)}" for kind, families in kinds.items() if families
    )


def exciting(robot: Robot) -> type[Excite] | type[ExciteWheels]:
    """The class of the controller `excite` for a robot.

    Raises:
        ConfigError: There is none.
    """
    if robot.kind.name not in _EXCITING:
        raise ConfigError(
            f"controller 'excite' is not for {robot.kind.plural} such as '{robot.name}': random commands crash it."
        )
    return _EXCITING[robot.kind.name]
