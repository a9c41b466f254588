"""The robots of bags: whose odometry there is, and what each of them is."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fulmar_bags.bag_reading import BagReading
from fulmar_bags.contents import Bag, is_of_wire, open_bag
from fulmar_bags.gathered import json_object
from fulmar_bags.selection import Selection
from fulmar_bags.wire_reader import WireReader
from fulmar_core.config.errors import BagError
from fulmar_core.config.paths import config_names
from fulmar_core.robots.topics import (
    ACTUATORS_STATE,
    CAMERA_COMPRESSED,
    CAMERA_IMAGES,
    DIAGNOSTICS,
    GOAL_POSES,
    GOAL_WIRES,
    OBSTACLES,
    ODOMETRY,
    ROBOT_INFO,
    SIMULATION_EVENT,
    STATUS,
    TRUTH,
)

IMAGE_TYPES = tuple(dict.fromkeys(wire.type for wire in (*CAMERA_IMAGES, *CAMERA_COMPRESSED)))
SHOWN = {
    wire.name
    for wire in (
        ACTUATORS_STATE,
        STATUS,
        DIAGNOSTICS,
        *GOAL_WIRES.values(),
        GOAL_POSES,
        OBSTACLES,
        ROBOT_INFO,
        SIMULATION_EVENT,
    )
}
KEPT = frozenset({ODOMETRY.type, ACTUATORS_STATE.type, DIAGNOSTICS.type})
THING = "/pose"  # how topics of things end


@dataclass(frozen=True)
class RecordedRobot:
    """One robot of a bag.

    Attributes:
        name: What it is called.
        bag: As a bag of this robot alone.
        info: Its `robot_info`; None where nothing says what it is.
    """

    name: str
    bag: Bag
    info: dict[str, Any] | None

    @property
    def reader(self) -> WireReader:
        """Reads its wires."""
        return WireReader(self.bag)


def open_shown(path: Path, progress: Callable[[float], None]) -> Bag:
    """Open a bag with what the page shows of it; truth and commands only where nothing was measured or applied.

    Raises:
        BagError: There is no bag, or nothing of it can be read.
    """
    bag = open_bag(path, selection=Selection(_is_shown, False, KEPT, progress))
    there = [topic for topic in bag.topics.values() if len(topic)]
    measured = any(topic.type == ODOMETRY.type for topic in there)
    if measured and any(is_of_wire(topic.name, ACTUATORS_STATE) for topic in there):
        return bag
    return open_bag(path, selection=Selection(lambda *_: True, checks=False, progress=progress))


def _is_shown(topic: str, kind: str) -> bool:
    if kind == ODOMETRY.type:
        return not is_of_wire(topic, TRUTH) and not topic.endswith("/believed")
    if kind in IMAGE_TYPES:
        return True
    parts = topic.split("/")
    ends = {topic, *("/".join(parts[index:]) for index in range(1, len(parts)))}
    return bool(ends & SHOWN) or topic.endswith(THING)


def robots_of(bag: Bag) -> list[RecordedRobot]:
    """The robots whose odometry a bag has, by name.

    Raises:
        BagError: It has none.
    """
    spaces = sorted({space for topic in bag.topics.values() for space in _space_of(topic) if len(topic)})
    views = [_view(bag, space or bag.name or bag.robot or "robot") for space in spaces] or _only(bag)
    if not views:
        has = ", ".join(name for name, topic in bag.topics.items() if len(topic)) or "nothing that moves"
        words = f"{bag.path}: holds no robot: there is no {ODOMETRY.type} in it. It has: {has}."
        raise BagError(" ".join([words, *bag.warnings[:1]]))
    return [_described(view) for view in views]


def _space_of(topic: Any) -> Iterable[str]:
    """Namespace of a topic of odometry; nothing for any other topic."""
    for wire in (ODOMETRY, TRUTH):
        if topic.type == wire.type and is_of_wire(topic.name, wire):
            yield topic.name.removesuffix(wire.name).strip("/")


def _only(bag: Bag) -> list[Bag]:
    """The robot of a bag of another program, where one odometry alone can be its."""
    found = [topic for topic in bag.topics.values() if topic.type == ODOMETRY.type and len(topic)]
    if len(found) != 1:
        return []
    name = bag.name or found[0].name.strip("/").split("/")[0] or "robot"
    view = _view(bag, name)
    return [replace(view, reading=BagReading(topics={ODOMETRY.name: found[0].name}))]


def _view(bag: Bag, name: str) -> Bag:
    """A bag as one of one robot."""
    own = bag.info if bag.info is not None and bag.name == name else {}
    kind = own.get("robot") or (name if name in config_names("robots") else "")
    return replace(bag, info={**(own or {}), "name": name, "robot": kind})


def _described(bag: Bag) -> RecordedRobot:
    """A robot with what its bag says of it, or with the same made of its files."""
    reader = WireReader(bag)
    said = [info for each in reader.received(ROBOT_INFO) if (info := json_object(each.value))]
    info = said[-1] if said and isinstance(said[-1].get("actuators"), list) else None
    if info is not None:
        bag = replace(bag, info={"task": info.get("task"), **(bag.info or {}), "robot": info.get("type", "")})
    else:
        from fulmar_console.bags.made_info import made_info  # most bags need none of what it imports

        info = made_info(bag)
    return RecordedRobot(bag.name, bag, info)
