"""Options and arguments that several commands share."""

from __future__ import annotations

import functools
import inspect
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

from fulmar_bringup.console import json_alone, warn
from fulmar_bringup.node_table import OPTIONS, USUALLY_ON
from fulmar_core.wires.robot_name import checked_name

Value = TypeVar("Value")


def option(metavar: str, text: str, *names: str, **more: Any) -> Any:
    """An option, named like its parameter unless `names` say otherwise; `more` goes to typer, such as `min`."""
    return typer.Option(*names, metavar=metavar, help=text, **more)


def flag(name: str, text: str, **more: Any) -> Any:
    """An option without a value; `more` goes to typer."""
    return typer.Option(name, help=text, **more)


def json_flag(text: str) -> Any:
    """The flag `--json`: nothing but JSON goes to standard output then, whatever others print."""

    def keep(context: typer.Context, value: bool) -> bool:
        return value and context.with_resource(json_alone())

    return flag("--json", text, callback=keep)


def argument(metavar: str, text: str) -> Any:
    """A positional argument."""
    return typer.Argument(metavar=metavar, help=text)


def renamed(old: str, new: str) -> Any:
    """The old name of an option: hidden, still taken, with a warning."""

    def check(value: Value) -> Value:
        if value is not None:
            warn([f"{old} is now called {new}; the old name will be removed in the next release"])
        return value

    return typer.Option(old, hidden=True, callback=check)


RobotArgument = Annotated[str, argument("ROBOT", "A name from `fulmar list robots`.")]
NameOption = Annotated[
    str | None,
    option(
        "NAME",
        "Name of the robot, and its ROS namespace; its type by default.",
        "--name",
        callback=lambda name: name if name is None else checked_name(name),
    ),
]
TASK_HELP = "A name from `fulmar list tasks`, or your own class: mypackage.mymodule:MyTask."
TaskArgument = Annotated[str, argument("TASK", TASK_HELP)]
CONTROLLER_HELP = (
    "policy, a classical controller such as lqr, or your own class: mypackage.mymodule:MyController. "
    "With `fulmar run` also external: a node that you start."
)
ControllerOption = Annotated[str, option("C", CONTROLLER_HELP, "--controller")]
PolicyOption = Annotated[
    Path | None, option("DIR", "A policy bundle; the shipped one by default.", "--policy")
]
SeedOption = Annotated[int, option("N", "Seed of everything random.", "--seed", min=0, max=2**63 - 1)]
ScenarioOption = Annotated[str, option("NAME", "Disturbances: a name from configs/scenarios.", "--scenario")]
CalibrationOption = Annotated[
    Path | None,
    option("FILE", "A result of `fulmar identify`, used in place of the robot's YAML.", "--calibration"),
]
HARDWARE_HELP = (
    "With --backend hardware: a name from configs/hardware, or a .yaml file; the robot's own by default."
)
HardwareOption = Annotated[str | None, option("NAME", HARDWARE_HELP, "--hardware")]
EmulateOption = Annotated[
    bool, flag("--emulate", "With --backend hardware: an emulator replaces the device.")
]
ArmOption = Annotated[
    bool,
    flag(
        "--arm", "Let the driver set MANUAL, arm the boat's autopilot and override RC, as `arm: true` does."
    ),
]
EstopOption = Annotated[
    bool, flag("--estop", "Run an e-stop node; nothing moves without it. See `fulmar estop`.")
]
RateOption = Annotated[
    float, option("F", "Simulated seconds per second of wall-clock time.", "--rate", min=0.01, max=50.0)
]
ControlHzOption = Annotated[float | None, option("HZ", "Command rate; the robot's own by default.", min=0.01)]
RecordOption = Annotated[Path | None, option("DIR", "Folder of the bag; else runs/<time>...", "--record")]
RecordEachOption = Annotated[bool, flag("--record-each", "Of a fleet: DIR/NAME for each, not one of all.")]
CORES = len(os.sched_getaffinity(0))
JobsOption = Annotated[
    int, option("N", "Parallel processes; one for each core by default.", min=1, show_default=False)
]
RayOption = Annotated[
    str | None,
    option(
        "ADDRESS", "Compute on a Ray cluster: HOST:PORT as `ray start --head` prints it, or auto.", "--ray"
    ),
]
BagArgument = Annotated[Path, argument("BAG", "A bag folder, or the .mcap or .db3 file in it.")]
OdometryOption = Annotated[str | None, option("TOPIC", "The odometry to use, where a bag has several.")]
JsonOption = Annotated[bool, json_flag("Print one JSON object and nothing else.")]


def with_node_options(*, standing: bool) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Options of a command that switch the nodes of the table that people may; it gets their names as `extras`.

    Args:
        standing: Whether what is usual runs.
    """

    def made(command: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(command)
        def switched(**given: Any) -> None:
            extras = tuple(name for name in OPTIONS if given.pop(name))
            command(**given, extras=extras)

        signature, on = inspect.signature(command, eval_str=True), USUALLY_ON if standing else ()
        *own, last = (each for each in signature.parameters.values() if each.name != "extras")
        own += [last.replace(name=n, default=n in on, annotation=_switch(n)) for n in OPTIONS]
        vars(switched)["__signature__"] = signature.replace(parameters=[*own, last])
        return switched

    return made


def _switch(name: str) -> Any:
    flags = ("--{0}", "--{0}/--no-{0}")[name in USUALLY_ON].format(name.replace("_", "-"))
    return Annotated[bool, flag(flags, OPTIONS[name])]


def invoked_command() -> str:
    """The command line of this process, for records."""
    return "fulmar " + " ".join(sys.argv[1:])
