"""Loads what a request asks for in the place of the controller that runs."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace

from fulmar_core.config.errors import BundleError, ConfigError, UnknownNameError
from fulmar_core.controllers.controller import Controller
from fulmar_core.controllers.rest import Rest
from fulmar_core.loop.controller_choices import CLASSICAL, FALLBACK, TELEOPERATION, controller_choices
from fulmar_core.loop.controller_settings import POLICY, ControllerSettings
from fulmar_core.loop.fallback import ControllerSwitch, Standby, warm_up
from fulmar_core.loop.swap_request import SwapRequest
from fulmar_core.robots.robot import Robot
from fulmar_core.tasks import Task

MakeController = Callable[[Robot, Task, ControllerSettings], Controller]


class ControllerLoader:
    """Loads controllers of one robot and task by their names, or policies by the folders of their bundles."""

    def __init__(
        self, make_controller: MakeController, robot: Robot, task: Task, settings: ControllerSettings
    ) -> None:
        """Prepare; see `ControllerNode`."""
        self._make, self._robot, self._task, self._settings = make_controller, robot, task, settings

    @property
    def names(self) -> tuple[str, ...]:
        """Names that a request may have. A class of the user's own is one only where the node was started with it."""
        settings = self._settings
        choices = controller_choices(
            self._robot, self._task, bundle=True, fallback=settings.fallback, running=settings.controller
        )
        names = dict.fromkeys((*(choice.name for choice in choices), CLASSICAL))
        return tuple(name for name in names if not (settings.lockstep and name == TELEOPERATION))

    def load(
        self, request: SwapRequest, switch: ControllerSwitch[Standby], received: Collection[str]
    ) -> Standby:
        """A controller that is ready to take over.

        Args:
            request: What is asked for.
            switch: Has the fallback.
            received: Names of the readings that the node receives: subscriptions are made when it is configured.

        Raises:
            FulmarError: There is no such controller, or it cannot take the place of the one that runs.
        """
        name = POLICY if request.bundle else request.controller
        if name not in self.names:
            raise UnknownNameError("controller", name, self.names)
        if name == FALLBACK:
            if switch.fallback is None:
                raise ConfigError("no fallback is set")
            switch.fallback.controller.reset()
            return switch.fallback
        candidate = warm_up(self._controller(name, request), self._robot, self._task)
        missing = sorted(set(candidate.controller.readings) - set(received))
        if missing:
            raise BundleError(
                f"'{request.what}' takes {missing[0]}, which this node does not receive. Start a run with it."
            )
        return candidate

    def _controller(self, name: str, request: SwapRequest) -> Controller:
        settings = self._settings
        if name == TELEOPERATION:
            return Rest(self._robot, control_hz=settings.control_rate(self._robot), name=TELEOPERATION)
        policy = request.bundle or (settings.policy if name == POLICY else "")
        return self._make(self._robot, self._task, replace(settings, controller=name, policy=policy))
