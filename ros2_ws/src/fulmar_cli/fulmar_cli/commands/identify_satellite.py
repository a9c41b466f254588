"""The part of `fulmar identify` that is for satellites: their inertia, by three estimators."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from fulmar_bringup.console import print_result, write_line

if TYPE_CHECKING:
    from fulmar_bags.bag_reading import BagReading


def print_satellite(bags: list[Path], reading: BagReading, *, given: bool, as_json: bool) -> bool:
    """Identify the inertia where the bags are of one satellite, and print it; False for any other robot.

    Raises:
        ConfigError: Options were `given`, of which a satellite has none.
    """
    from fulmar_core.config.errors import ConfigError
    from fulmar_core.robots.robot_file import load_robot
    from fulmar_evaluation.identification.by_kind import ESTIMATED
    from fulmar_evaluation.identification.satellite import robot_of_bag

    names = {robot_of_bag(bag, reading) for bag in bags}
    if len(names) != 1 or not (name := names.pop()):
        return False
    robot = load_robot(name)
    estimate = ESTIMATED.get(robot.kind.name)
    if estimate is None:
        return False
    if given:
        raise ConfigError(
            f"--known, --ballast and --out are not for '{name}': wheels and gyroscope show its inertia in kg·m² "
            "without them, and there is no calibration of it. Leave them out."
        )
    print_result(estimate(robot, bags, reading), _print, as_json=as_json)
    return True


def _print(document: dict[str, Any]) -> None:
    write_line(f"{document['robot']}, {document['driven_s']:g} s; inertia about the centre of mass [kg·m²]")
    for method, found in document["estimates"].items():
        if "problem" in found:
            write_line(f"  {method:6} {found['problem']}")
            continue
        entries = (
            f"{name} {e['value']:.5g} ({e['low']:.5g} to {e['high']:.5g})" for name, e in found.items()
        )
        write_line(f"  {method:6} " + ", ".join(entries))
    write_line(
        "  file   " + ", ".join(f"{name} {value:g}" for name, value in list(document["file"].items())[:3])
    )
