"""`python -m fulmar_console.live`: the console beside a system, on a socket that its launcher hands over."""

from __future__ import annotations

import argparse
import os
import signal
import socket
import sys

from fulmar_console.access import TOKEN, Access
from fulmar_console.live.live_source import LiveSource
from fulmar_console.process import serve
from fulmar_console.source import Expected
from fulmar_core.config.errors import DONE, FAILED, FulmarError
from fulmar_core.config.process import LAUNCHER_PID, end_with


def main() -> int:
    """Serve until asked to end, or until the launcher has died."""
    parser = argparse.ArgumentParser(prog="python -m fulmar_console.live", description=__doc__)
    parser.add_argument("--fd", type=int, required=True, help="socket that listens already")
    parser.add_argument("--address", required=True, help="that it listens on")
    parser.add_argument(
        "--expect", nargs=4, metavar=("SYSTEM", "ROBOT", "NAME", "TASK"), help="what is being started"
    )
    given = parser.parse_args()
    parent = os.environ.get(LAUNCHER_PID, "")
    if parent.isdecimal():
        end_with(int(parent), signal.SIGTERM)
    listening = socket.socket(fileno=given.fd)
    access = Access(given.address, listening.getsockname()[1], os.environ.pop(TOKEN, ""))
    try:
        expected = Expected(*given.expect) if given.expect else None
        serve(LiveSource(expected), listening, access, lambda address: None)
    except FulmarError as error:
        sys.stderr.write(f"console: {error}\n")
        return FAILED
    return DONE


if __name__ == "__main__":
    sys.exit(main())
