"""Teleoperation: a person's input to commands, and the dead-man switch. No ROS, no clock."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.allocation import allocation_of
from fulmar_core.robots.actuators.pushing import PLANAR, WRENCH, Pushing
from fulmar_core.robots.actuators.thrusters import Thrusters
from fulmar_core.robots.robot import Robot
from fulmar_core.states.spatial import SpatialState

OUT_OF_PLANE = [2, 3, 4]  # z, roll and pitch of a wrench
VALVE_COST = 0.02  # of an open valve, where a full wish has a cost of 1: small wishes open nothing
STAYS_IN_PLANE = 1e4  # cost of a force or torque out of the plane, by that of one within it
KEY_HOLDS_NS = 600_000_000  # a key that is held repeats within this time, also after its first, longer wait
JOY_LASTS_NS = 300_000_000  # a gamepad that is silent for longer is gone
MOST_AXES = 64  # a gamepad with more is none


@dataclass(frozen=True)
class Wish:
    """What a person asks for, each from -1 to 1 of what the robot can."""

    ahead: float = 0.0
    left: float = 0.0
    turn: float = 0.0  # to the left

    @property
    def parts(self) -> tuple[float, float, float]:
        """All three."""
        return self.ahead, self.left, self.turn


NOTHING = Wish()


def resting_words(robot: Robot) -> str:
    """What its actuators do at the safe command, in words."""
    return (
        "the valves close" if isinstance(robot.actuators, Thrusters) else f"the {robot.actuators.kind} stop"
    )


def letting_go(robot: Robot) -> str:
    """What a robot does when the dead-man switch is released, and how a person gives it back, for the person."""
    if not robot.drifts:
        return "let go and it stands still; g gives it back to the controller"
    drifts = "it drifts on; press the opposite key to brake, or g to give it back to the controller"
    return f"let go and {resting_words(robot)}: {drifts}"


def keys_help(robot: Robot) -> str:
    """What the keys do, in one line for the person."""
    space = "keys push along x and y and turn about z only · " if robot.state_type is SpatialState else ""
    return (
        f"w/s ahead, back · a/d turn · q/e left, right · {space}hold a key: it is the dead-man switch · "
        "g give back · x: end; the robot stays in its safe state: press g first to give it back to the controller"
    )


def hand_mapping(robot: Robot) -> Callable[[Wish], np.ndarray]:
    """From wishes to commands of a robot, shape (n,), within its limits; no wish is the safe command.

    Raises:
        ConfigError: A person cannot drive its family of actuators, or it moves in space and cannot be driven in its
            own plane alone.
    """
    actuators = robot.actuators
    try:
        if actuators.by_hand(*NOTHING.parts) is not None:
            return lambda wish: np.asarray(actuators.by_hand(*wish.parts))
        return _allocated(robot)
    except ValueError as error:
        raise ConfigError(f"'{robot.name}' cannot be teleoperated: {error}") from error


def can_be_driven(robot: Robot) -> bool:
    """Whether a person can drive a robot: whether `hand_mapping` has one for it, without the time to make it."""
    actuators = robot.actuators
    try:
        if (
            actuators.by_hand(*NOTHING.parts) is None
            and robot.state_type.AXES == 3
            and _in_plane(robot) is None
        ):
            _check_in_space(robot.actuated_by(Pushing))
    except ValueError:
        return False
    return True


def _allocated(robot: Robot) -> Callable[[Wish], np.ndarray]:
    """Commands that bring up the wrench a person asks for, in shares of the robot's own."""
    assert isinstance(robot.actuators, Pushing)  # no other family leaves it to an allocation
    force, torque = robot.performance.force, robot.performance.torque
    full, alive = np.array([force, force, torque]), None
    if robot.state_type is SpatialState:
        alive = _in_plane(robot)
        if alive is None:
            return _allocated_in_space(robot.actuators, np.array([force] * 3 + [torque] * 3))
    allocation = allocation_of(robot.actuators, weight=np.diag(1.0 / full**2), cost=VALVE_COST)
    return lambda wish: np.asarray(allocation.best(full * np.array(wish.parts), alive))


def _in_plane(robot: Robot) -> np.ndarray | None:
    """1 for actuators that push a robot within the plane of its x and y axes, 0 for the others, shape (n,).

    None where these do not push to every side and about z.
    """
    assert isinstance(robot.actuators, Pushing)
    wrenches = robot.actuators.wrench_per_newton
    inside = np.abs(wrenches[:, OUT_OF_PLANE]).max(axis=1) < 1e-9
    if np.linalg.matrix_rank(wrenches[np.ix_(inside, PLANAR)]) < len(PLANAR):
        return None
    return np.asarray(inside, dtype=float)


def _allocated_in_space(actuators: Pushing, full: np.ndarray) -> Callable[[Wish], np.ndarray]:
    """Commands of actuators that push out of the plane one by one, and within it together; `full` has shape (6,).

    Raises:
        ValueError: They only open and close, or do not push and turn about every axis.
    """
    _check_in_space(actuators)
    asked = np.isin(np.arange(len(full)), PLANAR)
    weight = np.diag(np.where(asked, 1.0, STAYS_IN_PLANE) / full**2)
    allocation = allocation_of(actuators, weight=weight, cost=VALVE_COST)

    def command(wish: Wish) -> np.ndarray:
        wrench = np.zeros(len(full))
        wrench[PLANAR] = full[PLANAR] * np.array(wish.parts)
        return np.asarray(allocation.best(wrench))

    return command


def _check_in_space(actuators: Pushing) -> None:
    """Refuse actuators that only open and close, or do not push and turn about every axis; raises ValueError."""
    if actuators.binary or np.linalg.matrix_rank(actuators.wrench_per_newton) < WRENCH:
        raise ValueError(
            "keys and sticks drive in the plane of its x and y axes, and its actuators push out of it. Send it goals: "
            "fulmar goals."
        )


class Keyboard:
    """Keys that are held down: a terminal repeats them."""

    WISHES = {  # noqa: RUF012 - a table
        "w": ("ahead", 1.0),
        "s": ("ahead", -1.0),
        "a": ("turn", 1.0),
        "d": ("turn", -1.0),
        "q": ("left", 1.0),
        "e": ("left", -1.0),
    }

    def __init__(self) -> None:
        self._held: dict[str, tuple[float, int]] = {}

    def press(self, key: str, now_ns: int) -> bool:
        """Note a key at this time of a steady clock [ns]; whether it wishes anything. The space bar lets go of all."""
        if key == " ":
            self._held.clear()
        if key not in self.WISHES:
            return False
        axis, value = self.WISHES[key]
        self._held[axis] = value, now_ns + KEY_HOLDS_NS
        return True

    def wish(self, now_ns: int) -> Wish | None:
        """What the keys that are down wish; None if none is: the dead man let go."""
        held = {axis: value for axis, (value, until_ns) in self._held.items() if now_ns <= until_ns}
        return Wish(**held) if held else None


@dataclass(frozen=True)
class JoyLayout:
    """Which axes and buttons of a gamepad mean what, counted from 0; by default those of an Xbox pad."""

    ahead_axis: int = 1
    left_axis: int = 0
    turn_axis: int = 3
    deadman_button: int = 4  # left shoulder: nothing moves without it
    give_back_button: int = 5  # right shoulder

    @property
    def axes(self) -> tuple[int, int, int]:
        """Of the three wishes."""
        return self.ahead_axis, self.left_axis, self.turn_axis


class Gamepad:
    """The newest state of a gamepad."""

    def __init__(self, layout: JoyLayout) -> None:
        self._layout = layout
        self._wish: Wish | None = None
        self._until_ns = 0
        self.gives_back = False

    def see(self, axes: Sequence[float], buttons: Sequence[int], now_ns: int) -> str:
        """Note a message at this time of a steady clock [ns].

        Returns:
            Why it is not believed, which counts as letting go; empty if it is.
        """
        problem = self._problem(axes, buttons)
        held = not problem and bool(buttons[self._layout.deadman_button])
        self.gives_back = not problem and not held and bool(buttons[self._layout.give_back_button])
        self._wish = Wish(*(min(1.0, max(-1.0, float(axes[i]))) for i in self._layout.axes)) if held else None
        self._until_ns = now_ns + JOY_LASTS_NS
        return problem

    def wish(self, now_ns: int) -> Wish | None:
        """What it wishes; None if the dead-man button is not held, or the pad is silent."""
        return self._wish if now_ns <= self._until_ns else None

    def _problem(self, axes: Sequence[float], buttons: Sequence[int]) -> str:
        if not max(self._layout.axes) < len(axes) <= MOST_AXES:
            return f"the gamepad has {len(axes)} axes, at least {1 + max(self._layout.axes)} are needed"
        most = max(self._layout.deadman_button, self._layout.give_back_button)
        if not most < len(buttons) <= MOST_AXES:
            return f"the gamepad has {len(buttons)} buttons, at least {1 + most} are needed"
        if not all(math.isfinite(axes[i]) for i in self._layout.axes):
            return "an axis of the gamepad is not finite"
        return ""
