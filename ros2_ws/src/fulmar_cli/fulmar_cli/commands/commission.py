"""`fulmar commission`: find the nozzle, wheel or propeller that each wire of a robot drives."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fulmar_bringup.console import log_line, print_json, write_line
from fulmar_cli.commands.arguments import ArmOption, JsonOption, SeedOption, argument, flag, option
from fulmar_core.config.errors import DONE, FAILED, ConfigError, UnknownNameError

if TYPE_CHECKING:
    from fulmar_bringup.commissioning.commission import Request


def commission(
    hardware: Annotated[str, argument("HARDWARE", "A name from `fulmar list hardware`, or a .yaml file.")],
    yes: Annotated[
        bool, flag("--yes", "The robot can move: the air is open and 0.5 m around it are free.")
    ] = False,
    arm: ArmOption = False,
    port: Annotated[str, option("P", "Port to use in place of the hardware file's.")] = "",
    write: Annotated[bool, flag("--write", "Write what was found into the hardware file.")] = False,
    out: Annotated[Path | None, option("FILE", "Write the corrected hardware file here instead.")] = None,
    emulate: Annotated[bool, flag("--emulate", "An emulator replaces the device.")] = False,
    wiring: Annotated[
        str, option("W", "With --emulate: as_written, shuffled, inverted or dead (one wire, by --seed).")
    ] = "as_written",
    seed: SeedOption = 0,
    as_json: JsonOption = False,
) -> None:
    """Find out on the robot which nozzle, wheel or propeller each wire drives.

    Without --yes nothing moves: with the air closed, each valve clicks once in the order of the wires. With --yes and
    open air, each wire is pulsed for at most 0.3 s (propellers and wheels come up to their level before), the motion is
    read from odometry or motion capture, and the order is printed as the hardware file needs it. The e-stop, 0.5 m of
    travel, 0.5 s without a pose and Ctrl-C end in the safe state. A boat with an autopilot needs --arm, too.

    The exit code is 0 if every wire was identified, 1 if one did not answer or anything else is wrong.

    Try:

    fulmar commission zero_g_lab

    fulmar commission zero_g_lab --yes --write

    fulmar commission turtlebot2 --emulate --wiring shuffled --seed 3 --yes
    """
    from fulmar_bringup.commissioning.commission import Request
    from fulmar_bringup.commissioning.commission import commission as conduct
    from fulmar_bringup.commissioning.hardware_file import line_of
    from fulmar_bringup.commissioning.hardware_file import write_line as write_into_file
    from hardware_drivers.hardware import hardware_path

    if (write or out) and not yes:
        raise ConfigError("clicks find no order to write: --write and --out need --yes.")
    request = Request(hardware, yes, emulate, wiring, seed, arm, port)
    _check(request)
    say = (lambda text: None) if as_json else lambda text: write_line(f"  {text}")
    if not as_json:
        write_line("each wire is pulsed; keep a hand on the e-stop (`fulmar estop`)" if yes
            else "AIR CLOSED? Each valve clicks once; note which one clicks:")  # fmt: skip
    found = conduct(request, say)
    value = found.get(found.get("key", ""))
    target = out or (hardware_path(hardware) if write else None)
    found["written"] = None
    if target is not None and value is not None and found["success"]:
        write_into_file(hardware_path(hardware), target, found["key"], value)
        found["written"] = str(target)
    if as_json:
        print_json(found)
    elif yes:
        _print(found, line_of(found["key"], value) if value is not None else "")
        if target is not None and found["written"] is None:
            log_line("nothing was written: correct what is named above first")
    else:
        write_line("did each click? Open the air, free 0.5 m around the robot, and add --yes")
    raise typer.Exit(DONE if found["success"] else FAILED)


def _check(request: Request) -> None:
    """Reject a request that cannot be carried out, before anything moves."""
    from fulmar_bringup.commissioning.commission import WIRINGS
    from fulmar_bringup.emulation import check_emulated
    from fulmar_bringup.plan_checks import check_arming
    from fulmar_cli.installation.extras import require
    from hardware_drivers.hardware import load_hardware
    from hardware_drivers.own_driver import check_own_driver
    from hardware_drivers.presence import check_presence

    file = load_hardware(request.hardware)
    if request.wiring not in WIRINGS:
        raise UnknownNameError("wiring", request.wiring, WIRINGS)
    if not request.emulate and request.wiring != "as_written":
        raise ConfigError("--wiring goes with --emulate: a real robot has the wiring that it has.")
    if not file.opens_valves and not request.pulses:
        raise ConfigError(
            f"'{file.robot}' has no valves to click: each pulse moves it. Give --yes once 0.5 m around it are free."
        )
    check_arming(request.hardware, arm=request.arm)
    if request.emulate:
        check_emulated(file.driver)
    check_own_driver(file.driver)
    require(*(("mujoco",) if request.emulate else ()), *file.needs)
    if not request.emulate:
        check_presence(file.driver, request.port)


def _print(found: dict[str, Any], line: str) -> None:
    for wire in found["wires"]:
        drives = wire["drives"] or "DOES NOT ANSWER"
        same = "as the file says" if drives == wire["file_says"] else f"the file says {wire['file_says']}"
        write_line(f"{wire['name']}: {drives} ({same})")
    for group in found["indistinguishable"]:
        write_line(f"no motion distinguishes: {', '.join(group)}")
    for problem in found["problems"]:
        write_line(f"WRONG: {problem}")
    if line:
        write_line(("the file is right: " if found["as_written"] else "write into the file: ") + line)
    if found["written"]:
        write_line(f"written: {found['written']}")
