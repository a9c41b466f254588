"""DreamerV3 in a process of `.venv-dreamer`: found, started, listened to, and asked to stop."""

from __future__ import annotations

import importlib
import json
import os
import selectors
import subprocess
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from fulmar_core.config.errors import ConfigError, FulmarError
from fulmar_core.config.module_path import PYTHONPATH, SAFE
from fulmar_core.config.other_environment import environment_python, make_environment
from training.dreamer_request import Request

ENVIRONMENT = ".venv-dreamer"
SHEEPRL = "0.8.4"  # whose networks `training.dreamer_network` copies
LOG_FILE = "dreamer.log"  # what sheeprl writes, in the run folder
INSTALL = make_environment(ENVIRONMENT)
CHECKOUT = Path(__file__).resolve().parents[1]
LOOK_S = 0.5  # how often it is seen whether the run shall end [s]

Take = Callable[[Mapping[str, Any]], None]


class DreamerError(FulmarError):
    """The process that learns has failed."""


def dreamer_python() -> Path:
    """The Python that DreamerV3 learns with.

    Raises:
        ConfigError: The environment is missing, broken, or has another sheeprl.
    """
    folders, purpose = (CHECKOUT, Path.cwd()), "DreamerV3 learns in an environment of its own"
    python = environment_python(ENVIRONMENT, folders, purpose)
    asked = [str(python), "-c", "from importlib.metadata import version; print(version('sheeprl'))"]
    try:
        done = subprocess.run(asked, capture_output=True, text=True, timeout=60, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise ConfigError(f"{python}: cannot be run ({type(error).__name__}). {INSTALL}") from error
    if done.returncode:
        raise ConfigError(f"{python}: has no sheeprl. {INSTALL}")
    if done.stdout.strip() != SHEEPRL:
        raise ConfigError(f"{python}: has sheeprl {done.stdout.strip()}, {SHEEPRL} is needed. {INSTALL}")
    return python


@dataclass
class Learner:
    """A process that learns; use it as a context, whose end is its end."""

    request: Request
    python: Path

    def __enter__(self) -> Learner:
        source, sink = os.pipe()
        out = Path(self.request.out)
        out.mkdir(parents=True, exist_ok=True)
        with ExitStack() as stack:
            log: IO[bytes] = stack.enter_context((out / LOG_FILE).open("ab"))
            self._process = subprocess.Popen(
                [self.python, "-m", "training.dreamer_learning", self.request.as_json(), str(sink)],
                stdin=subprocess.PIPE, stdout=log, stderr=log, pass_fds=(sink,), env=_environment(),
                start_new_session=True,  # a Ctrl-C of the terminal is ours to pass on
            )  # fmt: skip
        os.close(sink)
        self._reports = os.fdopen(source, "rb", buffering=0)
        return self

    def __exit__(self, *_: object) -> None:
        self._reports.close()
        self.stop()
        try:
            self._process.wait(timeout=10.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def stop(self) -> None:
        """Ask for the end after the next step."""
        assert self._process.stdin is not None
        self._process.stdin.close()

    def listen(self, take: Take, asked_to_stop: Callable[[], bool] = lambda: False) -> dict[str, Any]:
        """Pass reports on until the process ends; returns its last one.

        Raises:
            ConfigError: It refused the request.
            DreamerError: It failed.
        """
        rest, last, stopping = b"", {}, False
        with selectors.DefaultSelector() as selector:
            selector.register(self._reports, selectors.EVENT_READ)
            while True:
                if asked_to_stop() and not stopping:
                    stopping = True
                    self.stop()
                if not selector.select(LOOK_S):
                    continue
                content = self._reports.read(65536)
                if not content:
                    break
                *lines, rest = (rest + content).split(b"\n")
                for line in lines:
                    last = json.loads(line)
                    take(last)
        self._process.wait()
        if last.get("kind") == "refused":
            raise ConfigError(last["error"])
        if last.get("kind") != "done":
            log = Path(self.request.out) / LOG_FILE
            raise DreamerError(f"DreamerV3 failed: {_last_words(log)}. See {log}")
        return dict(last)


def _environment() -> dict[str, str]:
    """Ours, with the folders of what it imports of Fulmar, and one thread."""
    modules = (importlib.import_module(name) for name in ("training", "fulmar_core"))
    folders = dict.fromkeys(str(Path(str(module.__file__)).resolve().parents[1]) for module in modules)
    threads = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "MKL", "OPENBLAS")}
    return {**os.environ, **threads, **SAFE, PYTHONPATH: os.pathsep.join(folders)}


def _last_words(log: Path) -> str:
    lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
    return next((line.strip() for line in reversed(lines) if line.strip()), "it said nothing")
