"""Options of every command that reads bags: what a bag of another program does not say itself."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Annotated, Any

from fulmar_cli.commands.arguments import option

ROBOT = option(
    "R",
    "Whose bag it is, where it does not say, from `fulmar list robots`; of a fleet's bag, a robot's name.",
)
TASK = option("T", "What was to be done, where the bag does not say; from `fulmar list tasks`.")
TOPICS = option(
    "OURS=THEIRS",
    "How topics are called in a bag of another program, such as odom=/base/odometry,cmd_vel=/vel; may be repeated.",
)

# Of commands that identify a robot from bags.
KnownOption = Annotated[
    list[str] | None,
    option("NAME=VALUE+-ERROR", "A quantity that was measured, such as mass=5.32+-0.02."),
]
BallastOption = Annotated[
    list[str] | None, option("BAG=KG+-KG", "A weight that was aboard during one of the runs, anywhere.")
]


def with_bag_options(*, robot: bool = True) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Add --robot, --task and --topics to a command; it gets them as `reading`, a `BagReading`.

    Args:
        robot: Whether there are --robot and --task, and not --topics alone.
    """

    def made(command: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(command)
        def reading_bags(**given: Any) -> None:
            from fulmar_bags.bag_reading import BagReading, read_topics
            from fulmar_core.tasks import load_task

            topics = read_topics(given.pop("topics") or [])
            names = {name: given.pop(name) for name in ("robot", "task") if robot}
            if names.get("task"):
                load_task(names["task"])
            command(**given, reading=BagReading(**names, topics=topics))

        signature = inspect.signature(command, eval_str=True)
        own = [each for each in signature.parameters.values() if each.name != "reading"]
        kinds: dict[str, Any] = {"robot": (str | None, ROBOT), "task": (str | None, TASK)} if robot else {}
        kinds["topics"] = (list[str] | None, TOPICS)
        more = [
            inspect.Parameter(
                name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=Annotated[kind, text]
            )
            for name, (kind, text) in kinds.items()
        ]
        places = [i for i, each in enumerate(own) if each.name == "as_json"] or [len(own)]
        kept = [each.replace(kind=inspect.Parameter.KEYWORD_ONLY) for each in own]
        vars(reading_bags)["__signature__"] = signature.replace(
            parameters=[*kept[: places[0]], *more, *kept[places[0] :]]
        )
        return reading_bags

    return made
