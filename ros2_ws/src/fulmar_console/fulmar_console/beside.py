"""A console beside a run or a system: a process of its own, on which nothing depends."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import astuple

from fulmar_console.access import TOKEN
from fulmar_console.process import ConsoleRequest, bound, page_address, rules
from fulmar_core.config.process import LAUNCHER_PID

ENDS_S = 5.0  # for the process to end in order [s]
AGAIN_S = 1.0  # before one that has died is started again [s]
MOST_STARTS = 20


@contextlib.contextmanager
def console_beside(request: ConsoleRequest, say: Callable[[str], None]) -> Iterator[None]:
    """Serve robots of the domain while the context lasts.

    The socket is this process's, so that a console that has died is started again at the same address.

    Args:
        request: What is expected, and where it listens.
        say: Gets the address, once pages can load or are about to.

    Raises:
        ConfigError: The port is taken, or the address is not this computer's.
    """
    with bound(request.address, request.port) as listening:
        access, over = rules(request, listening), threading.Event()
        command = [
            sys.executable, "-m", "fulmar_console.live", "--fd", str(listening.fileno()), "--address", request.address,
            *(("--expect", *astuple(request.expected)) if request.expected else ()),
        ]  # fmt: skip
        environment = {**os.environ, LAUNCHER_PID: str(os.getpid()), TOKEN: access.token}

        def start() -> subprocess.Popen[bytes]:
            return subprocess.Popen(
                command, env=environment, pass_fds=(listening.fileno(),), stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL, start_new_session=True,
            )  # fmt: skip

        current = [start()]

        def keep() -> None:
            for _ in range(MOST_STARTS):
                current[0].wait()
                if over.wait(AGAIN_S):
                    return
                current[0] = start()

        threading.Thread(target=keep, name="console", daemon=True).start()
        say(page_address(access))
        try:
            yield
        finally:
            over.set()
            current[0].terminate()
            try:
                current[0].wait(ENDS_S)
            except subprocess.TimeoutExpired:
                current[0].kill()
                current[0].wait()
