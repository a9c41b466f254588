"""One recorded run as arrays, without ROS, as much of it as can be read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bringup.bags.contents import Bag, json_object, open_bag
from fulmar_bringup.bags.decode import (
    NS,
    Odometries,
    Vectors,
    joint_vectors,
    messages,
    odometries,
    stamp_of,
    twist_vectors,
)
from fulmar_bringup.bags.figures import controller_of
from fulmar_bringup.run_record import Actuation, GivenGoal, HealthSample, Motion, Places, RunRecord
from fulmar_core.errors import BagError, ConfigError
from fulmar_core.paths import config_names
from fulmar_core.rotation import rotate
from fulmar_core.tasks import Task, load_recorded_task
from fulmar_core.topics import (
    ACTUATORS_STATE,
    COMMAND,
    DIAGNOSTICS,
    GOAL_WIRES,
    METADATA,
    OBSTACLES,
    ODOMETRY,
    STATUS,
    TRUTH,
    VELOCITY_COMMAND,
    Wire,
    goal_wires,
)
from fulmar_ros.bag_writer import RUN_RECORD
from fulmar_ros.message_reader import goal_of, obstacles_of, thing_of

Decoded = list[tuple[int, Any]]  # when it was recorded [ns], and the message


def read_run(path: Path) -> RunRecord:
    """Read one run.

    Args:
        path: Bag folder, or a file in it.

    Returns:
        The run. What is damaged or missing is left out and named in `warnings`.

    Raises:
        BagError: There is no bag, it is empty, or Fulmar did not record it.
    """
    bag = open_bag(Path(path))
    if bag.info is None:
        found = ", ".join(list(bag.topics)[:3]) or "none"
        raise BagError(
            f"{bag.files[0]}: no recording of Fulmar: lacks '{RUN_RECORD}', topics: {found}. Give a bag of a run."
        )
    return _Reader(bag).record(bag.info)


def read_any_run(path: Path, *, task: str | None = None, robot: str | None = None) -> RunRecord:
    """Read a run that Fulmar need not have recorded, from whatever its bag holds.

    Args:
        path: Bag folder, or a file in it.
        task: Task of the run; by default what the bag or its controller names, if they do.
        robot: Robot of the run; by default what they name, or the namespace of the odometry.

    Returns:
        The run; its `info` lacks `task` or `robot` where nothing names them.

    Raises:
        BagError: There is no bag, or nothing of it can be read.
    """
    bag = open_bag(Path(path))
    asked = {"task": task, "robot": robot}
    return _Reader(bag).record({**_named(bag), **{key: name for key, name in asked.items() if name}})


def _named(bag: Bag) -> dict[str, Any]:
    """What a bag says of its run, with what its controller and its topics name where it says nothing."""
    own = {key: value for key, value in (bag.info or {}).items() if value not in (None, "")}
    controller = controller_of(bag)
    named = {key: controller[key] for key in ("robot", "task", "controller") if controller.get(key)}
    if "robot" not in named | own:
        spaces = {topic.name.split("/")[1] for topic in bag.topics.values() if topic.type == ODOMETRY.type}
        known = sorted(spaces & set(config_names("robots")))
        named |= {"robot": known[0]} if len(known) == 1 else {}
    return named | own


class _Reader:
    """Reads wire after wire, and gathers what cannot be read."""

    def __init__(self, bag: Bag) -> None:
        self._bag, self._warnings = bag, list(bag.warnings)
        if not any(len(topic) for topic in bag.topics.values()):
            self._warnings.append(f"{bag.files[0].name}: holds no message.")

    def record(self, info: dict[str, Any]) -> RunRecord:
        texts = [json_object(message.data) for _, message in self._messages(METADATA)]
        return RunRecord(
            path=self._bag.path,
            info=info,
            truth=_motion(self._odometries(TRUTH)),
            odom=_motion(self._measured()),
            applied=_actuation(self._vectors(ACTUATORS_STATE)),
            commanded=_actuation(self._commands()),
            goals=tuple(sorted(self._goals(info.get("task")), key=lambda goal: goal.log_s)),
            obstacles=self._obstacles(),
            things=self._things(info.get("task")),
            controller=next((text for text in reversed(texts) if text), {}),
            health=_health(self._messages(STATUS) + self._messages(DIAGNOSTICS), self._bag.name),
            warnings=tuple(self._warnings),
        )

    def _lost(self, wire: Wire, count: int = 0, why: str = "have another type") -> None:
        topic = self._bag.topic_name(wire)
        others = sum(len(t) for t in self._bag.topics.values() if t.name == topic and t.type != wire.type)
        if count + others:
            self._warnings.append(f"{count + others} messages of {topic} {why}.")

    def _messages(self, wire: Wire) -> Decoded:
        topic = self._bag.of(wire)
        self._lost(wire)
        return messages(topic)

    def _odometries(self, wire: Wire) -> Odometries:
        self._lost(wire)
        return odometries(self._bag.of(wire))

    def _measured(self) -> Odometries:
        """Odometry under the name of the wire; under any other where a bag has one odometry alone."""
        found = self._odometries(ODOMETRY)
        if len(found) or len(self._bag.of(TRUTH)):
            return found
        try:
            return odometries(self._bag.odometry())
        except BagError:
            return found

    def _vectors(self, wire: Wire) -> Vectors:
        found = joint_vectors(self._bag.of(wire), "effort")
        others = found.left_out - len(self._bag.of(wire).unreadable)
        self._lost(wire, others, "have other names or lengths than the first, or another type")
        return found

    def _commands(self) -> Vectors:
        if not len(self._bag.of(VELOCITY_COMMAND)):
            return self._vectors(COMMAND)
        self._lost(VELOCITY_COMMAND)
        return twist_vectors(self._bag.of(VELOCITY_COMMAND))

    def _goals(self, task: object) -> list[GivenGoal]:
        """What the controller was told; it hears the topic of its task alone."""
        goals, frames = [], self._bag.frames
        known = self._task_of(task)
        for wire in (wire for topic in GOAL_WIRES for wire in goal_wires(topic)):
            if known is not None and wire not in goal_wires(known.goal_topic):
                self._warn_of_others(wire, task)
                continue
            for log_ns, message in self._messages(wire):
                goal, problem = goal_of(message, frames)
                if goal is None:
                    self._warnings.append(f"a message of {self._bag.topic_name(wire)} is no goal: {problem}.")
                    continue
                goals.append(GivenGoal(stamp_of(message) / NS, log_ns / NS, goal.targets))
        return sorted(goals, key=lambda goal: goal.log_s)

    def _warn_of_others(self, wire: Wire, task: object) -> None:
        count = len(self._bag.of(wire))
        if count:
            self._warnings.append(
                f"{count} messages of {self._bag.topic_name(wire)} are left out: no goals of the task '{task}'."
            )

    def _task_of(self, name: object) -> Task | None:
        """The task of the run; None where it is not known here."""
        try:
            return load_recorded_task(str(name), self._bag.path)
        except ConfigError:
            return None

    def _things(self, task: object) -> dict[str, Places]:
        """Where the things of the task were; of a task that is not known here, none."""
        known = self._task_of(task)
        found = {thing.name: self._places(thing.wire) for thing in (known.things if known else ())}
        return {name: places for name, places in found.items() if len(places)}

    def _places(self, wire: Wire) -> Places:
        every = [
            (stamp_of(message) / NS, thing_of(message, self._bag.frames)[0])
            for _, message in self._messages(wire)
        ]
        read = [(stamp_s, *pose) for stamp_s, pose in every if pose is not None]
        self._lost(wire, len(every) - len(read), "tell no pose")
        table = np.array(read).reshape(-1, 4)
        return Places(table[:, 0], table[:, 1:])

    def _obstacles(self) -> np.ndarray:
        """Obstacles of the last message, shape (m, 3)."""
        nothing = np.zeros((0, 3))
        found = self._messages(OBSTACLES)
        if not found:
            return nothing
        discs, problem = obstacles_of(found[-1][1], self._bag.frames)
        if discs is None:
            self._warnings.append(f"the obstacles cannot be used: {problem}.")
        return nothing if discs is None else discs


def _motion(found: Odometries) -> Motion:
    quat = found.pose[:, 3:]
    return Motion(
        stamp_s=found.stamp_ns / NS,
        log_s=found.log_ns / NS,
        publish_s=found.publish_ns / NS,
        position=found.pose[:, :3],
        quat_xyzw=quat,
        velocity_in_world=rotate(quat, found.twist[:, :3]),
        yaw_rate=found.twist[:, 5],
    )


def _actuation(found: Vectors) -> Actuation:
    return Actuation(found.stamp_ns / NS, found.log_ns / NS, found.publish_ns / NS, found.names, found.values)


def _health(found: Decoded, name: str) -> tuple[HealthSample, ...]:
    """What the nodes of a robot said; of all robots, which share one topic, where no name is known."""
    own = f"{name}: " if name else ""
    samples = [
        HealthSample(
            log_ns / NS, s.name, int(s.level), s.message, {pair.key: pair.value for pair in s.values}
        )
        for log_ns, message in found
        for s in message.status
        if s.name.startswith(own)
    ]
    return tuple(sorted(samples, key=lambda sample: sample.log_s))
