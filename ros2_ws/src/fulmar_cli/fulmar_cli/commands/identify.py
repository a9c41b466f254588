"""`fulmar identify`: parameters of a robot estimated from its runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from fulmar_bags.bag_reading import BagReading
from fulmar_bringup.console import log_line, new_table, output, print_result, warn, write_line
from fulmar_cli.commands.arguments import JsonOption, argument, option
from fulmar_cli.commands.bag_reading import BallastOption, KnownOption, with_bag_options


@with_bag_options()
def identify(
    bags: Annotated[list[Path], argument("BAG...", "Driven runs of one robot.")],
    known: KnownOption = None,
    ballast: BallastOption = None,
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
    from fulmar_evaluation.identified_bags import identify_bags

    if print_satellite(bags, reading, given=bool(known or ballast or out), as_json=as_json):
        return
    identified = identify_bags(bags, known=known or (), ballast=ballast or (), reading=reading)
    warn(identified.warnings)
    if out is not None:
        save_calibration(identified.calibration, out)
    if not identified.found.trusted:
        log_line(f"note: {identified.found.scale}.")
    print_result(identified.document(out), _print, as_json=as_json)


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
