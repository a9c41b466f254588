"""Control steps in a bag: what a controller observed, received and answered, step by step."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bags.contents import Bag
from fulmar_bags.controller_changes import controller_changes
from fulmar_bags.decode import NS, Odometries, Vectors, by_stamp, odometries
from fulmar_bags.gathered import Topic
from fulmar_bags.reading_messages import reader_of
from fulmar_bags.recorded_estop import estop_messages
from fulmar_bags.wire_reader import ABSENT, Received, WireReader
from fulmar_core.config.errors import BagError, ConfigError
from fulmar_core.estimators.readings import ReadingKind
from fulmar_core.loop.controller_settings import ControllerSettings
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import (
    ACTION,
    ACTUATORS_STATE,
    AIR_BEARING,
    NEIGHBOURS,
    OBSERVATION,
    VELOCITY_COMMAND,
    command_wire,
)
from fulmar_core.safety.geofence import NO_AREA
from fulmar_core.tasks import Task, load_recorded_task, load_task
from fulmar_core.tasks.goal import PoseTuple
from fulmar_core.tasks.goal_numbers import GOAL, goes_to_places, whole_pose
from fulmar_core.wires.neighbours import motions_in, readings_of
from fulmar_core.wires.reading import Reading
from fulmar_core.wires.robot_name import Frames


@dataclass(frozen=True)
class ControlSteps:
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
    acted: np.ndarray  # (n,) whether the controller was asked; True where that is not known
    odometry: Odometries
    sample: np.ndarray  # (n,) index into the odometry, ABSENT where it is not in the bag
    goals: tuple[Received, ...]
    obstacles: tuple[Received, ...]
    things: dict[str, tuple[Received, ...]]  # poses of the things of the task, by name
    presses: tuple[Received, ...]  # of the e-stop, see `estop_messages`
    bearing: tuple[Received, ...]  # the air bearing: true is on; empty where nothing is recorded of one
    applied: Vectors  # what the actuators did from each stamp on; empty where that is not recorded
    changes: tuple[Received, ...]  # `ControllerChange`s
    warnings: tuple[str, ...]
    reader: WireReader

    def __len__(self) -> int:
        """Number of control steps."""
        return len(self.stamp_ns)

    @property
    def answered(self) -> bool:
        """Whether the bag holds anything that a controller answered."""
        return bool(np.isfinite(self.actions).any() or np.isfinite(self.commands).any())

    def readings(self, kind: ReadingKind) -> tuple[Received, ...]:
        """What the bag holds of a reading, as `Reading`s in their order."""
        read = reader_of(kind)

        def value_of(message: Any, frames: Frames) -> tuple[Reading | None, str]:
            found = read(message, frames)
            return (None, found) if isinstance(found, str) else (found, "")

        return self.reader.received(kind.wire, value_of)

    def neighbours(self) -> tuple[Received, ...]:
        """Where the robots of the fleet were that a guard keeps apart from this one, as `readings_of` gives it."""
        names = [other.name for other in self.settings.others]

        def value_of(message: Any, _frames: Frames) -> tuple[Any, str]:
            motions = motions_in(message)
            found = None if motions is None else readings_of(motions, names)
            return found, "" if found is not None else "a robot is missing"

        return self.reader.received(NEIGHBOURS, value_of) if names else ()

    def changes_by_step(self) -> dict[int, list[Received]]:
        """`changes` by the step from which on each controls."""
        found: dict[int, list[Received]] = defaultdict(list)
        for each in self.changes:
            step = int(np.searchsorted(self.log_ns, each.log_ns))
            same = np.flatnonzero(self.stamp_ns == each.stamp_ns) if each.stamp_ns else np.zeros(0, int)
            if len(same):  # by the clock, one measurement may be answered twice
                later = [index for index in same if self.log_ns[index] >= each.log_ns]
                step = int(later[0] if later else same[0])
            found[step].append(each)
        return found

    def before(self, received: tuple[Received, ...]) -> dict[int, list[Received]]:
        """Messages by the step that they came before; the number of steps for those that came after all of them.

        A goal node stamps its messages with the odometry that they belong to. Others count from when they came.
        """
        found: dict[int, list[Received]] = defaultdict(list)
        for each in received:
            if self.settings.goals_streamed and each.stamp_ns:
                step = int(np.searchsorted(self.stamp_ns, each.stamp_ns))
            else:
                step = int(np.searchsorted(self.log_ns, each.log_ns))
            found[step].append(each)
        return found


def control_steps_of(
    bag: Bag,
    *,
    robot: str | None = None,
    task: str | None = None,
    goal: PoseTuple | None = None,
    control_hz: float | None = None,
    odometry: str | None = None,
) -> ControlSteps:
    """Read the control steps of a bag.

    Args:
        bag: The bag.
        robot: Whose it is; by default the bag says it.
        task: What was to be done; by default the bag says it.
        goal: As `State.NUMBERS` [m, deg], where the bag holds no goal.
        control_hz: Command rate, where the bag does not say it [Hz].
        odometry: Topic, where there are several.

    Raises:
        BagError: The bag holds nothing that a controller could be shown, or does not say what is needed.
        ConfigError: Unknown name.
    """
    the_robot = load_robot(_name(bag, "robot", robot))
    task = task or bag.reading.task
    thing = str((bag.info or {}).get("thing") or "")
    the_task = load_task(task) if task else load_recorded_task(_name(bag, "task", None), bag.path, thing)
    the_task.check_running(the_robot)
    reader = WireReader(bag)
    settings = _settings(bag, the_robot, the_task, control_hz, reader.warnings)
    wire, names = command_wire(the_robot), the_robot.actuators.names
    commands = reader.vectors(wire)
    if wire is not VELOCITY_COMMAND:
        commands = _checked(commands, names, wire.name, reader.warnings)
    actions = _checked(reader.vectors(ACTION), names, ACTION.name, reader.warnings)
    observations = reader.vectors(OBSERVATION, "position")
    seen = _in_plain_frames(_odometry_of(bag, odometry, needed=not len(observations)), bag.frames)
    # Who stamps commands by another clock, or not at all, answers by the time of recording.
    unmatched = bool(len(commands)) and not np.isin(commands.stamp_ns, seen.stamp_ns).any()
    by_time = unmatched and bool(len(seen)) and not len(observations)
    steps = [] if by_time else _steps(observations, commands)
    if not steps:
        seen = reader.with_times(seen)
        steps = _even_steps(seen, settings.control_rate(the_robot))
    if not steps:
        raise BagError(f"{bag.path}: holds neither observations nor odometry; there is nothing to run again.")
    stamp_ns = np.array([stamp for stamp, _, _, _ in steps], dtype=np.int64)
    log_ns = np.maximum.accumulate(np.array([log for _, log, _, _ in steps], dtype=np.int64))
    shown = np.array([index for _, _, index, _ in steps])
    answers = np.array([index for _, _, _, index in steps])
    plain = reader.unstamped_commands() if wire is VELOCITY_COMMAND and not len(commands) else None
    if plain is not None:
        commands = plain
    if plain is not None or by_time:
        answers = answers_within(log_ns, commands.log_ns)
    return ControlSteps(
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
        goals=tuple(reader.goals(the_task)) if goal is None else (_given(goal, the_robot, int(log_ns[0])),),
        obstacles=reader.obstacles(),
        things=reader.things(the_task),
        presses=estop_messages(reader),
        bearing=reader.received(AIR_BEARING),
        applied=_checked(reader.vectors(ACTUATORS_STATE), names, ACTUATORS_STATE.name, reader.warnings),
        changes=controller_changes(reader),
        warnings=tuple(reader.warnings),
        reader=reader,
    )


def _settings(
    bag: Bag, robot: Robot, task: Task, control_hz: float | None, warnings: list[str]
) -> ControllerSettings:
    """Settings of the controller node of a run: its guards and rate, as the bag names them."""
    info = bag.info or {}
    guards, recording = info.get("guards") or {}, info.get("recording")
    hz, rate = control_hz or bag.number("control_hz", 0.0), bag.number("rate", 1.0)
    try:
        area = tuple(float(side) for side in guards.get("area") or NO_AREA)
        max_run_time_s = float(guards.get("max_run_time_s") or 0.0)
        in_parts = isinstance(recording, Mapping) and recording.get("mode") in ("ring", "goals")
        if max_run_time_s and in_parts:
            max_run_time_s = 0.0
            warnings.append("the bag begins within its run: max_run_time is not checked.")
        return ControllerSettings(
            robot=robot.name,
            task=task.name,
            thing=task.thing,
            control_hz=hz,
            lockstep=bool(info.get("lockstep")),
            rate=rate,
            goals_streamed=bool(info.get("goals")),
            excitation=str(info.get("excitation") or ""),
            seed=int(info.get("seed") or 0),
            fallback=str(guards.get("fallback") or ""),
            estop=bool(guards.get("estop")),
            max_run_time_s=max_run_time_s,
            area=area,
            guard=str(guards.get("guard") or ""),
            neighbours=tuple(str(text) for text in info.get("neighbours") or ("",)),
            formation=str(info.get("formation") or ""),
        )
    except (AttributeError, TypeError, ValueError) as error:
        raise BagError(
            f"the run record of the bag has invalid settings: {str(error).rstrip('.')}."
        ) from error


def _name(bag: Bag, key: str, given: str | None) -> str:
    value = given or bag.reading.named.get(key) or (bag.info or {}).get(key)
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


def _checked(found: Vectors, names: tuple[str, ...], topic: str, warnings: list[str]) -> Vectors:
    """Vectors of the robot's actuators; none where they are of others."""
    if len(found) and found.names == names:
        return found
    if len(found):
        warnings.append(f"{topic} is about {', '.join(found.names)}, not about {', '.join(names)}: left out.")
    empty = np.zeros(0, dtype=np.int64)
    return Vectors(names, empty, empty, empty, np.zeros((0, len(names))), found.left_out + len(found))


def _steps(observations: Vectors, commands: Vectors) -> list[tuple[int, int, int, int]]:
    """Stamp, time of recording, index of the observation and of the command of each step, in order.

    A step with an observation is one where the controller was asked; a command without one was the safe one, or was
    repeated. Messages belong together by their stamp; where a stamp comes several times, by their order.
    """
    waiting = by_stamp(commands.stamp_ns)
    steps: list[tuple[int, int, int, int]] = []
    for index, (stamp, log) in enumerate(zip(observations.stamp_ns, observations.log_ns, strict=True)):
        mine = waiting.get(int(stamp))
        answer = mine.pop() if mine else ABSENT
        came = min(int(log), int(commands.log_ns[answer])) if answer != ABSENT else int(log)
        steps.append((int(stamp), came, index, answer))
    known = {stamp for stamp, _, _, _ in steps}
    for stamp, rest in waiting.items():
        for index in sorted(rest):
            if stamp in known and index:  # a repetition: the command got lost or was the last one
                continue
            known.add(stamp)
            steps.append((stamp, int(commands.log_ns[index]), ABSENT, index))
    return sorted(steps, key=lambda step: step[1])


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
    waiting = by_stamp(others)
    found = np.full(len(stamp_ns), ABSENT)
    for step in np.flatnonzero(wanted):
        mine = waiting.get(int(stamp_ns[step]))
        if mine:
            found[step] = mine.pop()
    return found


def _first_of(stamps: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Index of the first message of each wanted stamp, ABSENT where there is none."""
    first: dict[int, int] = {}
    for index, stamp in enumerate(stamps.tolist()):
        first.setdefault(stamp, index)
    return np.array([first.get(stamp, ABSENT) for stamp in wanted.tolist()])


def _given(pose: PoseTuple, robot: Robot, log_ns: int) -> Received:
    """A goal in the place of those in the bag, as people write poses of a robot.

    Raises:
        ConfigError: As in `whole_pose`; or it is a place alone.
    """
    form = robot.state_type
    numbers = whole_pose(pose, robot, GOAL)
    if len(pose) == form.AXES and goes_to_places(robot, GOAL):
        raise ConfigError(
            f"{GOAL} has {len(pose)} numbers; a pose in {form.WORLD} is {','.join(form.NUMBERS)} in m and degrees."
        )
    return Received(log_ns, 0, form.rigid_targets(form.target_at(numbers), twists=False)[None])


def answers_within(steps_ns: np.ndarray, commands_ns: np.ndarray) -> np.ndarray:
    """Index of the first command after each step and before the next one, ABSENT where there is none, shape (n,).

    Args:
        steps_ns: When each step began, rising, shape (n,) [ns].
        commands_ns: When each command was recorded, rising [ns].
    """
    first = np.searchsorted(commands_ns, steps_ns)
    ends = np.append(steps_ns[1:], np.iinfo(np.int64).max)
    there = first < len(commands_ns)
    there[there] = commands_ns[first[there]] < ends[there]
    return np.where(there, first, ABSENT)


def policy_folder(bag: Bag) -> Path | None:
    """The bundle that drove the recorded run, where the bag names it and it still exists."""
    named = (bag.info or {}).get("policy")
    folder = Path(str(named)) if named else None
    return folder if folder is not None and folder.is_dir() else None
