"""`fulmar certify --replay`: what the envelope guard would have done in recorded runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fulmar_bringup.console import print_result, write_line
from fulmar_cli.commands.values import read_area
from fulmar_core.config.errors import ConfigError
from fulmar_core.safety.geofence import NO_AREA


def only_target(targets: Sequence[str], area: str | None) -> str:
    """The one controller to certify.

    Raises:
        ConfigError: There are several, or an area, which belongs to recorded runs.
    """
    if len(targets) > 1:
        raise ConfigError(
            f"one controller is certified at a time, found {len(targets)}: {', '.join(targets)}. For bags add --replay."
        )
    if area is not None:
        raise ConfigError("--area belongs to recorded runs. Add --replay, or leave it out.")
    return targets[0]


def replay_bags(
    bags: Sequence[str], area: str | None, *, robot: str | None, task: str | None, as_json: bool
) -> None:
    """Let the guard watch bags, and print what it would have done.

    Raises:
        BagError: One of them cannot be read, or lacks what the guard needs.
        ConfigError: The guard is not for their robot, or they are of several.
    """
    from fulmar_bags.bag_reading import BagReading
    from fulmar_bags.contents import open_bag
    from fulmar_bags.run_record import check_one_robot
    from fulmar_evaluation.rerun.guard_replay import ReplayRequest, replay_guards, replay_text

    asked = ReplayRequest(tuple(read_area(area) or NO_AREA), robot, task)
    opened = []
    for name in bags:
        bag = open_bag(Path(name), BagReading(robot=robot, task=task))
        check_one_robot(bag)
        opened.append(bag)
    found = replay_guards(opened, asked)
    print_result(found, lambda document: write_line("\n".join(replay_text(document))), as_json=as_json)
