"""Signatures of MAVLink 2: who has the key may speak, and nobody may repeat what was said before.

Format: the MAVLink guide, "Message signing". pymavlink signs what is sent. What is received is checked here: pymavlink
notes the time of a packet before it knows that its signature is right, so that a forged one shuts a link for good.
"""

from __future__ import annotations

import hashlib
import hmac
import os
import stat
import time
from collections.abc import Callable
from pathlib import Path

from fulmar_core.config.errors import ConfigError

KEY_BYTES = 32
LARGEST_FILE = 200  # of a key: 64 digits and some white space [bytes]
SIGNED = 0x01  # of a packet's third byte
BLOCK, MAC = 13, 6  # of a signature: link, time and code; and of the code alone [bytes]
V2 = 0xFD  # first byte of a packet
EPOCH_S = 1_420_070_400  # where times begin: 1 January 2015
TICKS_HZ = 100_000  # of times
BEHIND = 60 * TICKS_HZ  # so much older than the newest time, a packet may begin a stream
GOOD, OLD, UNSIGNED, WRONG = "", "its time is over", "it is not signed", "its signature is wrong"


def read_key(path: str) -> bytes:
    """The key in a file that its owner alone may read: 32 bytes, or 64 hexadecimal digits.

    Raises:
        ConfigError: There is no such file, others may read it, or it holds no key.
    """
    named = f"signing_key: '{path}'"
    try:
        descriptor = os.open(Path(path).expanduser(), os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        with open(descriptor, "rb") as file:
            found = os.fstat(descriptor)
            data = file.read(LARGEST_FILE + 1) if stat.S_ISREG(found.st_mode) else b""
    except OSError as error:
        raise ConfigError(f"{named} cannot be read ({error.strerror}).") from error
    if not stat.S_ISREG(found.st_mode):
        raise ConfigError(f"{named} is no regular file.")
    if found.st_mode & (stat.S_IRWXG | stat.S_IRWXO) or found.st_uid not in (os.geteuid(), 0):
        raise ConfigError(
            f"{named} has mode {stat.S_IMODE(found.st_mode):04o}: the key must belong to the user of the driver, and "
            f"nobody else may read it: chmod 600 {path}"
        )
    if len(data) == KEY_BYTES:
        return data
    try:
        key = bytes.fromhex(data.decode("ascii"))
    except ValueError:
        key = b""
    if len(key) != KEY_BYTES:
        raise ConfigError(
            f"{named} holds {len(data)} bytes, must hold {KEY_BYTES} bytes or {2 * KEY_BYTES} hexadecimal digits."
        )
    return key


def ticks_now() -> int:
    """The time of this computer as signatures count it [10 µs]."""
    return int((time.time() - EPOCH_S) * TICKS_HZ)


class Signatures:
    """Checks the packets of a link, one after the other."""

    def __init__(self, key: bytes, *, now: Callable[[], int] = ticks_now) -> None:
        """Begin with no stream; `now` is as `ticks_now`."""
        self._key, self._now = key, now
        self.newest = 0  # of what was accepted [10 µs]
        self._streams: dict[tuple[int, int, int], int] = {}

    def problem(self, packet: bytes) -> str:
        """Why a whole packet is refused: `OLD`, `UNSIGNED` or `WRONG`; `GOOD` if it is not."""
        if len(packet) < 12 + BLOCK or packet[0] != V2 or not packet[2] & SIGNED:
            return UNSIGNED
        code = hashlib.sha256(self._key + packet[:-MAC]).digest()[:MAC]
        if not hmac.compare_digest(code, packet[-MAC:]):
            return WRONG
        link, time_of = packet[-BLOCK], int.from_bytes(packet[-BLOCK + 1 : -MAC], "little")
        stream = link, packet[5], packet[6]
        known = self._streams.get(stream)
        if time_of <= known if known is not None else time_of + BEHIND < max(self._now(), self.newest):
            return OLD
        self._streams[stream] = time_of
        self.newest = max(self.newest, time_of)
        return GOOD
