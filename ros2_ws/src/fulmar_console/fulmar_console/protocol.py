"""Messages between server and page: packing of frames, and the check of what a page asks for."""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from typing import Any

from fulmar_console.source import Image, RobotSample

FRAME, IMAGE = 1, 2  # first byte of a binary message
FULL = 127  # of a share, as a signed byte
LATE_S = 1.0  # after which a command is not done any more [s]
LONGEST = 16_384  # characters of a command
# Commands with the fields that each must have, beside `robot`.
COMMANDS: dict[str, tuple[str, ...]] = {
    "estop": (),
    "reset": (),
    "goal": (),
    "start": (),
    "stop": (),
    "pause": ("paused",),
    "step": (),
    "rate": ("rate",),
    "disturb": ("what",),
    "controller": ("controller",),
    "teleop": ("share",),
    "give_back": (),
    "look": ("camera",),
}
EVERY = "*"  # robot of an e-stop that stops all


class CommandRefusedError(Exception):
    """A command that is not done; its text says why."""


def pack_frame(number: int, server_s: float, ros_age_s: float, samples: Sequence[RobotSample]) -> bytes:
    """One frame, little endian.

    A head of 24 bytes: kind, 0, number of robots (u16), number of the frame (u32), clock of the server (f64, Unix) [s],
    silence of the ROS side (f32) [s], 0 (u32). Then for each robot: index and number of actuators (u16), age of the
    pose (f32) [s], the pose (7 f32), and shares of full command (i8, -127 to 127), filled up to four bytes.
    """
    parts = [struct.pack("<BBHIdfI", FRAME, 0, len(samples), number & 0xFFFFFFFF, server_s, ros_age_s, 0)]
    for sample in samples:
        shares = [round(FULL * max(-1.0, min(1.0, share))) for share in sample.shares]
        parts.append(struct.pack("<HH8f", sample.index, len(shares), sample.age_s, *sample.pose))
        parts.append(struct.pack(f"<{len(shares)}b", *shares) + bytes(-len(shares) % 4))
    return b"".join(parts)


def pack_image(image: Image) -> bytes:
    """An image: kind, kind of the camera (u8), index of the robot (u16), 0 (u32), and the bytes of its file."""
    return struct.pack("<BBHI", IMAGE, image.kind, image.index, 0) + image.data


def read_command(
    text: str | bytes, *, session: str, last_id: int, now_s: float, robots: Sequence[str]
) -> dict[str, Any]:
    """A command of a page, checked.

    An e-stop is done whatever its age, its number and its session.

    Args:
        text: What came.
        session: Of this run of the server.
        last_id: Number of the last command of this page.
        now_s: Clock of the server [s].
        robots: Names of those that are known.

    Raises:
        CommandRefusedError: With the reason.
    """
    command = _parsed(text)
    known = _checked_do(command)
    if command["do"] == "estop":
        return command
    if command.get("session") != session:
        raise CommandRefusedError("this page belongs to a console that has ended: reload it")
    number, at = command.get("id"), command.get("at")
    if not isinstance(number, int) or isinstance(number, bool) or number <= last_id:
        raise CommandRefusedError(
            f"'{command['do']}' is a repetition of an earlier command, and is not done again"
        )
    if not isinstance(at, int | float) or not abs(now_s - at) <= LATE_S:
        raise CommandRefusedError(
            f"'{command['do']}' came too late to be done (limit {LATE_S:g} s): ask again"
        )
    missing = [key for key in known if key not in command]
    if missing:
        raise CommandRefusedError(f"'{command['do']}' needs {' and '.join(missing)}")
    robot = command.get("robot")
    if robot not in robots and not (robot == EVERY and command["do"] == "reset"):
        raise CommandRefusedError(f"no robot is called {robot!r}.{_nearest(str(robot), robots)}")
    return command


def _parsed(text: str | bytes) -> dict[str, Any]:
    if not isinstance(text, str) or len(text) > LONGEST:
        raise CommandRefusedError(f"a command is a text of at most {LONGEST} characters")
    try:
        command = json.loads(text, parse_constant=_finite, parse_float=_finite)
    except (ValueError, RecursionError):
        raise CommandRefusedError("a command is a JSON object, of finite numbers") from None
    if not isinstance(command, dict):
        raise CommandRefusedError("a command is a JSON object")
    return command


def _finite(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(text)
    return number


def _checked_do(command: Mapping[str, Any]) -> tuple[str, ...]:
    """Fields that the command must have."""
    wanted = command.get("do")
    if not isinstance(wanted, str) or wanted not in COMMANDS:
        raise CommandRefusedError(f"'{wanted}' is no command.{_nearest(str(wanted), tuple(COMMANDS))}")
    return COMMANDS[wanted]


def _nearest(name: str, names: Sequence[str]) -> str:
    close = get_close_matches(name, names, 1)
    if close:
        return f" Did you mean '{close[0]}'?"
    return f" There are: {', '.join(names)}." if names else " None is known yet."
