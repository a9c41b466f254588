"""What two recorded runs are compared by: their messages, byte for byte."""

from __future__ import annotations

from pathlib import Path

from mcap.reader import make_reader

BY_THE_CLOCK = ("/clock", "/diagnostics")  # health of nodes follows the wall clock


def wires_of(bag: Path) -> dict[str, list[bytes]]:
    """Every message of a bag by its topic, as it was on the wire, but for those of the wall clock."""
    found: dict[str, list[bytes]] = {}
    for file in sorted(bag.glob("*.mcap")):
        with file.open("rb") as stream:
            for _, channel, message in make_reader(stream).iter_messages():
                found.setdefault(channel.topic, []).append(message.data)
    return {
        topic: data
        for topic, data in found.items()
        if topic not in BY_THE_CLOCK and not topic.endswith("/status")
    }
