"""What the command makes of the process that it is started in: closed streams, locales, the folder, the ROS here."""

from __future__ import annotations

import os
import sys
from io import TextIOWrapper

from fulmar_bringup.console import log_line
from fulmar_core.config.module_path import safe_environment
from fulmar_ros.ros_check import look_before_loading

STREAMS = ("stdin", "stdout", "stderr")


def settle() -> None:
    """Prepare this process, once for each command line."""
    closed = open_closed_streams()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            # Names of files come back as the bytes that they were; a locale that lacks a character gets a `?`.
            stream.reconfigure(errors="surrogateescape" if stream.encoding.lower() == "utf-8" else "replace")
    if "stdout" in closed:
        log_line(
            "fulmar: standard output is closed, and results are lost: give it a file, such as > /dev/null"
        )
    os.environ.update(safe_environment(os.environ))
    look_before_loading()


def open_closed_streams() -> list[str]:
    """Let standard streams that are closed lead nowhere, and return their names.

    The next file that is opened would get the descriptor of a closed one, and what a library prints.
    """
    closed = [name for name in STREAMS if getattr(sys, name) is None]
    for name in closed:
        number = STREAMS.index(name)
        nowhere = os.open(os.devnull, os.O_RDWR)
        if nowhere != number:
            os.dup2(nowhere, number)
            os.close(nowhere)
        os.set_inheritable(number, True)
        setattr(sys, name, open(number, "w" if number else "r", encoding="utf-8", closefd=False))  # noqa: SIM115
    return closed
