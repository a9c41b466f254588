"""Identification of one robot from driven runs: the model of its family, what sets the scale, and the fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields

import numpy as np

from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.robots.calibration import Calibration, Measured
from fulmar_core.robots.robot import Robot
from fulmar_evaluation.identification.by_kind import MODELS
from fulmar_evaluation.identification.drives import Drive
from fulmar_evaluation.identification.fit import Estimate, Fit, fit
from fulmar_evaluation.identification.model import Known, Model, Unknown
from fulmar_evaluation.identification.platform import ballast_name

EXACT = 1e-6  # relative standard deviation of what is said to be known without an error
NO_MOTION = "the runs show nothing of the robot: it hardly moved. Drive it, as with --controller excite."
SIGMAS = 1.96  # half a 95 % interval, in standard deviations


@dataclass(frozen=True)
class Weight:
    """A ballast as it was weighed."""

    mass: float  # [kg]
    error: float = 0.0  # half of the interval that holds the mass with 95 % confidence [kg]


@dataclass(frozen=True)
class Identified:
    """Result of an identification."""

    fit: Fit
    scale: str  # what the scale of forces rests on, in a sentence
    trusted: bool  # whether that was measured; False: it is the robot's YAML
    channels: tuple[str, ...]  # names of `fit.noise`
    undetermined: tuple[str, ...] = ()  # quantities whose intervals are wider than their values
    nominal: Mapping[str, float] = field(default_factory=dict)  # what the robot's YAML has for each quantity


def identify(
    robot: Robot,
    drives: Sequence[Drive],
    *,
    known: Sequence[Known] = (),
    ballasts: Mapping[int, Weight] | None = None,
) -> Identified:
    """Estimate the quantities of a robot from its runs.

    Args:
        robot: The nominal robot.
        drives: Its runs; `load` says which ballast was aboard.
        known: Quantities that were measured otherwise.
        ballasts: Of each load that appears in the runs.

    Returns:
        Estimates with 95 % intervals, and what they rest on.

    Raises:
        ConfigError: There is no model for the robot, a known quantity is none of its unknowns, or the runs are too
            short or too poor.
    """
    ballasts = dict(ballasts or {})
    model, scale, trusted, known = _prepared(robot, list(known), ballasts)
    names = [unknown.name for unknown in model.unknowns]
    for each in known:
        if each.name not in names:
            raise UnknownNameError("quantity", each.name, names)
    noise = robot.sensors.odometry
    try:
        found = fit(
            model,
            drives,
            known,
            dt=robot.timing.physics_dt,
            noise=(max(noise.position.std, 1e-4), max(noise.heading.std, 1e-4)),
        )
    except np.linalg.LinAlgError as error:  # without motion no number follows from it
        raise ConfigError(NO_MOTION) from error
    undetermined = tuple(
        unknown.name
        for unknown in model.unknowns
        if not _is_determined(unknown, found.estimates[unknown.name])
    )
    nominal = {unknown.name: unknown.start for unknown in model.unknowns}
    return Identified(found, scale, trusted, model.channels, undetermined, nominal)


def _is_determined(unknown: Unknown, found: Estimate) -> bool:
    """Whether an estimate says more than that the quantity exists."""
    return (found.high - found.low) / 2.0 <= max(abs(found.value), unknown.useful)


def calibration_of(robot: Robot, identified: Identified, runs: Sequence[str] = ()) -> Calibration:
    """What a simulation can take over: everything determined, but the ballasts.

    Raises:
        ConfigError: Nothing is determined.
    """
    allowed = {each.name for each in fields(Calibration)} - set(identified.undetermined)
    measured = {
        name: Measured(found.value, found.low, found.high)
        for name, found in identified.fit.estimates.items()
        if name in allowed
    }
    if not measured:
        raise ConfigError(NO_MOTION)
    return Calibration(robot=robot.name, runs=tuple(runs), **measured)


def _prepared(
    robot: Robot, known: list[Known], ballasts: Mapping[int, Weight]
) -> tuple[Model, str, bool, list[Known]]:
    """Model, what sets the scale, whether that was measured, and everything known."""
    family = robot.actuators.kind
    how = MODELS.get((robot.kind.name, family))
    weighed = how is not None and not how.scale
    if ballasts and not weighed:
        raise ConfigError(f"--ballast is for robots with thrusters; '{robot.name}' has {family}.")
    if how is None or (how.afloat and robot.hydrodynamics is None):
        raise ConfigError(
            f"there is no model to identify '{robot.name}' ({family}) by; "
            "there is one for thrusters, propellers on water and differential_drive."
        )
    if ballasts and not how.ballast:
        raise ConfigError(
            f"--ballast is for robots that move on a floor or on water; weigh '{robot.name}' and give "
            "--known mass=KG+-KG."
        )
    loads = ({load: weight.mass for load, weight in ballasts.items()},) if how.ballast else ()
    model = how.model(robot, robot.actuators, *loads)
    if not weighed:
        return model, how.scale, True, known
    for load, weight in ballasts.items():
        known.append(Known(ballast_name(load), weight.mass, max(weight.error / SIGMAS, EXACT * weight.mass)))
    named = sorted({each.name for each in known} & {"mass", "thrust"})
    if named or ballasts:
        said = [f"a known {name}" for name in named] + (["a ballast of known mass"] if ballasts else [])
        return model, f"mass and thrust rest on {' and '.join(said)}", True, known
    low, high = robot.uncertainty.mass
    known.append(Known("mass", robot.body.mass, (high - low) / (2.0 * SIGMAS)))
    scale = (
        f"mass and thrust rest on the mass of the robot's YAML, {low:g} to {high:g} kg, since motion shows only "
        "their ratio: weigh the robot (--known mass=KG+-KG)"
    )
    scale += ", or record another run with a ballast (--ballast BAG=KG+-KG)" if how.ballast else ""
    return model, scale, False, known
