"""What a controller went through in a bag: what it was shown step by step, what it was told, what it answered."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bringup.bags.contents import Bag, Topic
from fulmar_bringup.bags.decode import (
    Odometries,
    Vectors,
    joint_vectors,
    messages,
    odometries,
    stamp_of,
    twist_vectors,
)
from fulmar_bringup.bags.guarded import begins_with_its_run, changes_of, limits_of, number_of, presses_of
from fulmar_bringup.bags.plain_twist import answers_within, plain_commands
from fulmar_bringup.bags.told import ABSENT, Told
from fulmar_bringup.planning import PoseTuple
from fulmar_core.controller_settings import ControllerSettings
from fulmar_core.errors import BagError, ConfigError
from fulmar_core.goal import Goal, goal_at
from fulmar_core.robot import Robot, load_robot
from fulmar_core.robot_name import Frames
from fulmar_core.tasks import Task, load_recorded_task, load_task
from fulmar_core.topics import (
    ACTION,
    ACTUATORS_STATE,
    AIR_BEARING,
    OBSERVATION,
    OBSTACLES,
    VELOCITY_COMMAND,
    Wire,
    command_wire,
    goal_wires,
)
from fulmar_ros.message_reader import goal_of, obstacles_of, thing_of

NS = 1_000_000_000


@dataclass(frozen=True)
class Course:
    """The control steps of one bag, in their order, with everything that belongs to each."""

    robot: Robot
    task: Task
    settings: ControllerSettings
    own: bool  # whether Fulmar recorded it
    stamp_ns: np.ndarray  # (n,) of the odometry that each step answers
    log_ns: np.ndarray  # (n,) when the first trace of it was recorded
    observations: np.ndarray  # (n, k) NaN where the controller was not asked, or nothing is known
    observation_names: tuple[str, ...]  # empty: none were recorded
    actions: np.ndarray  # (n, m) NaN where unknown
    commands: np.ndarray  # (n, m) NaN where unknown
    acted: np.ndarray  # (n,) whether the controller was asked; nothing but True where that is not known
    odometry: Odometries
    sample: np.ndarray  # (n,) index into the odometry, ABSENT where it is not in the bag
    goals: tuple[Told, ...]
    obstacles: tuple[Told, ...]
    things: dict[str, tuple[Told, ...]]  # poses of the things of the task, by name
    presses: tuple[Told, ...]  # of the e-stop, see `presses_of`
    bearing: tuple[Told, ...]  # the air bearing: true is on; empty where nothing is recorded of one
    applied: Vectors  # what the actuators did from each stamp on; empty where that is not recorded
    changes: tuple[Told, ...]  # folder and SHA-256 of policies that took over
    warnings: tuple[str, ...]

    def __len__(self) -> int:
        """Number of control steps."""
        return len(self.stamp_ns)

    @property
    def answered(self) -> bool:
        """Whether the bag holds anything that a controller answered."""
        return bool(np.isfinite(self.actions).any() or np.isfinite(self.commands).any())

    def before(self, told: tuple[Told, ...]) -> dict[int, list[Told]]:
        """What was told, by the step that it came before; the number of steps for what came after all of them.

        What a goal node sends is stamped with the odometry that it belongs to. Anything else counts from when it came.
        """
        found: dict[int, list[Told]] = defaultdict(list)
        for each in told:
            if self.settings.goals_streamed and each.stamp_ns:
                step = int(np.searchsorted(self.stamp_ns, each.stamp_ns))
            else:
                step = int(np.searchsorted(self.log_ns, each.log_ns))
            found[step].append(each)
        return found


def course_of(
    bag: Bag,
    *,
    robot: str | None = None,
    task: str | None = None,
    goal: PoseTuple | None = None,
    control_hz: float | None = None,
    odometry: str | None = None,
) -> Course:
    """What a controller went through.

    Args:
        bag: The bag.
        robot: Whose it is; by default the bag says it.
        task: What was to be done; by default the bag says it.
        goal: x [m], y [m], heading [deg], where the bag holds no goal.
        control_hz: Command rate, where the bag does not say it [Hz].
        odometry: Topic, where there are several.

    Raises:
        BagError: The bag holds nothing that a controller could be shown, or does not say what is needed.
        ConfigError: Unknown name.
    """
    info = bag.info or {}
    the_robot = load_robot(_name(bag, "robot", robot))
    the_task = load_task(task) if task else load_recorded_task(_name(bag, "task", None), bag.path)
    the_task.check(the_robot)
    warnings: list[str] = list(bag.warnings)
    limits = limits_of(info)
    if limits["max_run_time_s"] and not begins_with_its_run(info):
        limits["max_run_time_s"] = 0.0
        warnings.append("the bag begins within its run: whether max_run_time was over is not judged.")
    hz, rate = control_hz or number_of(info, "control_hz", 0.0), number_of(info, "rate", 1.0)
    try:
        settings = ControllerSettings(
            robot=the_robot.name,
            task=the_task.name,
            control_hz=hz,
            lockstep=bool(info.get("lockstep")),
            rate=rate,
            goals_streamed=bool(info.get("goals")),
            **limits,
        )
    except ValueError as error:
        raise BagError(f"what the bag says of its run makes no sense: {error}") from error
    wire = command_wire(the_robot)
    names = the_robot.actuators.names
    read = twist_vectors if wire is VELOCITY_COMMAND else (lambda topic: joint_vectors(topic, "effort"))
    commands = _checked(read(bag.of(wire)), names, wire.name, warnings, by_name=wire is not VELOCITY_COMMAND)
    actions = _checked(joint_vectors(bag.of(ACTION), "effort"), names, ACTION.name, warnings)
    observations = joint_vectors(bag.of(OBSERVATION), "position")
    if observations.left_out:
        warnings.append(f"{observations.left_out} messages of {OBSERVATION.name} cannot be read.")
    seen = _in_plain_frames(_odometry_of(bag, odometry, needed=not len(observations)), bag.frames)
    # Who stamps commands by another clock, or not at all, answers by the time of recording.
    unmatched = bool(len(commands)) and not np.isin(commands.stamp_ns, seen.stamp_ns).any()
    by_time = unmatched and bool(len(seen)) and not len(observations)
    steps = [] if by_time else _steps(observations, commands)
    if not steps:
        seen = _timed(seen, warnings)
        steps = _even_steps(seen, settings.control_rate(the_robot))
    if not steps:
        raise BagError(f"{bag.path}: holds neither observations nor odometry; there is nothing to run again.")
    stamp_ns = np.array([stamp for stamp, _, _, _ in steps], dtype=np.int64)
    log_ns = np.maximum.accumulate(np.array([log for _, log, _, _ in steps], dtype=np.int64))
    shown = np.array([index for _, _, index, _ in steps])
    answers = np.array([index for _, _, _, index in steps])
    plain = plain_commands(bag) if wire is VELOCITY_COMMAND and not len(commands) else None
    if plain is not None:
        commands = plain
    if plain is not None or by_time:
        answers = answers_within(log_ns, commands.log_ns)
    return Course(
        robot=the_robot,
        task=the_task,
        settings=settings,
        own=bag.info is not None,
        stamp_ns=stamp_ns,
        log_ns=log_ns,
        observations=_rows(observations.values, shown),
        observation_names=observations.names,
        actions=_rows(actions.values, _matching(stamp_ns, shown != ABSENT, actions.stamp_ns)),
        commands=_rows(commands.values, answers),
        acted=shown != ABSENT if len(observations) else np.ones(len(steps), dtype=bool),
        odometry=seen,
        sample=_first_of(seen.stamp_ns, stamp_ns),
        goals=_goals(bag, the_task, goal, int(log_ns[0]), warnings),
        obstacles=_told(bag, OBSTACLES, obstacles_of, warnings),
        things={thing.name: _told(bag, thing.wire, thing_of, warnings) for thing in the_task.things},
        presses=presses_of(bag),
        bearing=tuple(
            Told(log, 0, bool(m.data), index) for index, (log, m) in enumerate(messages(bag.of(AIR_BEARING)))
        ),
        applied=_checked(
            joint_vectors(bag.of(ACTUATORS_STATE), "effort"), names, ACTUATORS_STATE.name, warnings
        ),
        changes=changes_of(bag),
        warnings=tuple(warnings),
    )


def _name(bag: Bag, key: str, given: str | None) -> str:
    value = given or (bag.info or {}).get(key)
    if not isinstance(value, str) or not value:
        raise ConfigError(f"{bag.path}: the bag does not say its {key}. Give --{key}.")
    return value


def _odometry_of(bag: Bag, chosen: str | None, *, needed: bool) -> Odometries:
    try:
        return odometries(bag.odometry(chosen))
    except BagError:
        if needed:
            raise
        return odometries(Topic("", "nav_msgs/msg/Odometry"))


def _in_plain_frames(seen: Odometries, frames: Frames) -> Odometries:
    """Odometry without the prefix of its robot's frames."""
    names = {name: frames.plain(name) for name in {*seen.frame, *seen.child_frame}}
    return replace(
        seen,
        frame=tuple(names[name] for name in seen.frame),
        child_frame=tuple(names[name] for name in seen.child_frame),
    )


def _checked(
    found: Vectors, names: tuple[str, ...], topic: str, warnings: list[str], *, by_name: bool = True
) -> Vectors:
    """Vectors that are about the robot's actuators; none where they are about others."""
    if found.left_out:
        warnings.append(f"{found.left_out} messages of {topic} cannot be read.")
    if len(found) and by_name and found.names != names:
        warnings.append(f"{topic} is about {', '.join(found.names)}, not about {', '.join(names)}: left out.")
        return Vectors(
            names,
            found.stamp_ns[:0],
            found.log_ns[:0],
            found.publish_ns[:0],
            np.zeros((0, len(names))),
            found.left_out + len(found),
        )
    return found if len(found) else replace(found, names=names, values=np.zeros((0, len(names))), left_out=0)


def _steps(observations: Vectors, commands: Vectors) -> list[tuple[int, int, int, int]]:
    """Stamp, time of recording, index of the observation and of the command of each step, in order.

    A step with an observation is one where the controller was asked; a command without one was the safe one, or was
    repeated. Messages belong together by their stamp; where a stamp comes several times, by their order.
    """
    waiting: dict[int, list[int]] = defaultdict(list)
    for index in range(len(commands) - 1, -1, -1):
        waiting[int(commands.stamp_ns[index])].append(index)
    steps: list[tuple[int, int, int, int]] = []
    for index, (stamp, log) in enumerate(zip(observations.stamp_ns, observations.log_ns, strict=True)):
        mine = waiting[int(stamp)]
        answer = mine.pop() if mine else ABSENT
        came = min(int(log), int(commands.log_ns[answer])) if answer != ABSENT else int(log)
        steps.append((int(stamp), came, index, answer))
    known = {stamp for stamp, _, _, _ in steps}
    for stamp, rest in waiting.items():
        for index in sorted(rest):
            if stamp in known and index:  # told again, because it got lost or was the last word
                continue
            known.add(stamp)
            steps.append((stamp, int(commands.log_ns[index]), ABSENT, index))
    return sorted(steps, key=lambda step: step[1])


def _timed(seen: Odometries, warnings: list[str]) -> Odometries:
    """Odometry whose stamps tell the time; where they never change, by when it was recorded."""
    if len(seen) < 2 or np.ptp(seen.stamp_ns) > 0:
        return seen
    warnings.append("the stamps of the odometry do not advance: the times of recording stand in for them.")
    return replace(seen, stamp_ns=seen.log_ns)


def _even_steps(seen: Odometries, control_hz: float) -> list[tuple[int, int, int, int]]:
    """One step each control period, on the odometry that is there then; a jump of time begins anew."""
    steps, due = [], -np.inf
    period_ns = NS / control_hz
    before = None
    for stamp, log in zip(seen.stamp_ns.tolist(), seen.log_ns.tolist(), strict=True):
        if before is not None and not 0 <= stamp - before <= 10 * NS:
            due = -np.inf
        before = stamp
        if stamp < due - 0.01 * period_ns:
            continue
        due = stamp + period_ns if stamp - due > period_ns or not np.isfinite(due) else due + period_ns
        steps.append((stamp, log, ABSENT, ABSENT))
    return steps


def _rows(values: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """Rows by index, NaN where there is none."""
    found = np.full((len(indices), values.shape[1]), np.nan)
    found[indices != ABSENT] = values[indices[indices != ABSENT]]
    return found


def _matching(stamp_ns: np.ndarray, wanted: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Index of what has the stamp of each wanted step; where a stamp comes several times, in their order."""
    waiting: dict[int, list[int]] = defaultdict(list)
    for index in range(len(others) - 1, -1, -1):
        waiting[int(others[index])].append(index)
    found = np.full(len(stamp_ns), ABSENT)
    for step in np.flatnonzero(wanted):
        mine = waiting[int(stamp_ns[step])]
        if mine:
            found[step] = mine.pop()
    return found


def _first_of(stamps: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Index of the first message of each wanted stamp, ABSENT where there is none."""
    first: dict[int, int] = {}
    for index, stamp in enumerate(stamps.tolist()):
        first.setdefault(stamp, index)
    return np.array([first.get(stamp, ABSENT) for stamp in wanted.tolist()])


def _goals(
    bag: Bag, task: Task, asked: PoseTuple | None, begin_ns: int, warnings: list[str]
) -> tuple[Told, ...]:
    found = [told for wire in goal_wires(task.goal_topic) for told in _told(bag, wire, goal_of, warnings)]
    found.sort(key=lambda each: each.log_ns)
    if asked is not None:
        found = [Told(begin_ns, 0, _goal(asked))]
    return tuple(found)


def _goal(pose: PoseTuple) -> Goal:
    return goal_at((pose[0], pose[1], float(np.deg2rad(pose[2]))))


def _told(
    bag: Bag, wire: Wire, read: Callable[[Any, Frames], tuple[Any, str]], warnings: list[str]
) -> tuple[Told, ...]:
    """What the messages of a wire say, without those that `read` finds a problem with."""
    found = []
    for index, (log, message) in enumerate(messages(bag.of(wire))):
        what, problem = read(message, bag.frames)
        if problem:
            warnings.append(f"a message of {wire.name} was left out: {problem}.")
            continue
        stamped = message.markers[:1] if wire is OBSTACLES else [message]
        found.append(Told(log, stamp_of(stamped[0]) if stamped else 0, what, index))
    return tuple(found)


def policy_folder(bag: Bag) -> Path | None:
    """The bundle that drove the recorded run, where the bag names it and it still exists."""
    named = (bag.info or {}).get("policy")
    folder = Path(str(named)) if named else None
    return folder if folder is not None and folder.is_dir() else None
