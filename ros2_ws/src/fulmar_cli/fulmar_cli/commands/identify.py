"""`fulmar identify`: parameters of a robot estimated from its runs."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from fulmar_bags.bag_reading import BagReading
from fulmar_bringup.console import log_line, new_table, output, print_result, warn, write_line
from fulmar_cli.commands.arguments import JsonOption, argument, option
from fulmar_cli.commands.bag_reading import with_bag_options
from fulmar_core.config.errors import ConfigError

if TYPE_CHECKING:
    from fulmar_core.robots.robot import Robot
    from fulmar_evaluation.identification.identify import Identified

_NUMBER = r"[0-9]*\.?[0-9]+(?:[eE][-+]?[0-9]+)?"
_QUANTITY = re.compile(rf"(?P<value>{_NUMBER})(?:(?:\+-|±)(?P<error>{_NUMBER}))?(?:\s*(?:kg|N|s|m|kg·m²))?")


@with_bag_options()
def identify(
    bags: Annotated[list[Path], argument("BAG...", "Driven runs of one robot.")],
    known: Annotated[
        list[str] | None,
        option("NAME=VALUE+-ERROR", "A quantity that was measured, such as mass=5.32+-0.02."),
    ] = None,
    ballast: Annotated[
        list[str] | None, option("BAG=KG+-KG", "A weight that was aboard during one of the runs, anywhere.")
    ] = None,
    out: Annotated[
        Path | None, option("FILE", "Write a calibration for --calibration of run, evaluate, train.")
    ] = None,
    as_json: JsonOption = False,
    *,
    reading: BagReading,
) -> None:
    """Estimate mass, inertia, thrust, drag, wheel scale and delay from runs, with intervals of 95 % confidence.

    Motion shows forces only in proportion to mass. For a platform with thrusters, give one more value: its mass, or the
    mass of a ballast that was aboard during one of two runs. ERROR is half of a 95 % interval; without it VALUE counts
    as exact. For a boat the thrust curve of its YAML is taken as exact.

    Try:

    fulmar run floating_platform --controller excite --duration 120 --record runs/bare

    fulmar identify runs/bare --known mass=5.32+-0.02 --out calibration.yaml

    fulmar identify runs/bare runs/heavy --ballast runs/heavy=2.000+-0.005

    A bag of another program needs --robot, poses (nav_msgs/Odometry) and commands; --topics says how those are called:

    fulmar identify theirs --robot turtlebot2 --topics odom=/base/odometry,cmd_vel=/base/velocity

    Of a satellite the inertia is estimated from gyroscope and wheels, by three methods; there is no calibration of it.
    """
    from fulmar_cli.commands.identify_satellite import print_satellite
    from fulmar_core.robots.calibration import save_calibration
    from fulmar_evaluation.driven_run import driven_run
    from fulmar_evaluation.identification.identify import SIGMAS, Weight, calibration_of
    from fulmar_evaluation.identification.identify import identify as estimate
    from fulmar_evaluation.identification.model import Known

    if print_satellite(bags, reading, given=bool(known or ballast or out), as_json=as_json):
        return
    read = [_read(text, "--known", "mass=5.32+-0.02") for text in known or []]
    known_values = [Known(name, value, max(error / SIGMAS, 1e-6 * value)) for name, value, error in read]
    loads, ballasts = _loads(bags, ballast or [])
    runs = [driven_run(bag, reading, load=load) for bag, load in zip(bags, loads, strict=True)]
    warn(f"{bag}: {line}" for bag, (_, _, lines) in zip(bags, runs, strict=True) for line in lines)
    names = sorted({robot.name for robot, _, _ in runs})
    if len(names) > 1:
        raise ConfigError(f"the bags are of {', '.join(names)}. Identify one robot at a time.")
    robot = runs[0][0]
    weights = {load: Weight(value, error) for load, (value, error) in ballasts.items()}
    found = estimate(robot, [drive for _, drive, _ in runs], known=known_values, ballasts=weights)
    calibration = calibration_of(robot, found, [str(bag) for bag in bags])
    if out is not None:
        save_calibration(calibration, out)
    document = _document(robot, bags, sum(drive.duration_s for _, drive, _ in runs), found, out)
    if found.undetermined:
        left = ", ".join(found.undetermined)
        warn([f"the runs do not show {left}: left out of the calibration. Drive more briskly."])
    if not found.trusted:
        log_line(f"note: {found.scale}.")
    print_result(document, _print, as_json=as_json)


def _document(
    robot: Robot, bags: list[Path], driven_s: float, found: Identified, out: Path | None
) -> dict[str, Any]:
    fit = found.fit
    return {
        "robot": robot.name,
        "bags": [str(bag) for bag in bags],
        "driven_s": round(driven_s, 3),
        "scale": found.scale,
        "estimates": {
            name: {"value": e.value, "low": e.low, "high": e.high, "unit": e.unit}
            for name, e in fit.estimates.items()
        },
        "untold": list(found.undetermined),
        "residuals": dict(zip(found.channels, fit.noise, strict=True)),
        "windows": fit.windows,
        "calibration": None if out is None else str(out),
    }


def _read(text: str, option: str, example: str) -> tuple[str, float, float]:
    """Read `NAME=VALUE` or `NAME=VALUE+-ERROR`; a name can be a path."""
    name, _, quantity = text.rpartition("=")
    match = _QUANTITY.fullmatch(quantity.strip())
    if not name or match is None or float(match["value"]) <= 0.0:
        raise ConfigError(
            f"{option} {text}: must be a name, '=', a number greater than 0 and, if known, its error. "
            f"Example: {option} {example}"
        )
    return name.strip(), float(match["value"]), float(match["error"] or 0.0)


def _loads(bags: list[Path], ballast: list[str]) -> tuple[list[int], dict[int, tuple[float, float]]]:
    """Number of the ballast of each bag, 0 for none; and mass and error of each ballast."""
    loads, ballasts = [0] * len(bags), {}
    places = {bag.resolve(): i for i, bag in enumerate(bags)}
    for number, text in enumerate(ballast, start=1):
        name, mass, error = _read(text, "--ballast", "runs/heavy=2.0+-0.005")
        place = places.get(Path(name).resolve())
        if place is None:
            raise ConfigError(f"--ballast {text}: '{name}' is none of the bags: {', '.join(map(str, bags))}.")
        if loads[place]:
            raise ConfigError(f"--ballast: '{name}' is named twice; add the masses up.")
        loads[place], ballasts[number] = number, (mass, error)
    if ballasts and all(loads):
        raise ConfigError("--ballast: one run without ballast is needed to compare with.")
    return loads, ballasts


def _print(document: dict[str, Any]) -> None:
    title = f"{document['robot']}, {document['driven_s']:g} s in {document['windows']} windows"
    table = new_table(title, [""], ["value", "95 % from", "to"])
    table.add_column("unit")
    for name, e in document["estimates"].items():
        table.add_row(name, *(f"{e[part]:.5g}" for part in ("value", "low", "high")), e["unit"])
    output.print(table)
    write_line(document["scale"])
    if document["calibration"]:
        write_line(f"written: {document['calibration']}; use it with --calibration {document['calibration']}")
