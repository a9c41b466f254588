"""Whether a Ray cluster answers at an address, found out in seconds; Ray itself waits for more than a minute."""

from __future__ import annotations

import socket
from urllib.parse import urlsplit

from fulmar_core.config.errors import ConfigError

ANSWER_S = 3.0
# Ray speaks HTTP/2, whose server answers this beginning of a connection with its settings (RFC 9113 §3.4, §6.5).
HELLO = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + bytes((0, 0, 0, 4, 0, 0, 0, 0, 0))
SETTINGS_FRAME = 4  # in the fourth byte of a frame


def check_that_ray_answers(address: str) -> None:
    """Refuse an address at which no server speaks HTTP/2, as those of Ray do.

    Raises:
        ConfigError: It is none, or nothing answers there within `ANSWER_S`.
    """
    try:
        parts = urlsplit("//" + address.removeprefix("ray://"))
        host, port = parts.hostname, parts.port
    except ValueError:
        host = port = None
    if not host or not port:
        raise ConfigError(f"{named(address)}: must be HOST:PORT, ray://HOST:PORT or auto.")
    try:
        with socket.create_connection((host, port), timeout=ANSWER_S) as connection:
            connection.sendall(HELLO)
            answer = connection.recv(9)
    except OSError as error:
        raise ConfigError(
            f"{named(address)} does not answer: {error}. `ray start --head` begins a cluster and says its address."
        ) from error
    if len(answer) < 4 or answer[3] != SETTINGS_FRAME:
        raise ConfigError(
            f"{named(address)} answers, but not as Ray does. Is it the port of `ray start --head`?"
        )


def named(address: str | None) -> str:
    """An address as errors name it."""
    return f"Ray address {address}" if address else "Ray"
