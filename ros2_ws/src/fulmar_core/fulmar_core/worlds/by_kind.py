"""The table of disturbances by kind of robot: what of a scenario acts on it, so that none is run without effect."""

from __future__ import annotations

from collections.abc import Callable

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names
from fulmar_core.robots.robot import Robot
from fulmar_core.worlds.parts import Air, InertiaChange, Slope, Solar, Tether
from fulmar_core.worlds.scenario import Scenario, load_scenario
from fulmar_core.worlds.stuck import candidates_of

# Entries of a scenario's file that act on some kinds only, by kind.
_FLOOR = ("push.force", "push.torque", "wave", "kick", "tether", "slope")
ACTING: dict[str, tuple[str, ...]] = {
    "planar": _FLOOR,
    "rolling": _FLOOR,
    "free_flyer": ("push.force", "push.torque", "kick", "orbit_rate"),
    "satellite": ("push.torque", "orbit_rate", "solar", "inertia", "gyroscope"),
    "aircraft": ("push.force", "push.torque", "kick", "air"),
}
# What every kind may meet together with others: a scenario of them fits where one acts.
_COMMON: dict[str, Callable[[Scenario], bool]] = {
    "push.force": lambda its: its.push.force > 0.0,
    "push.torque": lambda its: its.push.torque > 0.0,
    "wave": lambda its: max(its.wave.force, its.wave.torque) > 0.0,
    "kick": lambda its: its.kick.force > 0.0,
    "body": lambda its: its.body == "uncertain",
    "actuation": lambda its: (
        max(its.actuation.noise, its.actuation.delay_s, its.actuation.failures) > 0.0
        or its.actuation.gain != (1.0, 1.0)
        or its.actuation.supply.left < 1.0
    ),
    "odometry": lambda its: (
        (its.sensing.noise, its.sensing.bias) != (1.0, 1.0)
        or max(its.sensing.delay_s, its.sensing.dropout) > 0.0
        or its.sensing.blurred
    ),
}
# What a scenario is made for: each has to act.
_OWN: dict[str, Callable[[Scenario], bool]] = {
    "tether": lambda its: its.tether != Tether(),
    "slope": lambda its: its.slope.milliradians != Slope().milliradians,
    "orbit_rate": lambda its: its.orbit_rate > 0.0,
    "solar": lambda its: its.solar != Solar(),
    "air": lambda its: its.air != Air(),
    "inertia": lambda its: its.inertia != InertiaChange(),
    "morphology": lambda its: its.body == "morphology",
    "gyroscope": lambda its: its.sensing.gyroscope != 1.0 or its.sensing.gyroscope_dies_s is not None,
    "bearing": lambda its: max(its.bearing_late_s[1], its.held_s[1]) > 0.0,
    "valves": lambda its: its.actuation.opening_delay_s[1] > 0.0,
    "tank": lambda its: its.actuation.supply.tank < 1.0,
    "stuck": lambda its: bool(its.actuation.stuck.actuators),
    "link": lambda its: its.link.acts,
}


def without_effect(robot: Robot, scenario: Scenario, *, estimated: bool = False) -> tuple[str, ...]:
    """Entries of a scenario for the sake of which it is none for a robot; empty: it acts.

    Args:
        robot: The robot.
        scenario: What may disturb it.
        estimated: Whether an estimator reads its gyroscope.
    """
    acts = {
        *ACTING.get(robot.kind.name, ACTING["free_flyer"]), "body", "actuation", "link",
        *(("gyroscope",) if estimated else ()),
        *(() if robot.kind.always_estimated else ("odometry",)),
        *(("bearing",) if robot.air_bearing else ()),
        *(("morphology",) if robot.morphology is not None else ()),
        *(("valves",) if robot.actuators.opens_late else ()),
        *(("tank",) if robot.actuators.tank is not None else ()),
        *(("stuck",) if _sticks(robot, scenario) else ()),
    }  # fmt: skip
    own = [name for name, has in _OWN.items() if has(scenario)]
    common = [name for name, has in _COMMON.items() if has(scenario)]
    if own:
        return tuple(name for name in own if name not in acts)
    return () if acts.intersection(common) else tuple(common)


def check_scenario(robot: Robot, name: str, *, estimated: bool = False) -> None:
    """Refuse a scenario that does not act on a robot.

    Raises:
        ConfigError: It does not, or is unknown; with those that do.
    """
    scenario = load_scenario(name)
    lost = without_effect(robot, scenario, estimated=estimated)
    if not lost:
        return
    fitting = [other for other in config_names("scenarios") if _fits(robot, other, estimated=estimated)]
    raise ConfigError(
        f"scenario '{name}' ({scenario.title}) is not for '{robot.name}', one of the {robot.kind.plural}: "
        f"{', '.join(lost)} would have no effect. Scenarios that fit: {', '.join(fitting)}."
    )


def _fits(robot: Robot, name: str, *, estimated: bool) -> bool:
    """Whether a scenario acts on a robot; one whose file is broken does not."""
    try:
        return not without_effect(robot, load_scenario(name), estimated=estimated)
    except ConfigError:
        return False


def _sticks(robot: Robot, scenario: Scenario) -> bool:
    """Whether it has the parts that are to stick."""
    try:
        candidates_of(robot, scenario.actuation.stuck)
    except ConfigError:
        return False
    return True
