"""A recorded run seen through its task: errors over time, success, use of the actuators.

The rules themselves live in `fulmar_core.simulation.metrics`; here a record is only brought into their shape.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fulmar_bags.fuel import thrust_share
from fulmar_bags.run_record import Actuation, GivenGoal, Motion, Places, RunRecord
from fulmar_core.config.errors import BagError
from fulmar_core.loop.mission import LONGEST_AHEAD_NS, SLACK_NS
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.keep_out import drift_enters_s
from fulmar_core.simulation.metrics import (
    TargetCounter,
    Trajectories,
    TrajectoryLog,
    counts_targets,
    episode_metrics,
    successes,
)
from fulmar_core.states.state import State
from fulmar_core.tasks import Task, load_recorded_task
from fulmar_core.tasks.goal import Goal, stack_goals
from fulmar_evaluation.coverage.of_runs import with_coverage

KEEP_OUT_OF = "the keep-out volume of"  # how the words begin for what is entered, and not touched
LATE_NS = 1_000_000_000  # in real time a goal comes at most so long after its stamp


@dataclass(frozen=True)
class RunResult:
    """What the task says about a run; times count from its first state.

    As in `fulmar_core.simulation.metrics`, a step is the state at its end: the first state itself is none.
    """

    robot: Robot
    task: Task
    targets: np.ndarray  # (k, 3) of the last goal that was given; see `fulmar_core.tasks.goal.Goal`
    time_s: np.ndarray  # (n,) ends of the steps: evenly spaced, simulated time [s]
    samples: np.ndarray  # (n,) index into `record.motion` of each time
    aims: np.ndarray  # (n, 3) target that counted at each time
    things: dict[str, np.ndarray]  # (n, 3) where each thing of the task was, of those recorded [m, m, rad]
    run: Trajectories  # one episode of n steps; without a record of the actuators, its shares are NaN
    figures: dict[str, float]  # of `metrics.episode_metrics`; NaN or absent: there is none
    duration_s: float  # [s]
    progress: str | None  # how far the goals of a file came, in words; None: there was no such file
    unfinished: bool  # whether more was to come of them
    path: np.ndarray  # (m, 2 or, in space, 3) to be followed [m]; m may be 0

    @property
    def success(self) -> bool:
        """Whether the whole closing window was recorded and spent inside the tolerance, or enough targets reached.

        Where goals came from a file, it also is asked whether they came to their end; of waypoints only that is.
        """
        if self.unfinished or not self.long_enough:
            return False
        if self.progress is not None and self.counts:
            return not self.figures["collided"]
        return bool(successes(self.run, self.task)[0])

    @property
    def touched(self) -> str:
        """What the robot touched, or whose keep-out volume it entered; empty if neither."""
        if not self.figures["collided"]:
            return ""
        names = ", ".join(f"'{structure.name}'" for structure in self.task.structures)
        return f"{KEEP_OUT_OF} {names}" if names else self.robot.kind.obstacle

    @property
    def path_error_m(self) -> float | None:
        """Mean distance from the path [m]; None where none was to be followed."""
        if self.task.moves:
            return self.figure("path_error_m")
        if not len(self.path):
            return None
        axes = (self.run.x, self.run.y, self.run.z)[: self.path.shape[1]]
        place = np.stack([axis[0] for axis in axes if axis is not None], axis=-1)[:, None]
        begin, way = self.path[:-1], np.diff(self.path, axis=0)
        length = np.clip(np.sum(way * way, axis=-1), 1e-12, None)
        share = np.clip(np.sum((place - begin) * way, axis=-1) / length, 0.0, 1.0)
        gap = np.linalg.norm(begin + share[..., None] * way - place, axis=-1)
        return float(np.mean(np.min(gap, axis=1)))

    @property
    def target_moves(self) -> bool:
        """Whether the goal is a place that moves along a path."""
        return bool(len(self.path)) and self.task.goal_topic in ("goal_pose", "goal_point")

    @property
    def tracking_error(self) -> tuple[float | None, float | None]:
        """Mean distance and angle from a target that moves along a path [m, rad]; None where there is none."""
        if not self.target_moves:
            return None, None
        angle = self.run.attitude_error if self.task.goal_topic == "goal_pose" else None
        return float(np.mean(self.run.position_error)), None if angle is None else float(np.mean(angle))

    @property
    def counts(self) -> bool:
        """Whether the task is about how many targets one reaches."""
        return counts_targets(self.task)

    @property
    def long_enough(self) -> bool:
        """Whether the run lasted for the whole closing window; half a step is left to rounding."""
        return bool(self.time_s[-1] > self.task.tolerance.hold_s - 0.5 * self.run.control_dt)

    @property
    def window_start_s(self) -> float:
        """Where the closing window begins, in which success is decided [s]."""
        return max(0.0, self.duration_s - self.task.tolerance.hold_s)

    def figure(self, name: str) -> float | None:
        """A figure by its name in `figures.FIGURES`; None where there is none."""
        value = self.figures.get(name, np.nan)
        return float(value) if np.isfinite(value) else None


def evaluate_run(record: RunRecord) -> RunResult | None:
    """Evaluate a run by its task.

    Returns:
        The result; None if the record has fewer than two states.

    Raises:
        BagError: The record names no task or no goal.
        ConfigError: The task is not known here.
    """
    motion = record.motion
    if len(motion) < 2 or motion.stamp_s[-1] <= motion.stamp_s[0]:
        return None
    task = load_recorded_task(_text(record, "task"), record.path, str(record.info.get("thing") or ""))
    goals = [replace(goal, targets=task.state_type.targets_of(goal.targets)) for goal in _goals(record, task)]
    robot = load_robot(_text(record, "robot"))
    time_s, samples = _even(motion)
    form = task.state_type
    states = form.from_rigid(motion.states)
    things = {
        name: form.targets_of(_at(places, motion.stamp_s[samples])) for name, places in record.things.items()
    }
    newest = _newest(record, task, goals)[samples]
    goal = _goals_at(task, goals, newest, record.obstacles, states[samples], states[0], things, time_s[0])
    # Steps one after another have the shape of episodes side by side.
    log = TrajectoryLog(robot, task, float(time_s[0]))
    log.add(states[samples], goal, _applied(record.actuation, robot, motion.stamp_s[0] + time_s - time_s[0]))
    run = log.trajectories().mapped(lambda array: np.swapaxes(array, 0, 1))
    if run.thrust is not None:
        run = replace(run, thrust=run.thrust * thrust_share(robot, record.supply, motion.stamp_s[samples]))
    figures = with_coverage(episode_metrics(run, task), run, robot, task)
    if task.keep_outs:
        last = states[samples[-1:]].to_rigid()
        figures["drift_enters_s"] = drift_enters_s(
            task.keep_outs, last.position_in_world, last.velocity_in_world
        )
    return RunResult(
        robot=robot,
        task=task,
        targets=goals[-1].targets,
        time_s=time_s,
        samples=samples,
        aims=task.target_of(goal),
        things=things,
        run=run,
        figures={name: float(values[0]) for name, values in figures.items()},
        duration_s=float(motion.stamp_s[-1] - motion.stamp_s[0]),
        **_of_goal_file(record),
    )


def _of_goal_file(record: RunRecord) -> dict[str, Any]:
    """What the goal node reported last, and the path of that file."""
    said = record.last_health("goals")
    asked = bool(record.info.get("goals"))
    finished = said is not None and said.values.get("mode") == "finished"
    return {
        "progress": (said.values.get("progress", "") if said else "nothing was reported") if asked else None,
        "unfinished": asked and not finished and not record.info.get("endless"),
        "path": np.atleast_2d(np.array(record.info.get("path") or np.empty((0, 2)), dtype=float)),
    }


def _text(record: RunRecord, key: str) -> str:
    value = record.info.get(key)
    if not isinstance(value, str):
        raise BagError(f"{record.path}: names no {key}, found {value!r}. `fulmar report` takes --{key}.")
    return value


def _goals(record: RunRecord, task: Task) -> list[GivenGoal]:
    """Goals as they came; what was asked for if the bag has none."""
    given: list[GivenGoal] = []
    for goal in record.goals:
        # A goal file comes again and again, and any goal is repeated with its stamp for subscribers that come late.
        repeats = given and (record.info.get("goals") or 0.0 < goal.stamp_s == given[-1].stamp_s)
        again = repeats and np.array_equal(goal.targets, given[-1].targets)
        if len(goal.targets) and not again:
            given.append(goal)
    if given:
        return given
    asked: Any = record.info.get("goal")
    try:
        target = task.state_type.target_at([float(value) for value in asked])
    except (TypeError, ValueError):
        raise BagError(
            f"{record.path}: holds no goal on {task.goal_topic}, and its run information has {asked!r} for one."
        ) from None
    return [GivenGoal(-np.inf, -np.inf, task.state_type.rigid_targets(target[None], twists=False))]


def _newest(record: RunRecord, task: Task, given: list[GivenGoal]) -> np.ndarray:
    """Which of the goals counts at each state, shape (n,).

    Places count from when they came. Velocities, and goals of a goal node, are stamped with the time when they
    begin; messages of one time need not come into the bag in their order.
    """
    motion = record.motion
    now_ns = np.round(1e9 * motion.stamp_s).astype(np.int64)
    timed = task.goal_topic == "goal_velocity" or bool(record.info.get("goals"))
    late_ns = LONGEST_AHEAD_NS if record.info.get("lockstep") else LATE_NS
    begun: list[tuple[int, int]] = []  # when each begins, and its number
    for number, sample in enumerate(np.searchsorted(motion.log_s, [goal.log_s for goal in given]).tolist()):
        came_ns = int(now_ns[sample]) if sample < len(now_ns) else int(now_ns[-1]) + 1
        stamp_ns = round(1e9 * max(0.0, given[number].stamp_s))
        by_stamp = timed and stamp_ns and came_ns - late_ns <= stamp_ns <= came_ns + LONGEST_AHEAD_NS
        begin_ns = stamp_ns if by_stamp else came_ns
        while begun and begun[-1][0] >= begin_ns:
            begun.pop()
        begun.append((begin_ns, number))
    order = np.searchsorted([begin_ns for begin_ns, _ in begun], now_ns + SLACK_NS, side="right") - 1
    return np.array([number for _, number in begun])[order.clip(0)]


def _goals_at(
    task: Task,
    given: list[GivenGoal],
    newest: np.ndarray,
    obstacles: np.ndarray,
    states: State,
    first: State,
    things: dict[str, np.ndarray],
    dt: float,
) -> Goal:
    """The goal that counts at each step: its current target alone, shape (n,)."""
    # A thing without a message counts as being where the robot is.
    unseen = states.pose
    things = {thing.name: unseen for thing in task.things} | things
    counted: list[Goal] = []
    number, before, counter = -1, 0.0, None
    last = first
    for step, which in enumerate(newest):
        if counter is None or which != number:
            if counter is not None:  # what was reached so far counts on; of velocities, one more is over
                before += float(counter.goal.done) + (task.goal_topic == "goal_velocity")
            now = {name: pose[step] for name, pose in things.items()}
            begun = task.begun(Goal(given[which].targets, np.asarray(0.0), obstacles, now), last)
            counter, number = TargetCounter(task, begun, dt), which
        last = states[step]
        goal = counter.update(last, {name: pose[step] for name, pose in things.items()})
        discs = goal.obstacles if len(goal.obstacles) else np.zeros((1, 3))
        done = np.asarray(before + goal.done)
        counted.append(replace(goal, targets=goal.current[None], done=done, obstacles=discs))
    return stack_goals(counted)


def _at(places: Places, stamp_s: np.ndarray) -> np.ndarray:
    """Where a thing is at some times, shape (n, 7)."""
    return places.pose[np.clip(np.searchsorted(places.stamp_s, stamp_s + 1e-6, side="right") - 1, 0, None)]


def _even(motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Ends of evenly long steps, and the newest sample at each; a lost sample leaves the one before."""
    since = motion.stamp_s - motion.stamp_s[0]
    steps = np.diff(since)
    dt = float(np.median(steps[steps > 0.0]))
    time_s = dt * np.arange(1, round(since[-1] / dt) + 1)
    samples = np.searchsorted(since, time_s + 1e-3 * dt, side="right") - 1
    return time_s, samples


def _applied(applied: Actuation, robot: Robot, stamp_s: np.ndarray) -> np.ndarray:
    """What was applied from some times on, NaN where that is not known, shape (n, m)."""
    if not len(applied) or len(applied.names) != len(robot.actuators.names):
        return np.full((len(stamp_s), len(robot.actuators.names)), np.nan)
    newest = np.clip(np.searchsorted(applied.stamp_s, stamp_s + 1e-6, side="right") - 1, 0, None)
    return applied.effort[newest]
