"""One controller evaluated over many episodes, in one of several ways; what `evaluate` and `benchmark` share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fulmar_bringup.run_plan import RunPlan
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.own_class import is_own
from fulmar_core.controllers.controller import Controller
from fulmar_core.estimators.readings import readings_of
from fulmar_core.loop.fallback import warm_up
from fulmar_core.loop.policy_bundle import read_passport
from fulmar_core.loop.rollout import WORLDS, batches, roll_out_in_backends
from fulmar_core.robots.basilisk_robots import BASILISK
from fulmar_core.robots.jsbsim_models import jsbsim_model
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.geofence import check_starts
from fulmar_core.simulation.backend import Backend
from fulmar_core.simulation.episode import Episode, draw_episodes
from fulmar_core.simulation.metrics import Trajectories, episode_metrics, successes, summarise
from fulmar_core.tasks import Task
from fulmar_core.tasks.path_task import evaluated_task
from fulmar_core.worlds.scenario import Scenario, load_scenario
from fulmar_evaluation.coverage.of_runs import EPISODES as EPISODES_COVERED
from fulmar_evaluation.coverage.of_runs import with_coverage
from fulmar_evaluation.waypoint_score import bound_figures, has_bound, waypoint_bound
from policy_server.own_controller import OwnController
from sim_nodes.camera.opengl import check_loadable

if TYPE_CHECKING:
    from fulmar_evaluation.ros_evaluation import RosPool

# Aircraft may go through `jsbsim` and `jsbsim:MODEL` too, spacecraft and satellites through `basilisk`.
WAYS = ("batch", "mujoco", "ros")
EPISODES, BATCH_EPISODES = 256, 4096  # by default; the second in the batch
BOUNDED_EPISODES = 256  # whose bound `evaluate` computes by default: a boat's takes 40 ms each
Progress = Callable[[int], None]


@dataclass(frozen=True)
class Trial:
    """What to evaluate, and how."""

    plan: RunPlan  # robot, task, controller, rate, scenario, seed; its duration is the length of an episode
    through: str  # one of WAYS, `jsbsim`, `jsbsim:MODEL` or `basilisk`
    episodes: int
    worlds: int = WORLDS  # of a batch at once
    jobs: int = 1  # pairs of processes, through ros
    bounded: int = BOUNDED_EPISODES  # episodes whose bound is computed

    @property
    def robot(self) -> Robot:
        """The robot."""
        return load_robot(self.plan.robot)

    @property
    def task(self) -> Task:
        """The task, with the length of its episodes."""
        plan = self.plan
        return evaluated_task(
            plan.task, thing=plan.thing, along=plan.along, episode_s=plan.duration_s, goals=plan.goals
        )

    def controller(self) -> Controller:
        """The controller, made anew."""
        from policy_server.controllers import Choice, load_controller

        plan = self.plan
        choice = Choice(plan.control_hz, plan.policy, seed=plan.seed)
        if is_own(plan.controller):  # says what is wrong with its actions
            warm_up(load_controller(plan.controller, self.robot, self.task, choice), self.robot, self.task)
        return load_controller(plan.controller, self.robot, self.task, choice)

    def drawn(self, numbers: np.ndarray) -> Episode:
        """What the episodes of some numbers begin with."""
        scenario = load_scenario(self.plan.scenario)
        return draw_episodes(self.robot, self.task, scenario, seed=self.plan.seed, numbers=numbers)


def runs_of(
    trial: Trial,
    progress: Progress = lambda steps: None,
    *,
    pool: RosPool | None = None,
    controller: Controller | None = None,
) -> Iterator[Trajectories]:
    """Run the episodes of a trial, in their order.

    Args:
        trial: What to run.
        progress: Called with how many control steps have been done.
        pool: Processes that stay for one trial after another, through ros; by default it has its own.
        controller: The trial's, where the caller wants to look at it afterwards; not through ros.

    Yields:
        What happened, for the next so many episodes.

    Raises:
        ConfigError: An episode is shorter than one control step, or may start beyond the robot's geofence; or, through
            ros, the controller takes images.
        RunFailed: Through ros, the controller ended or refused to start.
        LockstepError: Through ros, it did not answer in time.
    """
    plan = trial.plan
    check_starts(trial.robot, trial.task)
    if trial.through == "ros":
        from fulmar_evaluation.ros_evaluation import roll_out_through_ros

        if _takes_images(trial):
            raise ConfigError(
                f"'{plan.policy or plan.controller}' takes images, and evaluations --through ros run no camera. "
                f"Evaluate it with --through mujoco, or fly it: fulmar run {plan.robot} --task {plan.task} --lockstep."
            )
        if pool is not None:
            yield pool.roll_out(plan, episodes=trial.episodes, progress=progress)
        else:
            yield roll_out_through_ros(plan, episodes=trial.episodes, jobs=trial.jobs, progress=progress)
        return
    robot, task, scenario = trial.robot, trial.task, load_scenario(plan.scenario)
    if trial.through == "batch":
        yield from batches(
            controller or trial.controller(),
            robot,
            task,
            scenario,
            episodes=trial.episodes,
            seed=plan.seed,
            worlds=trial.worlds,
            progress=progress,
        )
        return
    from sim_nodes.sight import sight_of

    acting = controller or trial.controller()
    with sight_of(acting, robot, task) as sight:
        yield roll_out_in_backends(
            acting,
            _simulator(trial, robot, task, scenario),
            task,
            scenario,
            episodes=trial.episodes,
            seed=plan.seed,
            progress=progress,
            sight=sight,
        )


def _takes_images(trial: Trial) -> bool:
    """Whether the controller of a trial sees: its policy by the passport, one of the user's own by its readings."""
    plan = trial.plan
    if plan.policy:
        return read_passport(Path(plan.policy)).image is not None
    if not is_own(plan.controller):
        return False
    known = readings_of(trial.robot)
    return any(name in known and known[name].image for name in trial.controller().readings)


def _simulator(trial: Trial, robot: Robot, task: Task, scenario: Scenario) -> Callable[[], Backend]:
    """What builds one simulator of a trial through MuJoCo, JSBSim or Basilisk."""
    if trial.through == "mujoco":
        check_loadable()
        from sim_nodes.mujoco_backend import MujocoBackend

        return lambda: MujocoBackend.of(robot, task, scenario)
    if trial.through == BASILISK:
        from sim_nodes.basilisk_backend import BasiliskBackend

        return lambda: BasiliskBackend.of(robot, task, scenario)
    from sim_nodes.jsbsim_backend import JsbsimBackend

    model = jsbsim_model(robot, trial.through)
    return lambda: JsbsimBackend.of(robot, task, scenario, model)


class Tally:
    """Figures of episodes, gathered run by run: of a step nothing is kept."""

    def __init__(self, task: Task, robot: Robot | None = None) -> None:
        """Begin empty; with the robot, what its camera saw is among the figures where the task asks for that."""
        self._task, self._robot, self._covered = task, robot, 0
        self._succeeded: list[np.ndarray] = []
        self._figures: list[dict[str, np.ndarray]] = []
        self.steps = 0

    def add(self, run: Trajectories) -> None:
        """Evaluate some more episodes."""
        self._succeeded.append(successes(run, self._task))
        figures = episode_metrics(run, self._task)
        if self._robot is not None:
            most = max(0, EPISODES_COVERED - self._covered)
            figures = with_coverage(figures, run, self._robot, self._task, most=most)
            self._covered += len(run.x)
        self._figures.append(figures)
        self.steps += run.x.size

    @property
    def succeeded(self) -> np.ndarray:
        """Which episodes succeeded, shape (episodes,)."""
        return np.concatenate(self._succeeded)

    @property
    def figures(self) -> dict[str, np.ndarray]:
        """Every figure of every episode, shapes (episodes,)."""
        return {
            name: np.concatenate([figures[name] for figures in self._figures]) for name in self._figures[0]
        }


def evaluate_trial(trial: Trial, progress: Progress = lambda steps: None) -> dict[str, Any]:
    """Run and evaluate a trial; arguments and errors as in `runs_of`.

    Returns:
        Success rate and every figure, JSON-ready. Where waypoints are counted, also what physics allows in the first
        `bounded`: `bound`, the rule in words, and the shares of it. `warnings` of a controller of the user's own.
    """
    tally, controller = Tally(trial.task, trial.robot), None if trial.through == "ros" else trial.controller()
    for run in runs_of(trial, progress, controller=controller):
        tally.add(run)
    figures, more = tally.figures, dict[str, Any]()
    if has_bound(trial.task):
        numbers = np.arange(min(trial.episodes, trial.bounded))
        bound = waypoint_bound(trial.robot, trial.task, trial.drawn(numbers), trial.task.episode_s)
        goals = figures["goals_reached"]
        figures |= bound_figures(goals, bound)
        more = {
            "bound": bound.rule,
            "bound_episodes": len(numbers),
            "share_of_mean_bound": share_of_mean(goals[: len(numbers)], bound.goals),
        }
    beyond = controller.range.warning if isinstance(controller, OwnController) else ""
    more |= {"warnings": [beyond]} if beyond else {}
    return {**summarise(tally.succeeded, figures), **more, "control_steps": tally.steps}


def share_of_mean(goals: np.ndarray, bound: np.ndarray) -> float | None:
    """Mean of the goals over the mean of their bounds; None where nothing can be reached."""
    most = float(np.mean(bound))
    return float(np.mean(goals)) / most if most > 0.0 else None
