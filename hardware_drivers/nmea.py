"""NMEA 0183 sentences: one line of text, an exclusive or of its characters at the end."""

from __future__ import annotations

LONGEST = 256  # characters; NMEA itself stops at 82, the Kingfisher's sentences go on a little longer


def sentence(body: str) -> bytes:
    """A sentence ready to be sent.

    Args:
        body: What stands between `$` and `*`, in ASCII.
    """
    return f"${body}*{checksum(body.encode('ascii')):02X}\r\n".encode("ascii")


def checksum(body: bytes) -> int:
    """Exclusive or of all characters."""
    total = 0
    for byte in body:
        total ^= byte
    return total


class Decoder:
    """Finds sentences in a stream of bytes, however it is cut or spoilt.

    Attributes:
        lost: Lines that were no sound sentence.
    """

    def __init__(self) -> None:
        """Begin with an empty stream."""
        self._pending = bytearray()
        self.lost = 0

    def feed(self, data: bytes) -> list[list[str]]:
        """Take bytes.

        Args:
            data: The next ones.

        Returns:
            Fields of the sentences that are complete now, in their order; the first field is the name.
        """
        self._pending += data
        *lines, rest = self._pending.split(b"\n")
        if len(rest) > LONGEST:
            self.lost += 1
            rest = bytearray()
        self._pending = bytearray(rest)
        found = (_fields(bytes(line)) for line in lines)
        sound = [fields for fields in found if fields]
        self.lost += len(lines) - len(sound)
        return sound


def _fields(line: bytes) -> list[str]:
    """Fields of a line, none where it is no sound sentence."""
    line = line.strip()
    start = line.rfind(b"$")
    body, star, total = line[start + 1 :].partition(b"*")
    if start < 0 or not star or len(total) != 2 or len(line) > LONGEST or not body.isascii():
        return []
    try:
        right = int(total, 16) == checksum(body)
    except ValueError:
        return []
    return body.decode("ascii").split(",") if right else []
