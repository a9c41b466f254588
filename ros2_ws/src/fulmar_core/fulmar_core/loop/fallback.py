"""Primary and fallback controller of a node, warm stand-by, and the switch between them."""

from __future__ import annotations

import json
import threading
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np

from fulmar_core.config.errors import ConfigError, TaskError
from fulmar_core.config.own_class import SEPARATOR, one_line
from fulmar_core.controllers.controller import Controller
from fulmar_core.estimators.images import nothing_seen
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.command_gate import REJECTIONS_TO_LATCH, Rejections
from fulmar_core.simulation.episode import draw_episodes
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.worlds.scenario import load_scenario

WARM_UP = 20  # the first inferences are slow; they happen before anything moves


@dataclass(frozen=True)
class Standby:
    """A controller that is ready to act at the next step: loaded, checked and warm."""

    controller: Controller
    metadata: str  # JSON, ready to publish
    sha256: str


def warm_up(
    controller: Controller, robot: Robot, task: Task, *, said: dict[str, Any] | None = None
) -> Standby:
    """Warm a loaded controller up, on the start of an episode of its task; `said` adds entries to its metadata.

    Raises:
        ConfigError: It raised, or its actions have a wrong shape.
    """
    episode = draw_episodes(robot, task, load_scenario("nominal"), seed=0, numbers=np.zeros(1, dtype=int))
    loop = ControlLoop(robot, task, controller)
    loop.begin(goal_in_float64(episode.goal))
    seen = nothing_seen(robot, controller.readings)
    try:
        for number in range(WARM_UP):
            step = loop.step(episode.start, seen, round(1e9 * number * loop.dt))
            if step.action.shape != step.command.shape:
                raise ConfigError(
                    f"controller '{controller.name}': {step.refusal}. `act` returns a row for each robot, of which a "
                    "node has one, with a value for each actuator."
                )
        loop.reset()
    except (TaskError, ConfigError):
        raise
    except Exception as error:
        module = controller.name.partition(SEPARATOR)[0]
        raise ConfigError(f"controller '{controller.name}' raised {one_line(error, module)}.") from error
    metadata = {**controller.metadata(), **(said or {})}
    text = json.dumps(metadata, sort_keys=True)
    return Standby(controller, text, str(metadata.get("sha256", "")))


T = TypeVar("T")


class ControllerSwitch(Generic[T]):
    """Primary and fallback controller of a node, and a candidate that may replace them while it runs.

    Changes happen between two control steps only; `propose` may be called from any thread.

    Attributes:
        current: The controller that acts.
        fell_back: Why the fallback acts; empty if it does not.
        proposed: What takes over at the next `apply`; None: nothing does.
    """

    def __init__(
        self,
        first: T | None,
        fallback: T | None = None,
        *,
        refused: str = "",
        to_latch: int = REJECTIONS_TO_LATCH,
    ) -> None:
        """Begin with the primary controller, or with the fallback.

        Args:
            first: The primary controller; None if it was refused.
            fallback: Takes over when that fails.
            refused: Why there is no primary controller.
            to_latch: So many refused commands in a row end a controller's turn.
        """
        current = first if first is not None else fallback
        if current is None:
            raise ValueError("neither a controller nor a fallback")
        self.current: T = current
        self.fell_back = "" if first is not None else refused
        self._fallback, self._to_latch = fallback, to_latch
        self._rejections = Rejections(to_latch)
        self._past_rejections = 0
        self._lock = threading.Lock()
        self.proposed: T | None = None

    @property
    def fallback(self) -> T | None:
        """What takes over when the primary controller fails."""
        return self._fallback

    @property
    def known(self) -> tuple[T, ...]:
        """Those that act or may take over by themselves."""
        return (self.current, *((self._fallback,) if self._fallback is not None else ()))

    @property
    def rejections(self) -> int:
        """Refused commands so far, of any controller."""
        return self._past_rejections + self._rejections.total

    def propose(self, candidate: T) -> None:
        """Let a controller take over at the next `apply`."""
        with self._lock:
            self.proposed = candidate

    def apply(self) -> bool:
        """Between two steps: let the candidate take over, if there is one; whether `current` is another now."""
        if self.proposed is None:
            return False
        with self._lock:
            candidate, self.proposed = self.proposed, None
        assert candidate is not None
        self._change(candidate, "")
        return True

    def note(self, problem: str | None) -> str | None:
        """Count a refused (reason) or accepted (None) command; returns the fault to latch if no fallback takes over."""
        fault = self._rejections.note(problem)
        return None if fault and self.fall_back(fault) else fault

    def fall_back(self, reason: str) -> bool:
        """Let the fallback take over at once; false if there is none, or if it has failed itself."""
        if self._fallback is None or self.current is self._fallback:
            return False
        self._change(self._fallback, reason)
        return True

    def _change(self, successor: T, reason: str) -> None:
        self._past_rejections += self._rejections.total
        self._rejections = Rejections(self._to_latch)
        self.current, self.fell_back = successor, reason
