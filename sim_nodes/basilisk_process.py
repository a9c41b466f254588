"""Basilisk in a process of `.venv-peers`: started, asked, shared by all backends of ours, and ended."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import subprocess
import tempfile
import threading
from collections.abc import Mapping
from multiprocessing import Pipe
from pathlib import Path
from typing import Any, ClassVar

from fulmar_core.config.errors import FulmarError
from fulmar_core.config.other_environment import PEERS, make_environment
from fulmar_core.robots.basilisk_robots import basilisk_python

SERVER = Path(__file__).with_name("basilisk_server.py")
LONGEST_S = 60.0  # until an answer; the import alone takes seconds on a busy computer [s]
ENDS_S = 5.0  # until it has ended after its pipe was closed [s]


class BasiliskError(FulmarError):
    """The process with Basilisk did not start, ended, or does not answer."""


class BasiliskProcess:
    """One process with Basilisk, which ends with `close` or with our own process.

    Attributes:
        version: Of Basilisk.
    """

    def __init__(self, python: Path | None = None) -> None:
        """Start it.

        Args:
            python: A Python that has Basilisk; None: that of `.venv-peers`.

        Raises:
            ConfigError: `.venv-peers` is missing.
            BasiliskError: Basilisk cannot be imported.
        """
        command = [str(python or basilisk_python()), "-I", str(SERVER)]
        self._lock, self._owner = threading.Lock(), os.getpid()
        self._pipe, theirs = Pipe()
        self._log = tempfile.TemporaryFile()  # noqa: SIM115 - open as long as the process
        try:
            self._process = subprocess.Popen(
                [*command, str(theirs.fileno())], stdin=subprocess.DEVNULL, stdout=self._log, stderr=self._log,
                pass_fds=(theirs.fileno(),),
                start_new_session=True,  # a Ctrl-C of the terminal is ours: the plant stops first
            )  # fmt: skip
        except OSError as error:
            self._pipe.close()
            raise BasiliskError(f"{command[0]}: cannot be run ({type(error).__name__}). {REMEDY}") from error
        finally:
            theirs.close()
        self.version: str = self._answer(hint=f" {REMEDY}")["version"]

    @property
    def is_usable(self) -> bool:
        """Whether it may be asked: it has not ended, and was not started before a fork of ours."""
        return not self._pipe.closed and self._owner == os.getpid()

    def ask(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Send a request; returns the answer, both as in `basilisk_server`.

        Raises:
            BasiliskError: The process has ended or does not answer.
        """
        with self._lock:
            if not self.is_usable:
                raise BasiliskError("Basilisk's process has ended. Start the simulation again.")
            with contextlib.suppress(OSError):  # it has ended, and its log says why
                self._pipe.send_bytes(json.dumps(request).encode())
            return self._answer()

    def close(self) -> None:
        """End the process; again does no harm."""
        self._pipe.close()
        try:
            self._process.wait(timeout=ENDS_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._log.close()

    def _answer(self, hint: str = "") -> dict[str, Any]:
        try:
            if self._pipe.poll(LONGEST_S):
                answer: dict[str, Any] = json.loads(self._pipe.recv_bytes())
                return answer
            problem = f"does not answer within {LONGEST_S:g} s"
        except (EOFError, OSError):
            problem = f"has ended: {self._last_words()}"
        self._process.kill()
        self.close()
        raise BasiliskError(f"Basilisk's process {problem}.{hint}")

    def _last_words(self) -> str:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout=ENDS_S)
        self._log.seek(0)
        lines = self._log.read().decode(errors="replace").splitlines()
        return next((line.strip() for line in reversed(lines) if line.strip()), "it left no message")


class BasiliskCraft:
    """One body in a process that all of ours share: it starts with the first of them, and ends with the last."""

    _lock: ClassVar[threading.Lock] = threading.Lock()
    _running: ClassVar[BasiliskProcess | None] = None
    _numbers: ClassVar[set[int]] = set()
    _counted: ClassVar[itertools.count[int]] = itertools.count()

    def __init__(self) -> None:
        """Join the process.

        Raises:
            ConfigError, BasiliskError: As in `BasiliskProcess`.
        """
        cls = type(self)
        with cls._lock:
            process = cls._running
            if process is None or not process.is_usable:
                process = cls._running = BasiliskProcess()
                cls._numbers.clear()
            self._process, self._number = process, next(cls._counted)
            cls._numbers.add(self._number)

    def ask(self, **request: Any) -> dict[str, Any]:
        """Send a request for this body; returns the answer.

        Raises:
            BasiliskError: See `BasiliskProcess.ask`.
        """
        return self._process.ask({"craft": self._number, **request})

    def close(self) -> None:
        """Leave the process; again does no harm."""
        cls = type(self)
        with cls._lock:
            if self._process is not cls._running or self._number not in cls._numbers:
                return
            cls._numbers.remove(self._number)
            if not cls._numbers:
                cls._running = None
                self._process.close()
            elif self._process.is_usable:
                self.ask(end=True)


REMEDY = make_environment(PEERS)
