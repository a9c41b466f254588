"""The classical laws, and the tasks that each does; a family of actuators names the one that drives it in the plane.

The explicit table. Another law is one file here and one entry below.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names, config_path
from fulmar_core.config.strict_yaml import load_config
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
    rounded,
)
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
from fulmar_core.robots.actuators.families import FAMILIES
from fulmar_core.robots.actuators.pushing import WRENCH, Pushing
from fulmar_core.robots.robot import Robot
from fulmar_core.tasks import Task

POSITIONS = ("go_to_position", "go_to_position_with_obstacles", "go_through_positions", "race_waypoints")
POSES = ("go_to_pose", "go_through_poses", "race_wayposes")
VELOCITIES = ("track_velocities",)
IN_SPACE = (
    "go_to_position_3d", "go_to_pose_3d", "go_through_positions_3d", "go_through_poses_3d", "track_velocities_3d",
)  # fmt: skip
HOLDS = ("hold_attitude", "hold_airspeed")
FLIGHTS = ("follow_reference", *HOLDS)


@dataclass(frozen=True)
class Entry:
    """One line of the table."""

    law: type[Law]
    gains: type[Any]  # what its YAML is read into
    tasks: tuple[str, ...]  # kinds that it does
    defaults: Callable[[Robot], Any] | None = None  # gains of a robot without a YAML; None: it needs one
    others: Mapping[str, type[Law]] = field(default_factory=dict)  # by kinds of tasks, in the place of `law`
    draws: bool = False  # noise, by the field `seed` of its gains; see `Law.seeds`

    def law_of(self, task: Task) -> type[Law]:
        """The class that does a task."""
        return self.others.get(task.kind, self.law)


LAWS = {
    "lqr": Entry(Lqr, LqrWeights, POSITIONS + POSES + VELOCITIES, lqr_weights),
    "polar": Entry(Polar, PolarGains, POSITIONS + POSES + VELOCITIES, polar_gains),
    "line_of_sight": Entry(
        LineOfSight, LineOfSightGains, POSITIONS + POSES + VELOCITIES, line_of_sight_gains
    ),
    # No law here parks a car.
    "pure_pursuit": Entry(PurePursuit, PurePursuitGains, POSITIONS + VELOCITIES, pure_pursuit_gains),
}

# Laws beside that of the family, by their own names.
OTHERS = {
    "mpc": ("thrusters", Entry(Mpc, MpcGains, ("go_to_pose",))),
    "lqr_drift": ("thrusters", Entry(LqrDrift, DriftWeights, ("go_to_pose",))),
}

# Laws of bodies in space, whose states are `SpatialState`; the first one is that of every family.
SPACE_LAWS = {
    "lqr": Entry(SpaceLqr, SpaceLqrWeights, IN_SPACE, space_lqr_weights),
    "pd": Entry(SpacePd, SpacePdGains, IN_SPACE, space_pd_gains),
}
# Laws of satellites that reaction wheels turn; the first one is that of the family.
ATTITUDE_LAWS = {
    "lqr": Entry(AttitudeLqr, AttitudeLqrWeights, ("point",), attitude_lqr_weights),
    "pd": Entry(AttitudePd, AttitudePdGains, ("point",), attitude_pd_gains),
    "adaptive": Entry(AdaptiveAttitude, AttitudePdGains, ("point",), attitude_pd_gains),
}
# Laws of aircraft; the first one is that of the family.
FLIGHT_LAWS = {
    "lqi": Entry(FlightLqi, FlightWeights, FLIGHTS, flight_lqi_weights, dict.fromkeys(HOLDS, FlightHold)),
    "lqr": Entry(FlightLqr, FlightWeights, FLIGHTS, flight_lqr_weights, dict.fromkeys(HOLDS, FlightHoldLqr)),
    "mppi": Entry(FlightMppi, MppiSettings, ("follow_reference",), mppi_settings, draws=True),
    "pid": Entry(FlightPid, FlightPidGains, ("follow_reference",), flight_pid_gains),
}
LAWS_BEYOND_PLANE = {"free_flyer": SPACE_LAWS, "satellite": ATTITUDE_LAWS, "aircraft": FLIGHT_LAWS}  # by kind
FLYING_FAMILIES = tuple(kind for kind, each in FAMILIES.items() if each.flies)
TURNING_FAMILIES = tuple(kind for kind, each in FAMILIES.items() if each.turns_only)
SPACE_FAMILIES = tuple(kind for kind, each in FAMILIES.items() if issubclass(each, Pushing) and each.one_way)


BEYOND_PLANE = {**FLIGHT_LAWS, **SPACE_LAWS, **ATTITUDE_LAWS}  # names of laws for bodies in space


def is_in_space(robot: Robot) -> bool:
    """Whether a robot's laws are those of `laws_in_space`."""
    return robot.kind.name in LAWS_BEYOND_PLANE


def laws_in_space(robot: Robot) -> dict[str, Entry]:
    """Laws of a body in space: those that fly it, that push it, or that only turn it."""
    return LAWS_BEYOND_PLANE[robot.kind.name]


def families_of(law: str | None) -> tuple[str, ...]:
    """Families of actuators that a law is for; with None those that any law is for."""
    if law in OTHERS:
        return (OTHERS[law][0],)
    if law in BEYOND_PLANE and law not in LAWS:
        tables = (
            (SPACE_LAWS, SPACE_FAMILIES),
            (ATTITUDE_LAWS, TURNING_FAMILIES),
            (FLIGHT_LAWS, FLYING_FAMILIES),
        )
        return tuple(family for laws, families in tables if law in laws for family in families)
    return tuple(kind for kind, each in FAMILIES.items() if each.law and law in (None, each.law))


def entry_of(robot: Robot, law: str | None) -> Entry:
    """The line of a law, or of the robot's family; `check_pair` says whether it is for this robot.

    Raises:
        ConfigError: No law is for actuators of this kind.
    """
    if is_in_space(robot):
        laws = laws_in_space(robot)
        return laws.get(law or "", next(iter(laws.values())))
    if law in OTHERS:
        return OTHERS[law][1]
    if law in BEYOND_PLANE and law not in LAWS:
        return BEYOND_PLANE[law]
    if robot.actuators.law not in LAWS:
        raise ConfigError(
            f"no classical law is for '{robot.name}' ({robot.actuators.kind}); there is one for: "
            f"{', '.join(families_of(None))}. "
            "Use --controller policy, or your own: --controller mypackage.mymodule:MyController."
        )
    return LAWS[robot.actuators.law]


def check_pair(robot: Robot, task: Task, *, law: str | None = None) -> None:
    """Reject a robot and a task that no classical law, or not the named one, is for.

    Raises:
        ConfigError: With what would be allowed.
    """
    _check_space(robot, law)
    family, families = robot.actuators.kind, families_of(law)
    entry = entry_of(robot, law)
    if family not in families:
        raise ConfigError(
            f"controller '{law}' is for robots with {' or '.join(families)}; '{robot.name}' has {family}. "
            "Use --controller classical."
        )
    if task.state_type is not robot.state_type:
        theirs = ("space", "the plane") if is_in_space(robot) else ("the plane", "space")
        raise ConfigError(
            f"'{robot.name}' moves in {theirs[0]}, '{task.name}' is a task in {theirs[1]}. "
            f"Choose one of: {', '.join(entry.tasks)}."
        )
    if task.kind not in entry.tasks:
        raise ConfigError(
            f"no classical law does '{task.name}' on '{robot.name}' ({family}); there is one for: "
            f"{', '.join(entry.tasks)}. Use --controller policy, which `fulmar train {robot.name} {task.name}` makes."
        )
    if is_in_space(robot) and isinstance(robot.actuators, Pushing):
        try:
            check_allocation(robot.actuators, WRENCH)
        except ValueError as error:
            raise ConfigError(f"no classical law is for '{robot.name}': {error}") from error
    if _find_gains(robot, entry) is None:
        gains_of(robot, law)


def _check_space(robot: Robot, law: str | None) -> None:
    """Reject a law for robots in the plane on a body in space, and the other way round.

    Raises:
        ConfigError: With what would be allowed.
    """
    in_plane, space = (*LAWS, *OTHERS), is_in_space(robot)
    fitting = laws_in_space(robot) if space else in_plane
    if law in fitting or law not in (*in_plane, *BEYOND_PLANE):
        return
    here, there = ("floats in space", "in the plane") if robot.kind.stops else ("flies", "elsewhere")
    if not space:
        here, there = "moves in the plane", "in space"
    raise ConfigError(
        f"controller '{law}' is for robots with {' or '.join(families_of(law))} {there}; '{robot.name}' {here}. "
        f"Use --controller {' or '.join(fitting) if space else 'classical'}."
    )


def has_law(robot: Robot, task: Task) -> bool:
    """Whether there is a classical law for a pair."""
    if is_in_space(robot):
        families = (*FLYING_FAMILIES, *TURNING_FAMILIES, *SPACE_FAMILIES)
        first = next(iter(laws_in_space(robot).values()))
        return task.kind in first.tasks and robot.actuators.kind in families
    entry = LAWS.get(robot.actuators.law)
    return entry is not None and task.kind in entry.tasks


def load_classical(
    robot: Robot, task: Task, *, control_hz: float | None = None, law: str | None = None, seed: int = 0
) -> Law:
    """The law for a robot and a task, with the gains that `gains_of` finds.

    Args:
        robot: The robot.
        task: The task.
        control_hz: Command rate; the robot's own by default [Hz].
        law: Name of the law; by default the one of the robot's family, called "classical".
        seed: Of the noise of a law that draws any; added to the one of its gains.

    Raises:
        ConfigError: No law for the pair, no gains for this robot, a mistake in them, or a rate that the physics
            cannot keep.
    """
    check_pair(robot, task, law=law)
    entry = entry_of(robot, law)
    gains = gains_of(robot, law)
    if seed and entry.draws:
        gains = replace(gains, seed=gains.seed + seed)
    try:
        return entry.law_of(task)(robot, task, gains, control_hz=control_hz, name=law or "classical")
    except ValueError as error:
        hz = control_hz or robot.timing.control_hz
        raise ConfigError(f"{entry.law.law} for '{robot.name}' at {hz:g} Hz: {error}") from error


def gains_of(robot: Robot, law: str | None = None) -> Any:
    """Gains of a law for a robot: those of `configs/controllers/<robot>_<law>.yaml`, or the default ones without it.

    Args:
        robot: The robot.
        law: Name of the law; any other name and None mean the one of the robot's family.

    Raises:
        ConfigError: A mistake in the file, no file where the law has no default gains, or a robot whose actuators
            cannot do what they are computed for.
    """
    entry = entry_of(robot, law)
    path = _find_gains(robot, entry)
    if path is not None:
        return load_config(entry.gains, path)
    assert entry.defaults is not None
    try:
        return rounded(entry.defaults(robot))
    except ValueError as error:
        raise ConfigError(f"no default gains of '{entry.law.law}' for '{robot.name}': {error}") from error


def gains_path(robot: Robot, law: str | None = None) -> Path | None:
    """The file with the gains of a law for a robot; None where default gains are used; rest as of `gains_of`."""
    return _find_gains(robot, entry_of(robot, law))


def default_gains_note(robot: Robot, law: str | None = None) -> str:
    """Note on a robot that drives with default gains; empty where it has a file; rest as of `gains_of`."""
    if gains_path(robot, law) is not None:
        return ""
    name = entry_of(robot, law).law.law
    return (
        f"no gains file: default gains of '{name}', computed from the limits of '{robot.name}'. "
        f"controllers/{robot.name}_{name}.yaml would take their place."
    )


def _find_gains(robot: Robot, entry: Entry) -> Path | None:
    """The file with a law's gains for a robot; None where it has none and the law has default gains."""
    name = f"{robot.name}_{entry.law.law}"
    if name in config_names("controllers"):
        return config_path("controllers", name)
    if entry.defaults is None:
        others = [each for each in config_names("controllers") if each.endswith(f"_{entry.law.law}")]
        raise ConfigError(
            f"no gains of '{entry.law.law}' for '{robot.name}'. Write configs/controllers/{name}.yaml, or "
            f"controllers/{name}.yaml beside robots/ of your own, as {config_path('controllers', others[0])} is."
        )
    return None
