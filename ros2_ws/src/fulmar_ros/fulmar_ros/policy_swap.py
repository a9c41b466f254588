"""Another policy while one acts: loaded beside it, in a thread of its own."""

from __future__ import annotations

import threading
from collections.abc import Callable

from fulmar_core.errors import FulmarError
from fulmar_core.process import give_up_priority
from fulmar_core.safety.fallback import Standby

LONGEST_PATH = 4096  # characters of a bundle's folder, as of any path


class PolicySwap:
    """Takes requests for another policy; the one that runs is not disturbed.

    An operator repeats a request until it is answered. A repeat that comes while the folder is being loaded, or waits
    for its turn, is the same request: it loads nothing.

    Attributes:
        requests: How many were taken, without repeats.
        said: What came of the last request: empty, or a word of loading, ready, done or refused, with the folder.
    """

    def __init__(
        self,
        load: Callable[[str], Standby] | None,
        propose: Callable[[Standby], None],
        warn: Callable[[str], object],
    ) -> None:
        """Wait for requests.

        Args:
            load: Loads the bundle of a folder, in another thread; None where no policy runs.
            propose: Told about what has been loaded.
            warn: Told about what has been refused.
        """
        self._load, self._propose, self._warn = load, propose, warn
        self._loader: threading.Thread | None = None
        self.said = ""
        self.requests = 0

    def ask(self, folder: str) -> None:
        """Load the bundle of a folder, or say why not."""
        if self.said in (f"loading {folder}", f"ready {folder}"):
            return
        self.requests += 1
        if self._load is None:
            self._refuse(folder, "this controller runs no policy")
        elif not folder or len(folder) > LONGEST_PATH:
            self._refuse(folder, f"a folder has 1 to {LONGEST_PATH} characters, found {len(folder)}")
        elif self._loader is not None and self._loader.is_alive():
            self._refuse(folder, "another policy is being loaded")
        else:
            self.said = f"loading {folder}"
            self._loader = threading.Thread(
                target=self._fetch, args=(self._load, folder), name="loader", daemon=True
            )
            self._loader.start()

    def took_over(self) -> None:
        """What was loaded controls now."""
        self.said = self.said.replace("ready", "done", 1)

    def _fetch(self, load: Callable[[str], Standby], folder: str) -> None:
        give_up_priority()  # the one that runs goes first
        try:
            candidate = load(folder)
        except Exception as error:  # noqa: BLE001 - whatever is wrong with it, the one that runs goes on
            known = isinstance(error, FulmarError)
            self._refuse(folder, str(error) if known else f"{type(error).__name__}: {error}")
            return
        self.said = f"ready {folder}"
        self._propose(candidate)

    def _refuse(self, folder: str, reason: str) -> None:
        self.said = f"refused {folder[:LONGEST_PATH]}: {reason}"
        self._warn(f"policy not changed: {reason}")
