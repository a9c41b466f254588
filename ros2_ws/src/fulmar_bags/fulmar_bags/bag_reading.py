"""How a bag of another program is to be read: whose it is, what was to be done, and how its topics are called."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from fulmar_core.config.errors import ConfigError, UnknownNameError

if TYPE_CHECKING:  # the command line, which names this, starts without NumPy
    from fulmar_core.wires.wire import Wire

TWIST = "geometry_msgs/msg/Twist"
EXAMPLE = "--topics odom=/base/odometry,cmd_vel=/mobile_base/commands/velocity"


@dataclass(frozen=True)
class BagReading:
    """What a bag does not say itself."""

    robot: str | None = None
    task: str | None = None
    topics: Mapping[str, str] = field(
        default_factory=dict
    )  # topic of the bag by the name of ours, such as `odom`

    @property
    def named(self) -> dict[str, str]:
        """Robot and task, those that are given."""
        return {key: name for key, name in (("robot", self.robot), ("task", self.task)) if name}

    def check(self, path: object, types: Mapping[str, str]) -> None:
        """Refuse topics that a bag has not, or has with other types.

        Args:
            path: Of the bag, for the message.
            types: Of its topics.

        Raises:
            ConfigError: On the first one.
        """
        wires = _wires() if self.topics else {}
        for name, topic in self.topics.items():
            if topic not in types:
                raise UnknownNameError(f"--topics {name}={topic}: topic in {path}:", topic, types)
            if types[topic] not in types_of(wires[name]):
                wanted = " or ".join(types_of(wires[name]))
                raise ConfigError(f"--topics {name}={topic}: is {types[topic]}, '{name}' is {wanted}.")


AS_IT_IS = BagReading()


def types_of(wire: Wire) -> tuple[str, ...]:
    """Message types that are read as a wire; drivers of others take commands of speed without a stamp, too."""
    from fulmar_core.robots.topics import VELOCITY_COMMAND

    return (wire.type, TWIST) if wire is VELOCITY_COMMAND else (wire.type,)


def _wires() -> dict[str, Wire]:
    from fulmar_core.robots.topics import WIRES

    return {wire.name: wire for wire in WIRES}


def read_topics(texts: Sequence[str]) -> dict[str, str]:
    """Topics from texts such as `odom=/base/odometry`, several with commas between them.

    Raises:
        ConfigError: A text is none, or names none of our topics, or one of them twice.
    """
    found: dict[str, str] = {}
    known = _wires() if texts else {}
    for text in (part.strip() for whole in texts for part in whole.split(",")):
        name, equals, topic = (part.strip() for part in text.partition("="))
        if not (name and equals and topic):
            raise ConfigError(f"--topics {text}: must be OURS=THEIRS. Example: {EXAMPLE}")
        name = name.lstrip("/") if name.lstrip("/") in known else name
        if name not in known:
            raise UnknownNameError("--topics: topic of Fulmar", name, sorted(known))
        if name in found:
            raise ConfigError(f"--topics: '{name}' is given twice, as {found[name]} and {topic}.")
        found[name] = topic
    return found
