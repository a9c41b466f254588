"""The same calls on the machines of a Ray cluster; each needs the same Fulmar, and what calls need of its extras."""

from __future__ import annotations

import logging
import os
import socket
import time
from collections.abc import Callable, Sequence
from typing import Any

import ray

from fulmar_core.config.errors import ConfigError, FulmarError, RunFailed
from fulmar_core.config.pool import ONE_THREAD, Item, OnDone, Watch, as_they_end, reporting_to
from fulmar_core.config.provenance import fulmar_version, git_revision
from fulmar_core.config.ray_address import ANSWER_S, check_that_ray_answers, named

REPORT_EVERY_S = 0.5
RETRIES = 3  # of a call whose machine is gone


class RayPool:
    """A core of whichever machine of the cluster for each call."""

    def __init__(self, address: str | None = None) -> None:
        """Join a cluster, or begin one on this machine.

        Args:
            address: HOST:PORT, ray://HOST:PORT or auto; RAY_ADDRESS or a new one here by default.

        Raises:
            ConfigError: Nothing answers there, or not as Ray does.
        """
        if ray.is_initialized():
            return
        where = address or os.environ.get("RAY_ADDRESS")
        if where and where not in ("auto", "local"):
            check_that_ray_answers(where)
        variables = ONE_THREAD | {
            key: value for key, value in os.environ.items() if key.startswith("FULMAR_")
        }
        try:
            ray.init(
                address=address,
                log_to_driver=False,
                logging_level=logging.ERROR,
                runtime_env={"env_vars": variables},
            )
        except (Exception, SystemExit) as error:  # Ray ends the process where a node is gone
            raise ConfigError(f"{named(where)}: {str(error).strip().partition(chr(10))[0]}") from error

    def close(self) -> None:
        """Leave the cluster; one that began here ends."""
        ray.shutdown()

    def run(
        self, function: Callable[..., Any], items: Sequence[Item], *, on_done: OnDone, watch: Watch
    ) -> None:
        """See `Pool.run`; a call that raises gives a RunFailed with its words."""
        board, code = _Board.remote(), _code()  # type: ignore[attr-defined] # by its decorator
        calls = [_call.remote(board, code, index, function, item) for index, item in enumerate(items)]
        try:
            futures = {call.future(): index for index, call in enumerate(calls)}
            for future in as_they_end(futures, lambda: watch(_read(board))):
                error = future.exception()
                lost = f"a worker process of the Ray cluster was lost: {_first_line(error)}" if error else ""
                on_done(futures[future], RunFailed(lost) if lost else future.result())
        finally:
            for call in calls:  # nothing to those that are done
                ray.cancel(call, force=True)


def _code() -> str:
    return " ".join(filter(None, (fulmar_version(), git_revision())))


def _first_line(error: BaseException) -> str:
    return f"{type(error).__name__} {error}".strip().partition("\n")[0]


def _read(board: Any) -> dict[int, Any]:
    try:
        return dict(ray.get(board.read.remote(), timeout=ANSWER_S))
    except ray.exceptions.RayError:  # it begins anew where its machine is gone
        return {}


@ray.remote(num_cpus=0, max_restarts=-1)
class _Board:
    """What the calls on all machines have reported."""

    def __init__(self) -> None:
        self._reported: dict[int, Any] = {}

    def write(self, index: int, progress: Any) -> None:
        self._reported[index] = progress

    def read(self) -> dict[int, Any]:
        return self._reported


@ray.remote(max_retries=RETRIES)
def _call(board: Any, code: str, index: int, function: Callable[..., Any], item: Item) -> Any:
    """Do a call on whichever machine this is; what it raises comes back in words, as it may not survive the way."""
    last = 0.0

    def send(progress: Any) -> None:
        nonlocal last
        if time.monotonic() - last >= REPORT_EVERY_S:
            last = time.monotonic()
            board.write.remote(index, progress)

    if _code() != code:
        return RunFailed(
            f"{socket.gethostname()} has Fulmar {_code()}, and {code} asks: install the same on both"
        )
    reporting_to(send)
    try:
        return function(*item)
    except FulmarError as error:
        return RunFailed(str(error))
    except Exception as error:  # noqa: BLE001 - the caller decides
        return RunFailed(_first_line(error))
