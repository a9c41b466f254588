"""Primary and fallback controller of a node, and policies that are loaded while one acts."""

from __future__ import annotations

import dataclasses
import threading
from collections.abc import Callable

from fulmar_core.config.errors import FulmarError
from fulmar_core.config.process import give_up_priority
from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.controller import Controller
from fulmar_core.loop.controller_settings import ControllerSettings
from fulmar_core.loop.fallback import ControllerSwitch, Standby, warm_up
from fulmar_core.robots.robot import Robot
from fulmar_core.tasks import Task

MakeController = Callable[[Robot, Task, ControllerSettings], Controller]


def controllers_of(
    make_controller: MakeController,
    robot: Robot,
    task: Task,
    settings: ControllerSettings,
    complain: Callable[[str], object],
) -> ControllerSwitch[Standby]:
    """Primary controller and its fallback; where the primary is refused, the fallback begins, and `complain` says why.

    Raises:
        FulmarError: Both are refused, or the primary is and no fallback is named.
        ImportError: A library is missing, and no fallback is named.
    """
    fallback = _fallback(robot, task, settings)
    try:
        first = warm_up(make_controller(robot, task, settings), robot, task)
    except (FulmarError, ImportError) as error:
        if fallback is None:
            raise
        complain(f"falling back to {settings.fallback}: {error}")
        return ControllerSwitch(None, fallback, refused=str(error))
    return ControllerSwitch(first, fallback)


def load_other(
    make_controller: MakeController,
    robot: Robot,
    task: Task,
    settings: ControllerSettings,
    folder: str,
) -> Standby:
    """The policy of a bundle folder, ready to take over.

    Raises:
        FulmarError: It cannot take the place of the one that runs.
    """
    return warm_up(make_controller(robot, task, dataclasses.replace(settings, policy=folder)), robot, task)


def _fallback(robot: Robot, task: Task, settings: ControllerSettings) -> Standby | None:
    name = settings.fallback
    if not name:
        return None
    law = None if name == "classical" else name
    controller = load_classical(robot, task, control_hz=settings.control_rate(robot), law=law)
    return warm_up(controller, robot, task, said={"fallback": True})


LONGEST_PATH = 4096  # characters of a bundle's folder, as of any path


class PolicySwap:
    """Loads other policies on request, in a thread of its own, while one acts.

    An operator repeats a request until it is answered. A repeat while the folder is being loaded, or waits for its
    turn, loads nothing.

    Attributes:
        requests: How many were taken, without repeats.
        said: State of the last request: empty, or loading, ready, done or refused, with the folder.
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
            propose: Receives what was loaded.
            warn: Receives why a request was refused.
        """
        self._load, self._propose, self._warn = load, propose, warn
        self._loader: threading.Thread | None = None
        self.said = ""
        self.requests = 0

    def ask(self, folder: str) -> None:
        """Load the bundle of a folder, or refuse with a reason."""
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
        """Note that the loaded policy controls now."""
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
