"""Processes that the benchmark of the console measures, and a page in a browser to measure them with."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from shutil import which
from typing import Any

from fulmar_core.config.errors import RunFailed

READY_S = 40.0  # for a system to run [s]
ENDS_S = 10.0
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
# Mesa's software renderer is two to four times cheaper here than the browser's own.
BROWSER_FLAGS = ("--use-angle=gl-egl", "--ignore-gpu-blocklist")


class System:
    """A `fulmar` command that prints one JSON object a line, in a process group of its own."""

    def __init__(self, arguments: Sequence[str], folder: Path, environment: Mapping[str, str]) -> None:
        """Start it."""
        self.began_s = time.monotonic()
        self.log = folder / f"{arguments[0]}.log"
        self.events: list[dict[str, Any]] = []
        self._seen = threading.Condition()
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "fulmar_cli.main", *arguments], stdout=subprocess.PIPE, stderr=log, cwd=folder,
                env={**os.environ, **environment}, start_new_session=True,
            )  # fmt: skip
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            with contextlib.suppress(ValueError), self._seen:
                self.events.append(json.loads(line))
                self._seen.notify_all()

    def event(self, key: str, value: str = "", within_s: float = READY_S) -> dict[str, Any]:
        """The first event that has a key, and this value of it.

        Raises:
            RunFailed: It did not come.
        """

        def found() -> dict[str, Any] | None:
            fitting = (each for each in self.events if key in each and (not value or each[key] == value))
            return next(fitting, None)

        with self._seen:
            self._seen.wait_for(lambda: found() or self.process.poll() is not None, within_s)
            event = found()
        if event is None:
            words = self.log.read_text(errors="replace").strip().splitlines()[-3:]
            raise RunFailed(f"'{value or key}' did not come within {within_s:g} s: {' / '.join(words)}")
        return event

    def end(self) -> None:
        """Stop it in order; its group is killed where it does not end."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        try:
            self.process.wait(ENDS_S)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()


@contextlib.contextmanager
def system(arguments: Sequence[str], folder: Path, environment: Mapping[str, str]) -> Iterator[System]:
    """A command while the context lasts."""
    running = System(arguments, folder, environment)
    try:
        yield running
    finally:
        running.end()


def browser_path() -> str:
    """The browser of this computer.

    Raises:
        RunFailed: There is none.
    """
    found = next(filter(None, map(which, BROWSERS)), None)
    if found is None:
        raise RunFailed(f"no browser is found, of {', '.join(BROWSERS)}. Install one: make setup-browser")
    return found


@contextlib.contextmanager
def browser() -> Iterator[Any]:
    """A browser that has started, of which `new_page` makes pages.

    Raises:
        RunFailed: There is none, or Playwright is missing.
    """
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        raise RunFailed("Playwright is missing. Install it: make dev") from None
    flags = [*BROWSER_FLAGS, *(["--no-sandbox"] if os.geteuid() == 0 else [])]
    with sync_playwright() as play:
        started = play.chromium.launch(executable_path=browser_path(), args=flags)
        try:
            yield started
        finally:
            started.close()


def opened(started: Any, url: str) -> Any:
    """A page that shows a robot which answers."""
    page = started.new_page(viewport={"width": 640, "height": 400})
    page.goto(f"{url}?plain" if "?" not in url else f"{url}&plain")
    wait_for(page, "window.fulmar && fulmar.frames > 5 && fulmar.health.size > 0")
    return page


def wait_for(page: Any, expression: str, within_s: float = READY_S) -> None:
    """Wait for an expression of the page to hold; asked from outside, since the page allows no `eval`.

    Raises:
        RunFailed: It did not in time [s].
    """
    until = time.monotonic() + within_s
    while not page.evaluate(f"Boolean({expression})"):
        if time.monotonic() > until:
            raise RunFailed(f"the page did not come to '{expression}' within {within_s:g} s.")
        time.sleep(0.01)
