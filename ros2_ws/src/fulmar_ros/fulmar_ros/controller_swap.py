"""Controllers that are loaded on request while one acts."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import replace

from fulmar_core.config.errors import ConfigError, FulmarError
from fulmar_core.config.process import give_up_priority
from fulmar_core.loop.fallback import Standby
from fulmar_core.loop.swap_request import LONGEST_PATH, SwapRequest, SwapResult, read_request, request_id

SOON_S = 1.0  # after which a controller that is ready, and has not taken over yet, is reported as ready


class ControllerSwap:
    """Loads other controllers on request, in a thread of its own, while one acts, and answers each request.

    An operator repeats a request until it is answered. A repeat while it is being loaded, or waits for its turn, loads
    nothing; a repeat of one that has an id gets the same answer again.

    Attributes:
        requests: How many were taken, without repeats.
        said: State of the last request: empty, or loading, ready, done or refused, with what was asked for.
    """

    def __init__(
        self,
        load: Callable[[SwapRequest], Standby],
        propose: Callable[[Standby], None],
        warn: Callable[[str], object],
        answer: Callable[[SwapResult], object],
    ) -> None:
        """Wait for requests.

        Args:
            load: Loads what a request asks for, in another thread.
            propose: Receives what was loaded.
            warn: Receives why a request was refused.
            answer: Receives the answers; called from several threads.
        """
        self._load, self._propose, self._warn, self._answer = load, propose, warn, answer
        self._loader: threading.Thread | None = None
        self._lock = threading.Lock()
        self._ready: tuple[SwapResult, float] | None = None  # proposed, and since when [s]
        self._current: SwapRequest | None = None  # that is being loaded, or was last
        self._answered: SwapResult | None = None  # the newest answer
        self.said = ""
        self.requests = 0

    def ask(self, text: str) -> None:
        """Load what a request asks for, or refuse it with a reason."""
        try:
            request = read_request(text)
        except ConfigError as error:
            self.requests += 1
            self._refuse(SwapRequest(text, request_id(text), bundle=text), str(error))
            return
        answered = self._answered
        if request.id != "" and answered is not None and request.id == answered.id:
            self._answer(answered)
            return
        if self._current == request and self.said in (f"loading {request.what}", f"ready {request.what}"):
            return
        self.requests += 1
        if self._loader is not None and self._loader.is_alive():
            self._refuse(request, "another controller is being loaded")
            return
        self._current, self.said = request, f"loading {request.what}"
        self._loader = threading.Thread(target=self._fetch, args=(request,), name="loader", daemon=True)
        self._loader.start()

    def took_over(self, stamp_ns: int) -> None:
        """Note that what was loaded controls now, from the measurement of a stamp on [ns]."""
        with self._lock:
            ready, self._ready = self._ready, None
        self.said = self.said.replace("ready", "done", 1)
        if ready is not None:
            what = ready[0].controller or ready[0].bundle
            self._give(replace(ready[0], reason=f"{what} controls", stamp_ns=stamp_ns))

    def look(self) -> None:
        """Answer a request whose controller is ready and waits for a control step; call it several times a second."""
        with self._lock:
            if self._ready is None or time.monotonic() - self._ready[1] < SOON_S:
                return
            result, self._ready = self._ready[0], (self._ready[0], float("inf"))
        self._give(replace(result, reason="ready: it takes over at the next control step"))

    def _fetch(self, request: SwapRequest) -> None:
        give_up_priority()  # the one that runs goes first
        try:
            candidate = self._load(request)
        except Exception as error:  # noqa: BLE001 - whatever is wrong with it, the one that runs goes on
            known = isinstance(error, FulmarError)
            self._refuse(request, str(error) if known else f"{type(error).__name__}: {error}")
            return
        result = SwapResult(
            request.id, True, "", request.controller, request.bundle, request.by, candidate.sha256
        )
        with self._lock:
            before, self._ready = self._ready, (result, time.monotonic())
        if before is not None:
            self._give(
                replace(before[0], accepted=False, reason="another one was asked for before it took over")
            )
        self.said = f"ready {request.what}"
        self._propose(candidate)

    def _refuse(self, request: SwapRequest, reason: str) -> None:
        self.said = f"refused {request.what[:LONGEST_PATH]}: {reason}"
        self._warn(f"controller not changed: {reason}")
        self._give(
            SwapResult(
                request.id, False, reason, request.controller, request.bundle[:LONGEST_PATH], request.by
            )
        )

    def _give(self, result: SwapResult) -> None:
        self._answered = result
        self._answer(result)
