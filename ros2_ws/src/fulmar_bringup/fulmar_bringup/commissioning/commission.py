"""One commissioning: start the driver, pulse the wires, stop the driver, report the findings."""

from __future__ import annotations

import contextlib
import random
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fulmar_bringup.commissioning.by_kind import PULSED
from fulmar_bringup.commissioning.hardware_file import Wire, wires_of
from fulmar_bringup.commissioning.match import left_over
from fulmar_bringup.commissioning.procedure import Outcome, click
from fulmar_bringup.commissioning.session import Session
from fulmar_bringup.domains import claimed_domain
from fulmar_bringup.emulation import Emulation, emulation_of
from fulmar_bringup.processes import ProcessGroup
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system import Guards
from fulmar_bringup.system_rows import system_rows
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.yaml_text import dump, load
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_ros.runtime import ros_node
from hardware_drivers.hardware import Hardware, hardware_path, load_hardware
from hardware_drivers.settings import GpioValves
from hardware_drivers.wiring import SIDES
from policy_server.controllers import EXTERNAL

WIRINGS = ("as_written", "shuffled", "inverted", "dead")  # of an emulated device
CONTROL_HZ = 10.0  # that the driver's watchdog follows from: 0.2 s
Say = Callable[[str], None]


@dataclass(frozen=True)
class Request:
    """What to commission, and how."""

    hardware: str  # a name of configs/hardware, or a path that ends in .yaml
    pulses: bool  # move the robot; else only click its valves
    emulate: bool = False
    wiring: str = "as_written"  # of the emulated device, one of WIRINGS
    seed: int = 0  # of the emulated device
    arm: bool = False
    port: str = ""


def commission(request: Request, say: Say) -> dict[str, Any]:
    """Click or pulse every wire of a robot; returns the findings as `fulmar commission --json` prints them.

    Raises:
        ConfigError: The hardware file is wrong, or another run uses this ROS domain.
        RunFailed: Something ended it; the actuators are in their safe state.
    """
    path = str(hardware_path(request.hardware).absolute())
    hardware = load_hardware(path)
    kind = load_robot(hardware.robot).actuators.kind
    if kind not in PULSED:
        raise ConfigError(
            f"{path}: no pulses are known for '{hardware.robot}', which has {kind}; there are some for "
            f"{', '.join(PULSED)}. Try each actuator by a command of your own."
        )
    began_s = time.monotonic()
    scratch = tempfile.TemporaryDirectory(prefix="fulmar_", ignore_cleanup_errors=True)
    with scratch as name, claimed_domain(hardware.robot):
        folder = Path(name)
        emulation = _emulation(hardware, folder, request) if request.emulate else None
        outcome = _session(request, path, hardware, emulation, say)
        flipped = False
        if outcome is not None and _silent_valves(hardware, outcome):
            say(f"no wire answers with active_low: {hardware.driver.active_low}: trying the other level")  # type: ignore[union-attr]
            other = _other_level(Path(path), folder)
            second = _session(request, str(other), load_hardware(str(other)), emulation, say)
            flipped = second is not None and len(second.match.dead) < len(second.match.drives)
            outcome = second if flipped else outcome
    findings = {"hardware": request.hardware, "robot": hardware.robot, "driver": hardware.driver.kind}
    if outcome is None:
        return findings | {"clicked": [wire.name for wire in wires_of(hardware)], "success": True}
    more = _findings(load_robot(hardware.robot), hardware, outcome, flipped=flipped)
    if emulation is not None:
        more |= {"emulated": dict(emulation.more), "right": is_right(hardware, emulation.more, more)}
    return findings | more | {"seconds": round(time.monotonic() - began_s, 1)}


def _session(
    request: Request, path: str, hardware: Hardware, emulation: Emulation | None, say: Say
) -> Outcome | None:
    """Start the rows of a plan whose external controller is this process, click or measure, and stop them.

    Returns:
        What was measured; None after clicks.
    """
    robot, wires = load_robot(hardware.robot), wires_of(hardware)
    how = PULSED[robot.actuators.kind]
    plan = RunPlan(
        robot.name, "go_to_position", EXTERNAL, "hardware", CONTROL_HZ, hardware=path, seed=request.seed,
        emulated=emulation is not None, arm=request.arm, guards=Guards(estop=True),
    )  # fmt: skip
    group = ProcessGroup()

    def ended() -> str:
        end = group.ended()
        return f"{end.text}: {group.last_words(end.name)}" if end else ""

    errors: list[Exception] = []
    with ros_node("commission", errors.append, namespace=plan.namespace) as node:
        session = Session(
            node, robot, from_outside=hardware.seen_from_outside, bearing=hardware.has_bearing, ended=ended
        )
        session.needs_poses = request.pulses
        try:
            for row in system_rows(plan, emulation=emulation, port=request.port).values():
                group.start(replace(row, quiet=row.name == "estop"))
            session.until_ready()
            if not request.pulses:
                click(session, {wire.name: how.command(robot.actuators, wire) for wire in wires}, say)
                return None
            return how.measure(session, robot, robot.actuators, wires, say)
        finally:
            with contextlib.suppress(Exception):  # the driver makes safe by itself at its end
                session.make_safe()
            group.stop("plant")
            group.stop_all()


def _findings(robot: Robot, hardware: Hardware, outcome: Outcome, *, flipped: bool) -> dict[str, Any]:
    match, wires, how = outcome.match, wires_of(hardware), PULSED[robot.actuators.kind]
    names = how.names(robot)
    drives = list(match.drives)
    guessed = left_over(match, len(names))
    if guessed is not None:
        drives[match.dead[0]] = guessed
    problems = list(match.problems)
    if flipped:
        level = not hardware.driver.active_low  # type: ignore[union-attr]
        problems.append(
            f"the wires answer with active_low: {str(level).lower()} only: write that into the file"
        )
    for wire in match.dead:
        more = f"; by elimination it is {names[guessed]}'s" if guessed is not None else ""
        problems.append(f"{wires[wire].name} does not answer{more}")
    value = [
        how.entry(drive, sign) for drive, sign in zip(drives, match.signs, strict=True) if drive is not None
    ]
    known = None not in drives and not match.problems
    return {
        "wires": [_wire(wire, drive, sign, one, names, number in match.dead)
                  for number, (wire, drive, sign, one) in enumerate(
                      zip(wires, match.drives, match.signs, outcome.found, strict=True))],
        "key": how.key,
        how.key: value if known else None,
        "as_written": known and not flipped and value == [how.entry(wire.actuator, wire.sign) for wire in wires],
        "dead": [wires[wire].name for wire in match.dead],
        "inverted": flipped or any("inverted" in text for text in match.problems),
        "active_low": (not hardware.driver.active_low) if flipped else None,  # type: ignore[union-attr]
        "indistinguishable": [list(group) for group in how.indistinct(robot.actuators)],
        "problems": problems,
        "success": not problems,
    }  # fmt: skip


def is_right(hardware: Hardware, emulated: Mapping[str, Any], found: Mapping[str, Any]) -> bool:
    """Whether the findings are the emulated wiring, by the hardware file and the parameters of the emulator."""
    driver = hardware.driver
    robot = load_robot(hardware.robot)
    names = PULSED[robot.actuators.kind].names(robot)
    dead = [int(wire) for wire in emulated.get("dead", [])]
    if isinstance(driver, GpioValves) or "inverted" in emulated:
        level = getattr(driver, "active_low", None)
        inverted = emulated.get("active_low", level) != level or bool(emulated.get("inverted"))
        if inverted != found["inverted"]:
            return False
        if emulated.get("inverted"):
            return not found["success"]
    if "order" in emulated:
        truth = [names[thruster] for thruster in emulated["order"]]
    else:
        sides = [("-" * ("-" in side), SIDES.index(side.removeprefix("-"))) for side in emulated["sides"]]
        truth = [sign + names[side] for sign, side in sides]
    return all(
        wire["drives"] == (None if number in dead else truth[number])
        for number, wire in enumerate(found["wires"])
    ) and found["dead"] == [found["wires"][number]["name"] for number in dead]


def _wire(wire: Wire, drive: int | None, sign: float, one: Any, names: Any, dead: bool) -> dict[str, Any]:
    return {
        "name": wire.name,
        "file_says": ("-" if wire.sign < 0 else "") + names[wire.actuator],
        "drives": None if dead or drive is None else ("-" if sign < 0 else "") + names[drive],
        "change": [round(float(value), 5) for value in one.change],
        "sigma": [round(float(value), 5) for value in one.sigma],
    }


def _silent_valves(hardware: Hardware, outcome: Outcome) -> bool:
    return isinstance(hardware.driver, GpioValves) and len(outcome.match.dead) == len(outcome.found)


def _other_level(path: Path, folder: Path) -> Path:
    """A copy of a hardware file whose lines are active at the other level."""
    document = load(path.read_text(encoding="utf-8"))
    document["driver"]["active_low"] = not document["driver"].get("active_low", True)
    copy = folder / "other_level.yaml"
    copy.write_text(dump(document), encoding="utf-8")
    return copy


def _emulation(hardware: Hardware, folder: Path, request: Request) -> Emulation:
    """The emulated device, wired as the request says."""
    emulation = emulation_of(hardware, folder)
    return replace(emulation, more={**emulation.more, **rewired(hardware, request.wiring, request.seed)})


def rewired(hardware: Hardware, wiring: str, seed: int) -> Mapping[str, Any]:
    """Parameters of an emulator with one of WIRINGS; the seed draws the shuffle or the dead wire."""
    rng, count = random.Random(seed), len(wires_of(hardware))
    valves = hardware.opens_valves
    if wiring == "dead":
        return {"dead": [rng.randrange(count)]}
    if wiring == "shuffled" and valves:
        return {"order": rng.sample(range(count), count)}
    if wiring == "shuffled":
        return {"sides": [rng.choice(("", "-")) + side for side in rng.sample(SIDES, 2)]}
    if wiring == "inverted":
        if isinstance(hardware.driver, GpioValves):
            return {"active_low": not hardware.driver.active_low}
        return {"inverted": True} if valves else {"sides": ["-left", "-right"]}
    return {}
