"""The console's process: it serves first, and looks for robots or reads bags then."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import logging
import os
import signal
import socket
from collections.abc import Callable
from dataclasses import dataclass

from fulmar_console import ADDRESS, PORT
from fulmar_console.access import Access, is_loopback, new_token
from fulmar_console.server import ConsoleServer
from fulmar_console.source import Expected, Source
from fulmar_core.config.errors import ConfigError

NICE = 10  # behind every node that controls
BACKLOG = 64
ENDS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@dataclass(frozen=True)
class ConsoleRequest:
    """What to show, and where.

    Attributes:
        expected: What is being started, to be drawn before it answers; None: nothing.
        address: To listen on.
        port: 0: any that is free.
        token: Without which a page only stops; empty: none is needed, or a new one beyond loopback.
    """

    expected: Expected | None = None
    address: str = ADDRESS
    port: int = PORT
    token: str = ""


def bound(address: str, port: int) -> socket.socket:
    """A socket that listens.

    Raises:
        ConfigError: The port is taken, or the address is not this computer's.
    """
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    try:
        return socket.create_server((address.strip("[]"), port), family=family, backlog=BACKLOG)
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            raise ConfigError(
                f"--port {port}: another program listens on {address}:{port} already. Name another, or 0 for any."
            ) from None
        raise ConfigError(f"--listen {address}, --port {port}: {error.strerror or error}.") from None


def rules(request: ConsoleRequest, listening: socket.socket) -> Access:
    """Who may ask a server on a socket; beyond loopback a token is needed."""
    port = listening.getsockname()[1]
    beyond = not is_loopback(request.address)
    return Access(request.address, port, request.token or (new_token() if beyond else ""))


def page_address(access: Access) -> str:
    """What a person opens; with the token, if there is one."""
    shown = socket.gethostname() if access.address in ("0.0.0.0", "::") else access.address
    host = f"[{shown}]" if ":" in shown else shown
    return f"http://{host}:{access.port}/" + (f"?token={access.token}" if access.token else "")


def serve(source: Source, listening: socket.socket, access: Access, say: Callable[[str], None]) -> None:
    """Serve a source until SIGINT or SIGTERM; `say` gets the address once pages can load."""
    with contextlib.suppress(OSError):
        os.nice(NICE)
    logging.getLogger("fulmar_console").setLevel(logging.ERROR)  # else each page that goes is a line
    try:
        asyncio.run(_serve(source, access, listening, say))
    finally:
        source.close()


async def _serve(
    source: Source, access: Access, listening: socket.socket, say: Callable[[str], None]
) -> None:
    stop, ready = asyncio.Event(), asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in ENDS:
        loop.add_signal_handler(number, stop.set)
    server = ConsoleServer(source, access)

    async def begin() -> None:
        await ready.wait()
        say(page_address(access))
        source.start()

    await asyncio.gather(server.run(listening, stop, ready), begin())
