"""Learns with DreamerV3 of sheeprl, by the Python of `.venv-dreamer`; Stable-Baselines3 and ROS are not there.

The loop is sheeprl's own. Two of its functions are wrapped, to count gradient steps and to see the networks, and the
first of its worlds says after each step of all whether a check, a checkpoint or the end is due.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import math
import os
import platform
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch

from fulmar_core.config.atomic_write import whole_file
from fulmar_core.config.errors import ConfigError, FulmarError
from fulmar_core.robots.robot_file import load_robot, use_calibration
from fulmar_core.tasks import load_task
from fulmar_core.tasks.observation import Observer
from fulmar_core.worlds.scenario import load_scenario
from training.dreamer_network import DreamerNetwork, DreamerPlan
from training.dreamer_request import Request
from training.evaluator import Check, held_out_evaluator
from training.gym_env import TaskEnv
from training.learner_curve import Curve
from training.network import save_network
from training.run_folder import CHECKPOINT_FILE, NETWORK_FILE
from training.settings import Dreamer, load_training_settings
from training.sheeprl_settings import NEVER, sheeprl_settings

Report = Callable[[str, dict[str, Any]], None]


class RunIsOver(BaseException):
    """Ends the loop between two steps; no Exception, since sheeprl restarts a world that raises one."""


@dataclass
class History:
    """The run so far, also across an interruption."""

    elapsed_s: float = 0.0  # wall-clock of earlier parts [s]
    cpu_s: float = 0.0  # processor time of the same [s]
    steps: int = 0  # control steps of all worlds
    updates: int = 0  # gradient steps
    checks: list[dict[str, Any]] = field(default_factory=list)
    best: dict[str, Any] | None = None


class Session:
    """One training: its worlds, its networks, and what is due between two steps."""

    def __init__(self, request: Request, report: Report) -> None:
        """Load what the run is about, and its checkpoint if it goes on.

        Raises:
            ConfigError: Something is missing, or the checkpoint is none.
        """
        if request.calibration:
            use_calibration(Path(request.calibration), request.robot)
        self.request, self._report, self._out = request, report, Path(request.out)
        robot, self.task = load_robot(request.robot), load_task(request.task)
        self.settings = load_training_settings(robot, self.task, request.settings)
        self.robot = self.settings.learner_of(robot)
        self.scenario = load_scenario(self.settings.scenario)
        assert isinstance(self.settings.algorithm, Dreamer)
        self.network = DreamerNetwork(plan_of(self.settings.algorithm, self.robot, self.task))
        self._evaluator = held_out_evaluator(self.robot, self.task, self.scenario)
        self.curve = None
        if request.budget is not None:
            self.curve = Curve(self.robot, self.task, self.scenario, request.budget)
        self.history, self.checkpoint = History(), self._out / CHECKPOINT_FILE
        if request.resume:
            self.history = History(**load_checkpoint(self.checkpoint)["fulmar"])
        self.stopped = threading.Event()
        self.interrupted = self._ending = False
        self.cfg: Any = None
        self._agent: tuple[Any, Any] | None = None
        self._began, self._cpu_began = time.monotonic(), time.process_time()
        self._before_s, self._cpu_before_s = self.history.elapsed_s, self.history.cpu_s
        limit = request.time_limit_s or self.settings.time_limit_s
        self._check_every = self.settings.evaluate_every_s / limit
        self._next_check = self._after(self._progress())
        self._next_checkpoint = self.elapsed_s + self.settings.checkpoint_every_s

    @property
    def elapsed_s(self) -> float:
        """Wall-clock of all parts of the run [s]."""
        return self._before_s + time.monotonic() - self._began

    def world(self, seed: int, number: int) -> gymnasium.Env[np.ndarray, np.ndarray]:
        """One of the worlds; number 0 counts the steps of all."""
        env = TaskEnv(self.robot, self.task, self.scenario, seed=seed, training=True)
        return World(env, self.settings.reward_scale, self.stepped if number == 0 else None)

    def see(self, world_model: Any, actor: Any) -> None:
        """Take the networks that learn."""
        self._agent = world_model, actor

    def learned(self) -> DreamerNetwork:
        """The policy as it is now."""
        assert self._agent is not None
        world_model, actor = self._agent
        self.network.take(world_model.state_dict(), actor.state_dict())
        return self.network

    def stepped(self) -> None:
        """Before the next step of all worlds: check, save, or end."""
        if self._ending:
            raise RunIsOver
        history = self.history
        if self.curve is not None:
            if self.curve.look(history.steps, history.updates, self.learned):
                raise RunIsOver
        else:
            self._between_steps()
        history.steps += self.settings.worlds

    def _between_steps(self) -> None:
        history = self.history
        history.elapsed_s = self.elapsed_s
        history.cpu_s = self._cpu_before_s + time.process_time() - self._cpu_began
        progress, stopped = self._progress(), self.stopped.is_set()
        share = {"share": progress, "elapsed_s": history.elapsed_s, "steps": history.steps}
        self._report("advance", share)
        over = progress >= 1.0
        if over or stopped or progress >= self._next_check:
            self._check()
            self._next_check = self._after(self._progress())
            over = over or self._succeeds()
        if over or stopped or self.elapsed_s >= self._next_checkpoint:
            self.cfg.checkpoint.every = 1  # at the end of this step
            self._next_checkpoint = self.elapsed_s + self.settings.checkpoint_every_s
        self._ending, self.interrupted = over or stopped, stopped and not over

    def _progress(self) -> float:
        """Share of the run that is over [-]; 0 where a budget ends it in place of limits."""
        request = self.request
        shares = [self.elapsed_s / request.time_limit_s] if request.time_limit_s else []
        shares += [self.history.updates / request.updates] if request.updates else []
        return min(1.0, max(shares, default=0.0))

    def _after(self, progress: float) -> float:
        return (math.floor(progress / self._check_every + 1e-9) + 1) * self._check_every

    def _check(self) -> None:
        history, network = self.history, self.learned()
        success, score = self._evaluator(network)
        found = asdict(Check(self.elapsed_s, history.steps, success, score))
        history.checks.append(found)
        if history.best is None or score > history.best["score"]:
            history.best = found
            save_network(network, self._out / NETWORK_FILE)
        self._report("evaluated", {"elapsed_s": self.elapsed_s, "success": success})

    def _succeeds(self) -> bool:
        enough = self.settings.stop_at_success
        return enough is not None and enough.reached([check["success_rate"] for check in self.history.checks])


class World(gymnasium.Wrapper[np.ndarray, np.ndarray, np.ndarray, np.ndarray]):
    """A world with scaled rewards, which may call somebody before each step."""

    def __init__(self, env: TaskEnv, scale: float, before: Callable[[], None] | None) -> None:
        super().__init__(env)
        self._scale, self._before = scale, before

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Move one control step."""
        if self._before is not None:
            self._before()
        seen, reward, terminated, truncated, info = self.env.step(action)
        return seen, self._scale * float(reward), terminated, truncated, info


_session: Session | None = (
    None  # of this process: sheeprl makes worlds and callbacks by the names of functions
)


def make_world(*, seed: int, rank: int, **_: Any) -> gymnasium.Env[np.ndarray, np.ndarray]:
    """What sheeprl calls for each world."""
    assert _session is not None
    return _session.world(seed, rank)


def make_callback(**_: Any) -> Any:
    """What sheeprl calls for the writer of its checkpoints: ours writes one file, with our own history."""
    callback = importlib.import_module("sheeprl.utils.callback").CheckpointCallback
    session = _session
    assert session is not None

    class OneFile(callback):  # type: ignore[misc, valid-type]
        def on_checkpoint_coupled(
            self, fabric: Any, ckpt_path: str, state: dict[str, Any], replay_buffer: Any = None
        ) -> None:
            ends = self._ckpt_rb(replay_buffer)  # worlds begin anew when the run goes on
            content = {**state, "rb": replay_buffer, "fulmar": asdict(session.history)}
            with whole_file(session.checkpoint) as file:
                torch.save(content, file)
            self._experiment_consistent_rb(replay_buffer, ends)
            session.cfg.checkpoint.every = NEVER

    return OneFile()


def plan_of(algorithm: Dreamer, robot: Any, task: Any) -> DreamerPlan:
    """Structure of the policy that settings learn."""
    return DreamerPlan(
        inputs=len(Observer(robot, task).names),
        recurrent=algorithm.recurrent,
        groups=algorithm.groups,
        classes=algorithm.classes,
        dense=algorithm.dense,
        layers=algorithm.layers,
        command_scale=tuple(float(value) for value in robot.actuators.scale),
    )


def load_checkpoint(path: Path) -> dict[str, Any]:
    """What `make_callback`'s writer wrote; pickled objects: for one's own runs.

    Raises:
        ConfigError: No such file, or not a checkpoint of DreamerV3.
    """
    try:
        content = torch.load(path, weights_only=False)
        History(**content["fulmar"])
    except OSError as error:
        raise ConfigError(f"{path}: no checkpoint to resume from ({error.strerror}).") from error
    except Exception as error:  # pickle raises exceptions of all kinds
        raise ConfigError(
            f"{path}: is no checkpoint of DreamerV3 ({type(error).__name__}). Begin again in another folder."
        ) from error
    return dict(content)


def learn(session: Session) -> dict[str, Any]:
    """Run sheeprl until the session ends it; returns what the run's record says of it."""
    cli = importlib.import_module("sheeprl.cli")
    module = importlib.import_module("sheeprl.algos.dreamer_v3.dreamer_v3")
    build, train = module.build_agent, module.train

    def seen(*arguments: Any, **options: Any) -> Any:
        agent = build(*arguments, **options)
        session.see(agent[0], agent[1])
        return agent

    def counted(*arguments: Any, **options: Any) -> Any:
        session.history.updates += 1
        return train(*arguments, **options)

    module.build_agent, module.train = seen, counted
    session.cfg = sheeprl_settings(session.request, session.settings)
    with contextlib.suppress(RunIsOver):
        cli.run_algorithm(session.cfg)
    history = session.history
    return {
        "steps": history.steps,
        "updates": history.updates,
        "wall_s": round(session.elapsed_s, 1),
        "cpu_s": round(history.cpu_s, 2),
        "steps_per_s": round(history.steps / max(session.elapsed_s, 1e-9)),
        "interrupted": session.interrupted,
        "best": history.best,
        "curve": session.curve.points if session.curve is not None else history.checks,
        "versions": {name: version(name) for name in ("sheeprl", "torch", "lightning", "numpy")}
        | {"python": platform.python_version()},
    }


def main() -> int:
    """Learn what the request on the command line asks for; the second argument is the file descriptor of reports."""
    global _session
    reports = os.fdopen(int(sys.argv[2]), "w", encoding="utf-8")

    def report(kind: str, values: dict[str, Any]) -> None:
        reports.write(json.dumps({"kind": kind, **values}) + "\n")
        reports.flush()

    torch.set_num_threads(1)
    try:
        _session = Session(Request.from_json(sys.argv[1]), report)
        threading.Thread(target=_follow, args=(_session.stopped,), daemon=True).start()
        report("done", learn(_session))
    except FulmarError as error:
        report("refused", {"error": str(error)})
        return 2
    return 0


def _follow(stopped: threading.Event) -> None:
    """Ask for the end once the parent closes standard input, or dies."""
    while os.read(sys.stdin.fileno(), 1):
        pass
    stopped.set()


if __name__ == "__main__":
    # The module that sheeprl imports has the session, `__main__` has not.
    from training import dreamer_learning

    raise SystemExit(dreamer_learning.main())
