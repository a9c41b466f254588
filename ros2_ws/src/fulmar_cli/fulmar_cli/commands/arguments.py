"""Arguments that several commands share, and how they are read."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from fulmar_core.errors import ConfigError
from fulmar_core.safety.geofence import check_area

RobotArgument = Annotated[str, typer.Argument(metavar="ROBOT", help="A name from `fulmar list robots`.")]
NameOption = Annotated[
    str | None,
    typer.Option(
        "--name", metavar="NAME", help="What the robot is called: its namespace; its type by default."
    ),
]
TASK_HELP = "A name from `fulmar list tasks`, or your own class: mypackage.mymodule:MyTask."
TaskArgument = Annotated[str, typer.Argument(metavar="TASK", help=TASK_HELP)]
TaskOption = Annotated[str, typer.Option("--task", metavar="T", help=TASK_HELP)]
ControllerOption = Annotated[
    str,
    typer.Option(
        "--controller",
        metavar="C",
        help="policy, a classical controller such as lqr, or your own class: mypackage.mymodule:MyController. "
        "With `fulmar run` also external: a node that you start.",
    ),
]
PolicyOption = Annotated[
    Path | None, typer.Option("--policy", metavar="DIR", help="A policy bundle; the shipped one by default.")
]
SeedOption = Annotated[
    int, typer.Option("--seed", metavar="N", min=0, max=2**63 - 1, help="Seed of everything random.")
]
ScenarioOption = Annotated[
    str, typer.Option("--scenario", metavar="NAME", help="Disturbances: a name from configs/scenarios.")
]
CalibrationOption = Annotated[
    Path | None,
    typer.Option(
        "--calibration",
        metavar="FILE",
        help="What `fulmar identify` measured on this robot, instead of its YAML.",
    ),
]
BagArgument = Annotated[
    Path, typer.Argument(metavar="BAG", help="A bag folder, or the .mcap or .db3 file in it.")
]
ArmOption = Annotated[
    bool,
    typer.Option(
        "--arm",
        help="Let the driver set MANUAL, arm the boat's autopilot and override RC, as `arm: true` does.",
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]


Area = tuple[float, float, float, float]  # x_min, x_max, y_min, y_max [m]


def read_area(text: str | None) -> Area | None:
    """Read `x_min,x_max,y_min,y_max` of --area [m].

    Raises:
        ConfigError: If it is not such an area.
    """
    if text is None:
        return None
    try:
        x_min, x_max, y_min, y_max = (float(part) for part in text.split(","))
        check_area((x_min, x_max, y_min, y_max))
    except ValueError as error:
        raise ConfigError(
            f"--area = '{text}' must be x_min,x_max,y_min,y_max in m with x_min < x_max and y_min < y_max, "
            "such as --area=-2,2,-1,1."
        ) from error
    return x_min, x_max, y_min, y_max


def read_goal(text: str | None, option: str = "--goal") -> tuple[float, ...] | None:
    """Read `x,y` or `x,y,deg`: x [m], y [m] and, for a pose, heading [deg].

    Args:
        text: What was written, or None.
        option: Name of the option, for messages.

    Raises:
        ConfigError: If it is not two or three finite numbers.
    """
    if text is None:
        return None
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = ()
    if len(values) not in (2, 3) or not all(math.isfinite(value) for value in values):
        raise ConfigError(
            f"{option} = '{text}' must be two or three finite numbers: x [m], y [m] and, for a pose, heading [deg]. "
            f"Example: {option} 1,-0.5 or {option} 1,-0.5,90"
        )
    return values


def read_pose(text: str | None, option: str) -> tuple[float, float, float] | None:
    """Read `x,y,deg`.

    Args:
        text: What was written, or None.
        option: Name of the option, for messages.

    Returns:
        x [m], y [m] and heading [deg], or None.

    Raises:
        ConfigError: If it is not three finite numbers.
    """
    if text is None:
        return None
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) != 3 or not all(math.isfinite(value) for value in values):
        raise ConfigError(
            f"{option} = '{text}' must be three finite numbers: x [m], y [m], heading [deg]. "
            f"Example: {option} 1,-0.5,90"
        )
    return values[0], values[1], values[2]
