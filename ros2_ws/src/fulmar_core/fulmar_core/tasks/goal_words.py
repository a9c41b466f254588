"""Goals and poses in words, as the line before a run says them: metres, degrees, and what does not count."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fulmar_core.states.state import State

TURNS = {1: ("heading",), 3: ("roll", "pitch", "yaw")}  # names of angles in the plane and in space
VELOCITY = {3: ("ahead", "to the left"), 6: ("ahead", "to the left", "up")}


def number(value: float, digits: int = 3) -> str:
    """A number rounded to some digits; a negative zero is printed as 0."""
    return f"{round(float(value), digits) + 0.0:.9g}"


def counted(count: int, what: str) -> str:
    """So many of something."""
    return f"{count} {what}{'' if count == 1 else 's'}"


def place_words(form: type[State], pose: Sequence[float]) -> str:
    """A place; of a pose as `State.NUMBERS`, whose first numbers it is [m]."""
    words = (f"{axis} {number(at)}" for axis, at in zip("xyz", pose[: form.AXES], strict=False))
    return f"{', '.join(words)} m"


def attitude_words(form: type[State], pose: Sequence[float]) -> str:
    """A heading or an attitude, the last numbers of a pose as `State.NUMBERS` [deg]."""
    angles = pose[form.AXES :]
    words = (f"{name} {number(at, 2)}" for name, at in zip(TURNS[len(angles)], angles, strict=True))
    return f"{', '.join(words)} degrees"


def pose_words(form: type[State], pose: Sequence[float]) -> str:
    """A pose as `State.NUMBERS` [m, deg]."""
    return f"{place_words(form, pose)}, {attitude_words(form, pose)}"


def any_attitude(form: type[State]) -> str:
    """That the angles of a goal do not count."""
    return f"any {'attitude' if len(form.NUMBERS) - form.AXES == 3 else 'heading'}"


def velocity_words(target: np.ndarray) -> str:
    """A velocity in the body's frame, shape (3,) in the plane and (6,) in space [m/s, rad/s]."""
    ways = VELOCITY[len(target)]
    along = ", ".join(f"{number(at)} m/s {way}" for at, way in zip(target, ways, strict=False))
    turns = np.degrees(target[len(ways) :])
    names = TURNS[len(turns)] if len(turns) > 1 else ("turning",)
    turning = ", ".join(f"{name} {number(at, 2)}" for name, at in zip(names, turns, strict=True))
    return f"{along}, {turning} degrees/s"


def goal_words(topic: str, form: type[State], targets: np.ndarray, *, faces: bool) -> str:
    """A goal, by the topic that it goes to.

    Args:
        topic: One of `fulmar_core.robots.topics.GOAL_WIRES`.
        form: State type of the task.
        targets: As in `Goal`, without a batch axis, shape (k, 3; 7 or 6 in space).
        faces: Whether the heading or attitude at places along a path counts.
    """
    if topic == "goal_velocity":
        words, what = velocity_words(targets[0]), "velocities"
    elif topic == "goal_pose" or (topic == "goal_path" and faces):
        words, what = pose_words(form, form.written(targets[0])), "poses"
    else:
        words, what = f"{place_words(form, form.written(targets[0]))}, {any_attitude(form)}", "positions"
    return words if len(targets) == 1 else f"{len(targets)} {what} in turn, the first {words}"
