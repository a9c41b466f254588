"""The envelope guard that a node's settings ask for."""

from __future__ import annotations

import math
from collections.abc import Sequence

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.classical import check_pair
from fulmar_core.loop.controller_settings import ENVELOPE, ControllerSettings
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.envelope.braking import floats
from fulmar_core.safety.envelope.guard import EnvelopeGuard
from fulmar_core.safety.envelope.lean.guard import RolloutGuard
from fulmar_core.safety.envelope.lean.rooms import rollouts_of
from fulmar_core.safety.geofence import NO_AREA
from fulmar_core.tasks import load_task


def envelope_of(robot: Robot, settings: ControllerSettings) -> EnvelopeGuard | None:
    """The guard of a robot; None where none is asked for, or nothing says how such a robot stops.

    An area asks for one that keeps the robot in it; `guard: envelope` for one that keeps it within the geofence, too,
    and stops a robot for good that does not answer its commands as the guard believes. Without both it only stops a
    robot whose controller may not act any more. Boats, wheels and wings have one where it is asked for by its name.

    Args:
        robot: The robot.
        settings: Of its controller.

    Raises:
        ConfigError: The guard is asked for by its name and this robot cannot have it.
    """
    named = settings.guard == ENVELOPE
    if named:
        check_guard(robot)
    if not floats(robot):
        return _by_rollouts(robot, settings) if named else None
    try:
        return EnvelopeGuard(
            robot,
            settings.control_rate(robot),
            area=tuple(settings.area),
            geofence=robot.limits.geofence if named else math.inf,
            notices=named,
            sees_obstacles=named,
            watches=watches_envelope(robot, settings.guard, settings.area),
        )
    except ConfigError:
        if named:
            raise
        return None  # no law holds a pose of it: its valves close, as those of any robot do


def _by_rollouts(robot: Robot, settings: ControllerSettings) -> RolloutGuard:
    """The guard of a boat, of wheels or of wings; a geofence of aircraft is about the path that they follow."""
    made = rollouts_of(robot)
    fenced = made is not None and made.fenced(load_task(settings.task))
    return RolloutGuard(
        robot,
        settings.control_rate(robot),
        area=tuple(settings.area),
        geofence=robot.limits.geofence if fenced else math.inf,
    )


def watches_envelope(robot: Robot, guard: str, area: Sequence[float]) -> bool:
    """Whether an envelope guard may take over from a robot's controller.

    Args:
        robot: The robot.
        guard: As in `ControllerSettings`.
        area: Same [m].
    """
    if not floats(robot):
        return guard == ENVELOPE and rollouts_of(robot) is not None
    return guard == ENVELOPE or tuple(area) != NO_AREA


def check_guard(robot: Robot, area: Sequence[float] = NO_AREA) -> None:
    """Refuse the envelope guard for robots that nothing says of how they stop, or that no law can stop.

    Args:
        robot: The robot.
        area: As in `ControllerSettings` [m].

    Raises:
        ConfigError: The robot is one of these, or an aircraft that cannot turn within its area.
    """
    if floats(robot):
        return
    made = rollouts_of(robot)
    if made is None:
        raise ConfigError(
            f"guard '{ENVELOPE}' is for robots that float and are pushed by valves or fans, boats with propellers, "
            f"robots on wheels, and aircraft; '{robot.name}' is none of them. Run it without --guard."
        )
    for task in made.tasks:
        try:
            check_pair(robot, load_task(task))
        except ConfigError as error:
            raise ConfigError(f"guard '{ENVELOPE}' has no backup for '{robot.name}': {error}") from error
    made.check(robot, tuple(area))
