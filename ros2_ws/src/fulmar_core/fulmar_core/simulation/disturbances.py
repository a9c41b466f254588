"""What a person may do to a simulated robot while it runs: pushes, dead and stuck actuators, noise, a cut link.

Requests are JSON objects. They are checked here, for the plant that carries them out and for the page that offers them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.backend import Sample
from fulmar_core.states.attitude import exponential, product
from fulmar_core.states.state import RigidBodyState

PUSH, GUST, DEAD, STUCK, NOISE, CUT_LINK, CLEAR = (
    "push",
    "gust",
    "dead",
    "stuck",
    "noise",
    "cut_link",
    "clear",
)
COMMANDS, ODOMETRY = SIDES = ("commands", "odometry")  # of a link
STRONGEST = 5.0  # largest push, in shares of the robot's own force
ACCELERATION = 2.0  # that stands for the force of a robot without a figure for it [m/s²]
LONGEST_S, LONGEST_CUT_S = 600.0, 30.0
MOST = 20  # that act at a time
WIDEST_M, WIDEST_DEG = 10.0, 90.0  # largest standard deviations of noise


@dataclass(frozen=True)
class Disturbance:
    """One that acts, from the moment it was asked for.

    Attributes:
        what: Its name.
        force: Of a push or of a gust at its strongest, in the world [N]; empty otherwise.
        actuator: Number of the dead or stuck one; -1 otherwise.
        value: Command that a stuck one has, in the command's own unit.
        position: Standard deviation of noise on the place [m].
        heading: The same about each axis [rad].
        side: Of the link that is cut.
        seconds: How long it acts; infinite: until it is cleared [s].
    """

    what: str
    force: tuple[float, ...] = ()
    actuator: int = -1
    value: float = 0.0
    position: float = 0.0
    heading: float = 0.0
    side: str = ""
    seconds: float = math.inf


def disturbance_choices(robot: Robot) -> dict[str, Any]:
    """What can be asked for, by name: words, and fields with unit, range and default.

    Args:
        robot: The simulated robot.
    """
    names = list(robot.actuators.names)
    least = float(min(_least_shares(robot)))
    lasts = _number("s", 0.1, LONGEST_S, 1.0, "how long")
    until = {**_number("s", 0.0, LONGEST_S, 0.0, "how long; 0: until it is cleared")}
    choices: dict[str, Any] = {
        DEAD: {"words": "an actuator does nothing", "fields": {"actuator": _choice(names), "seconds": until}},
        STUCK: {
            "words": "an actuator stands where it is put",
            "fields": {
                "actuator": _choice(names),
                "at": _number("share", least, 1.0, 1.0, "share of its largest command"),
                "seconds": until,
            },
        },
        NOISE: {
            "words": "the odometry is noisier",
            "fields": {
                "position_m": _number("m", 0.0, WIDEST_M, 0.05, "standard deviation of the place"),
                "heading_deg": _number("deg", 0.0, WIDEST_DEG, 2.0, "standard deviation about each axis"),
                "seconds": until,
            },
        },
        CUT_LINK: {
            "words": "messages are lost",
            "fields": {
                "side": _choice(list(SIDES)),
                "seconds": _number("s", 0.1, LONGEST_CUT_S, 1.0, "how long"),
            },
        },
        CLEAR: {"words": "end all of them", "fields": {}},
    }
    if robot.kind.goes_anywhere:
        most = STRONGEST * _force(robot)
        force = {"kind": "vector", "unit": "N", "low": -most, "high": most, "axes": robot.state_type.AXES}
        force["default"] = [_force(robot), *([0.0] * (robot.state_type.AXES - 1))]
        words = "force along the world's axes"
        choices[PUSH] = {
            "words": "a steady push",
            "fields": {"force_n": {**force, "words": words}, "seconds": lasts},
        }
        choices[GUST] = {
            "words": "a push that swells and ebbs",
            "fields": {"force_n": {**force, "words": f"{words}, at its strongest"}, "seconds": lasts},
        }
    return choices


def read_disturbance(request: Mapping[str, Any], robot: Robot) -> Disturbance:
    """A request, checked.

    Args:
        request: `what` and its fields; keys that say who asks are left out.
        robot: The simulated robot.

    Raises:
        ConfigError: There is no such disturbance, actuator or field, or a number is out of its range.
    """
    values = fields_of(request, robot)
    names = list(robot.actuators.names)
    number = names.index(values["actuator"]) if "actuator" in values else -1
    scale = float(robot.actuators.scale[number]) if number >= 0 else 0.0
    least = float(_least_shares(robot)[number])
    if values.get("at", least) < least:
        raise ConfigError(
            f"'at' of 'stuck' is {values['at']:g}, must be from {least:g} to 1: '{names[number]}' has no lower command."
        )
    return Disturbance(
        request["what"],
        force=tuple(values.get("force_n", ())),
        actuator=number,
        value=values["at"] * scale if "at" in values else 0.0,
        position=values.get("position_m", 0.0),
        heading=math.radians(values.get("heading_deg", 0.0)),
        side=values.get("side", ""),
        seconds=values.get("seconds") or math.inf,
    )


def fields_of(request: Mapping[str, Any], robot: Robot) -> dict[str, Any]:
    """Every field of a request, checked one by one; those that it leaves out have their default.

    Raises:
        ConfigError: As in `read_disturbance`.
    """
    choices = disturbance_choices(robot)
    what = request.get("what")
    if not isinstance(what, str) or what not in choices:
        raise UnknownNameError("disturbance", str(what), tuple(choices))
    fields = choices[what]["fields"]
    given = {key: value for key, value in request.items() if key not in ("what", "id", "by")}
    for key in given:
        if key not in fields:
            raise UnknownNameError(f"field of '{what}'", key, tuple(fields))
    return {
        key: _read(what, key, given.get(key, field.get("default")), field) for key, field in fields.items()
    }


class Disturbances:
    """Those that act on one simulated robot now; its owner holds a lock around each call."""

    def __init__(self, robot: Robot, seed: int = 0) -> None:
        """None acts yet; `seed` is that of the noise."""
        self._safe = np.array(robot.actuators.safe_command, dtype=float)
        self._acting: list[tuple[float, Disturbance]] = []  # with the time since each began [s]
        self._random = np.random.default_rng(seed)

    def add(self, disturbance: Disturbance) -> None:
        """Let one act from now on; `clear` ends all.

        Raises:
            ConfigError: As many act as may.
        """
        if disturbance.what == CLEAR:
            self._acting.clear()
        elif len(self._acting) >= MOST:
            raise ConfigError(f"{MOST} disturbances act already. End them first: 'clear'.")
        else:
            self._acting.append((0.0, disturbance))

    @property
    def names(self) -> tuple[str, ...]:
        """Of those that act."""
        return tuple(each.what for _, each in self._acting)

    def advance(self, seconds: float) -> None:
        """Let time pass [s]; those that are over end."""
        passed = [(since + seconds, each) for since, each in self._acting]
        self._acting = [(since, each) for since, each in passed if since < each.seconds - 1e-9]

    def cuts(self, side: str) -> bool:
        """Whether the messages of one of `SIDES` are lost now."""
        return any(each.what == CUT_LINK and each.side == side for _, each in self._acting)

    def force(self) -> tuple[float, ...] | None:
        """Push of all of them in the world [N]; None where none pushes."""
        pushes = [
            np.array(each.force)
            * (math.sin(math.pi * since / each.seconds) ** 2 if each.what == GUST else 1.0)
            for since, each in self._acting
            if each.force
        ]
        return tuple(float(part) for part in np.sum(pushes, axis=0)) if pushes else None

    def commanded(self, command: np.ndarray) -> np.ndarray:
        """What the actuators get of a command, shape (n,)."""
        failed = [each for _, each in self._acting if each.actuator >= 0]
        if not failed:
            return command
        command = np.array(command, dtype=float)
        for each in failed:
            number = each.actuator
            command[number] = self._safe[number] if each.what == DEAD else each.value
        return command

    def measured(self, sample: Sample) -> Sample:
        """A sample as noisier sensors report it."""
        noisy = [each for _, each in self._acting if each.what == NOISE]
        reading = sample.readings.get("odometry")
        if not noisy or reading is None:
            return sample
        position = math.hypot(*(each.position for each in noisy))
        heading = math.hypot(*(each.heading for each in noisy))
        state = self._blurred(reading.value, position, heading)
        return replace(sample, readings={**sample.readings, "odometry": replace(reading, value=state)})

    def _blurred(self, state: RigidBodyState, position: float, heading: float) -> RigidBodyState:
        """A planar robot stays in its plane: what is exactly level is not blurred."""
        level = state.quat_xyzw[0] == 0.0 == state.quat_xyzw[1] and state.position_in_world[2] == 0.0
        axes = np.array([1.0, 1.0, 0.0 if level else 1.0])
        turn = heading * self._random.standard_normal(3) * (np.array([0.0, 0.0, 1.0]) if level else 1.0)
        quat = np.array(product(tuple(state.quat_xyzw), exponential(tuple(turn))))
        place = np.asarray(state.position_in_world) + position * axes * self._random.standard_normal(3)
        return replace(state, position_in_world=place, quat_xyzw=quat)


def _force(robot: Robot) -> float:
    """What the robot itself brings up [N]."""
    return round(float(robot.performance.force or ACCELERATION * robot.body.mass), 3)


def _least_shares(robot: Robot) -> np.ndarray:
    """Least command of each actuator as a share of its largest, shape (n,)."""
    return np.asarray(robot.actuators.lowest / robot.actuators.scale + 0.0)


def _number(unit: str, low: float, high: float, default: float, words: str) -> dict[str, Any]:
    return {"kind": "number", "unit": unit, "low": low, "high": high, "default": default, "words": words}


def _choice(names: list[str]) -> dict[str, Any]:
    return {"kind": "choice", "choices": names, "default": names[0]}


def _read(what: str, key: str, value: Any, field: Mapping[str, Any]) -> Any:
    """One field of a request, checked."""
    if field["kind"] == "choice":
        if value not in field["choices"]:
            raise UnknownNameError(f"'{key}' of '{what}'", str(value), tuple(field["choices"]))
        return value
    low, high, unit = field["low"], field["high"], field["unit"]
    numbers = value if field["kind"] == "vector" else [value]
    axes = field.get("axes", 1)
    fits = isinstance(numbers, list | tuple) and len(numbers) == axes
    if not fits or not all(_is_number(each) and low <= each <= high for each in numbers):
        count = f"{axes} numbers" if field["kind"] == "vector" else "a number"
        raise ConfigError(
            f"'{key}' of '{what}' is {value!r}, must be {count} from {low:g} to {high:g} {unit}."
        )
    return [float(each) for each in numbers] if field["kind"] == "vector" else float(value)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and -1e300 < value < 1e300
