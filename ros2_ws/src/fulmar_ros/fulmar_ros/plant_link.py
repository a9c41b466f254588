"""The plant's side of a simulated radio link: what it publishes late, and which commands it takes late or never."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from fulmar_core.simulation.backend import Sample
from fulmar_core.worlds.link import (
    COMMAND_BYTES,
    READINGS_BYTES,
    TO_CONTROLLER,
    TO_PLANT,
    Link,
    LinkDirection,
    check_chain,
)


@dataclass(frozen=True, slots=True)
class SentCommand:
    """A command as its controller sent it."""

    names: Sequence[str]
    values: Sequence[float]
    stamp_ns: int  # of the odometry that it answers


class PlantLink:
    """Both directions of a link. The owner holds a lock where commands come from another thread.

    Attributes:
        readings: Samples on their way to the controller, with their stamps [ns]: all readings of one are one message.
        commands: Commands on their way to the plant.
    """

    def __init__(self, link: Link) -> None:
        """Prepare a link of a scenario; nothing is on its way."""
        self.readings: LinkDirection[tuple[Sample, int]] = LinkDirection(
            link, TO_CONTROLLER, message_bytes=READINGS_BYTES
        )
        self.commands: LinkDirection[SentCommand] = LinkDirection(link, TO_PLANT, message_bytes=COMMAND_BYTES)

    def begin(self, seed: int, number: int = 0) -> None:
        """Begin an episode with an empty link."""
        self.readings.begin(seed, number)
        self.commands.begin(seed, number)

    def values(self) -> dict[str, str]:
        """For the plant's diagnostics."""
        return {
            "link_readings_lost": f"{self.readings.lost} of {self.readings.sent}",
            "link_commands_lost": f"{self.commands.lost} of {self.commands.sent}",
        }


def plant_link(link: Link, *, lockstep: bool, chain: Sequence[str]) -> PlantLink | None:
    """The link of a plant; None where its scenario has none.

    Args:
        link: Of the scenario.
        lockstep: Whether the plant runs in lock step.
        chain: Nodes between plant and controller.

    Raises:
        ConfigError: Nodes between plant and controller would wait in lock step for readings that the link has lost.
    """
    if not link.acts:
        return None
    if lockstep:
        check_chain(link, chain)
    return PlantLink(link)
