"""Option `--origin`: where the frame `odom` of a robot lies in the frame `map` that all robots share."""

from __future__ import annotations

from typing import Annotated

from fulmar_cli.commands.arguments import option
from fulmar_cli.commands.values import read_numbers
from fulmar_core.config.errors import ConfigError

ORIGIN_HELP = (
    "Where this robot's odom lies in map, the frame that all robots share: x,y,deg, or x,y,z,deg, or "
    "x,y,z,roll,pitch,yaw. The same place by default."
)
OriginOption = Annotated[str | None, option("x,y[,z],deg", ORIGIN_HELP)]


def read_origin(text: str | None) -> tuple[float, ...] | None:
    """Numbers of `--origin`; None where it is not given.

    Raises:
        ConfigError: They are no origin.
    """
    if text is None:
        return None
    from fulmar_core.wires.origin import FORMS, check_origin

    numbers = read_numbers(text, "--origin", f"{FORMS} [m, deg]")
    if numbers is None:
        return None
    try:
        check_origin(numbers)
    except ValueError as error:
        raise ConfigError(f"--origin {text}: {error}") from error
    return numbers
