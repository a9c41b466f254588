"""Goals and starts as people write them on a command line: which numbers a kind of robot takes, and what they are."""

from __future__ import annotations

from collections.abc import Sequence

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_core.tasks.goal import PoseTuple
from fulmar_core.tasks.goal_words import counted

GOAL, START = "--goal", "--start"


def forms_of(robot: Robot, option: str) -> tuple[tuple[str, ...], ...]:
    """Names of the numbers that an option takes for a robot, by how many there are."""
    kind = robot.kind
    short = kind.start_forms if option == START else kind.goal_forms
    return short if not goes_to_places(robot, option) else (*short, kind.state_type.NUMBERS)


def names_of(numbers: Sequence[float], robot: Robot, option: str) -> tuple[str, ...]:
    """What each of some numbers is, of `State.NUMBERS`.

    Raises:
        ConfigError: So many numbers are neither a place, an attitude nor a pose of such a robot.
    """
    forms = forms_of(robot, option)
    every = robot.state_type.NUMBERS
    for names in (*forms, every):
        if len(names) == len(numbers):
            return names
    needed = " or ".join(f"{len(names)} ({','.join(names)})" for names in forms)
    units = "[m, deg]" if goes_to_places(robot, option) else "[deg]"
    moves = f"moves in {robot.state_type.WORLD}" if goes_to_places(robot, option) else "goes to no place"
    raise ConfigError(
        f"{option} = '{written(numbers)}' has {counted(len(numbers), 'number')}; '{robot.name}' {moves}: {needed} are "
        f"needed {units}."
    )


def whole_pose(numbers: Sequence[float], robot: Robot, option: str) -> PoseTuple:
    """A pose as people write it, as `State.NUMBERS`, with 0 for what is not given.

    Args:
        numbers: A place [m], an attitude [deg], or a pose [m, deg].
        robot: Whose pose it is.
        option: What gave it.

    Raises:
        ConfigError: As in `names_of`; or a goal has a place, and the robot does not go to places.
    """
    given = dict(zip(names_of(numbers, robot, option), numbers, strict=True))
    pose = tuple(given.get(name, 0.0) for name in robot.state_type.NUMBERS)
    check_place(pose, robot, option)
    return pose


def check_place(pose: Sequence[float], robot: Robot, option: str) -> None:
    """Refuse the place of a goal of a robot that only turns to goals.

    Raises:
        ConfigError: It is not the origin.
    """
    form = robot.state_type
    place = ", ".join(f"{axis} = {at:g} m" for axis, at in zip("xyz", pose[: form.AXES], strict=False) if at)
    if place and not goes_to_places(robot, option):
        raise ConfigError(
            f"{option} = '{written(pose)}': {place} would have no effect, '{robot.name}' goes to no place. Give an "
            f"attitude alone: {','.join(robot.kind.goal_forms[0])} [deg]."
        )


def written(numbers: Sequence[float]) -> str:
    """Numbers as they were given."""
    return ",".join(f"{number:g}" for number in numbers)


def goes_to_places(robot: Robot, option: str) -> bool:
    """Whether places count, of goals, or of starts, which have a place wherever the body has."""
    forms = robot.kind.start_forms if option == START else robot.kind.goal_forms
    return any("x" in names for names in forms)
