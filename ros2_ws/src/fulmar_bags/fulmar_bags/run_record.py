"""One recorded run as arrays: what was true, measured, commanded, applied and reported, as far as it can be read."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bags.bag_reading import AS_IT_IS, BagReading
from fulmar_bags.contents import Bag, open_bag
from fulmar_bags.decode import NS, Odometries, Vectors, odometries
from fulmar_bags.envelope_events import envelope_events
from fulmar_bags.figures import controller_of
from fulmar_bags.frame_messages import FRAME_TYPES
from fulmar_bags.gathered import Topic, json_object
from fulmar_bags.other_readings import (
    NO_INERTIAS,
    NO_PRESSURES,
    NO_SERIES,
    Inertias,
    Pressures,
    Series,
    gyroscope_s,
    inertias,
    pressures_of,
    series,
)
from fulmar_bags.wire_reader import Received, WireReader
from fulmar_bags.writer import RUN_RECORD
from fulmar_core.config.errors import BagError, ConfigError
from fulmar_core.config.own_class import is_own
from fulmar_core.config.paths import config_names
from fulmar_core.robots.topics import (
    ACTION,
    ACTUATORS_STATE,
    COMMAND,
    DIAGNOSTICS,
    METADATA,
    ODOMETRY,
    SENSOR_WIRES,
    STATUS,
    TRUTH,
    VELOCITY_COMMAND,
)
from fulmar_core.safety.envelope.event import Event
from fulmar_core.states.rotation import rotate
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import Task, load_recorded_task


@dataclass(frozen=True)
class Motion:
    """States of one body over time; all arrays begin with the same axis."""

    stamp_s: np.ndarray  # (n,) time of measurement [s]
    log_s: np.ndarray  # (n,) when the recorder received it, by its wall clock [s]
    publish_s: np.ndarray  # (n,) when it was sent, by the wall clock of the sender [s]
    position: np.ndarray  # (n, 3) in the world [m]
    quat_xyzw: np.ndarray  # (n, 4) [-]
    velocity_in_world: np.ndarray  # (n, 3) [m/s]
    angular_velocity_in_body: np.ndarray  # (n, 3) [rad/s]

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.stamp_s)

    def between(self, begin_s: float, end_s: float) -> Motion:
        """The samples of a span of time, both ends included [s]."""
        inside = (self.stamp_s >= begin_s) & (self.stamp_s <= end_s)
        return Motion(*(getattr(self, column.name)[inside] for column in fields(self)))

    @property
    def states(self) -> RigidBodyState:
        """The same as a batch of states."""
        return RigidBodyState(
            self.position, self.quat_xyzw, self.velocity_in_world, self.angular_velocity_in_body
        )


@dataclass(frozen=True)
class Actuation:
    """Actuator vectors over time."""

    stamp_s: np.ndarray  # (n,) [s]
    log_s: np.ndarray  # (n,) [s]
    publish_s: np.ndarray  # (n,) [s]
    names: tuple[str, ...]  # of the columns
    effort: np.ndarray  # (n, m)

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.stamp_s)


@dataclass(frozen=True)
class Surfaces:
    """Measured deflections and throttles of an aircraft over time."""

    stamp_s: np.ndarray  # (n,) [s]
    names: tuple[str, ...]  # of the columns
    positions: np.ndarray  # (n, m): deflections [rad], throttles from 0 to 1

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.stamp_s)


NO_SURFACES = Surfaces(np.zeros(0), (), np.zeros((0, 0)))


@dataclass(frozen=True)
class Places:
    """Where one thing of the task was over time."""

    stamp_s: np.ndarray  # (n,) [s]
    pose: np.ndarray  # (n, 7) in the world: x, y, z [m] and quaternion (x, y, z, w)

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.stamp_s)


@dataclass(frozen=True)
class GivenGoal:
    """A goal as it was given."""

    stamp_s: float  # [s]
    log_s: float  # [s]
    targets: np.ndarray  # poses (k, 7), or one twist (1, 6); see `message_reader.goal_of`


@dataclass(frozen=True)
class HealthSample:
    """One diagnostic status."""

    log_s: float  # [s]
    name: str  # `<robot>: plant`, `<robot>: controller`
    level: int  # 0 ok, 1 warn, 2 error, 3 stale
    message: str
    values: dict[str, str]


@dataclass(frozen=True)
class RunRecord:
    """Content of a bag of one run."""

    path: Path
    info: dict[str, Any]  # what was asked for
    truth: Motion
    odom: Motion
    applied: Actuation  # `actuators/state`
    commanded: Actuation  # `actuators/command`; the stamp is that of the observation it answers
    goals: tuple[GivenGoal, ...]
    obstacles: np.ndarray  # (m, 3) x [m], y [m], radius [m]; those given last
    things: dict[str, Places]  # by name, those that the bag has
    controller: dict[str, Any]  # its metadata
    health: tuple[HealthSample, ...]
    warnings: tuple[str, ...]  # what could not be read
    surfaces: Surfaces = NO_SURFACES  # `surfaces/state` of an aircraft
    supply: Pressures = NO_PRESSURES  # `supply/pressure` of thrusters
    fuel: Series = NO_SERIES  # `supply/fuel`: mass left [kg], and its share of the full tank [-]
    wheels: Series = NO_SERIES  # speeds of reaction wheels [rad/s]
    air_data: Series = NO_SERIES  # of an aircraft: airspeed [m/s], angles [rad], height [m]
    gyroscope_s: tuple[float, ...] = ()  # stamps of a satellite's inertial unit [s]
    inertia: Inertias = NO_INERTIAS  # that estimators published
    envelope: tuple[Event, ...] = ()  # trips and returns of the envelope guard
    actions: Series = NO_SERIES  # of a controller of the user's own, before limits
    images: tuple[Topic, ...] = ()  # topics of cameras; what is in them is read when it is looked at

    @property
    def actuation(self) -> Actuation:
        """What was applied; what was commanded where the bag does not have that."""
        return self.applied if len(self.applied) else self.commanded

    @property
    def motion(self) -> Motion:
        """The truth where there is one, else the odometry.

        A real robot is measured before and after its run, too; only what lies within belongs to it.
        """
        motion = self.truth if len(self.truth) else self.odom
        if self.info.get("backend") != "hardware" or not len(self.applied):
            return motion
        began_s = float(self.applied.stamp_s[0])
        return motion.between(began_s, began_s + float(self.info.get("duration_s") or np.inf))

    def last_health(self, part: str) -> HealthSample | None:
        """Newest status of `plant` or `controller`, None if there is none."""
        mine = (sample for sample in reversed(self.health) if sample.name.endswith(f": {part}"))
        return next(mine, None)


def read_run(path: Path, robot: str | None = None) -> RunRecord:
    """Read one run from a bag folder, or a file in it; damaged and missing parts are named in its `warnings`.

    Args:
        path: Bag folder, or a file in it.
        robot: Name of the robot, in the bag of a fleet.

    Raises:
        BagError: There is no bag, it is empty, Fulmar did not record it, or it is a fleet's and `robot` is not given.
        ConfigError: The fleet has no such robot.
    """
    return run_in(open_bag(Path(path), BagReading(robot=robot)))


def run_in(bag: Bag) -> RunRecord:
    """The run of a bag that was read; see `read_run`."""
    check_one_robot(bag)
    if bag.info is None:
        found = ", ".join(list(bag.topics)[:3]) or "none"
        raise BagError(
            f"{bag.files[0]}: no recording of Fulmar: lacks '{RUN_RECORD}', topics: {found}. Give a bag of a run."
        )
    return _record(bag, bag.info)


def read_any_run(path: Path, reading: BagReading = AS_IT_IS) -> RunRecord:
    """Read a run that Fulmar need not have recorded; its `info` lacks `task` or `robot` where nothing names them.

    Args:
        path: Bag folder, or a file in it.
        reading: Task and robot of the run; by default those of the bag or its controller, or the namespace of the
            odometry.

    Raises:
        BagError: There is no bag, or nothing of it can be read.
        ConfigError: It has not the topics of `reading`.
    """
    bag = open_bag(Path(path), reading)
    check_one_robot(bag)
    return _record(bag, {**_named(bag), **bag.reading.named})


def check_one_robot(bag: Bag) -> None:
    """Refuse the bag of a fleet where one of its robots has to be chosen.

    Raises:
        BagError: With their names.
    """
    if bag.robots:
        raise BagError(
            f"{bag.path}: is the bag of a fleet. Choose a robot: --robot {' or '.join(bag.robots)}."
        )


def _named(bag: Bag) -> dict[str, Any]:
    """Run record of a bag, completed by what its controller and its topics name."""
    own = {key: value for key, value in (bag.info or {}).items() if value not in (None, "")}
    controller = controller_of(bag)
    named = {key: controller[key] for key in ("robot", "task", "controller") if controller.get(key)}
    if "robot" not in named | own:
        spaces = {topic.name.split("/")[1] for topic in bag.topics.values() if topic.type == ODOMETRY.type}
        known = sorted(spaces & set(config_names("robots")))
        named |= {"robot": known[0]} if len(known) == 1 else {}
    return named | own


def _record(bag: Bag, info: dict[str, Any]) -> RunRecord:
    reader, task = WireReader(bag), _task_of(info.get("task"), bag.path, str(info.get("thing") or ""))
    if not any(len(topic) for topic in bag.topics.values()):
        reader.warnings.append(f"{bag.files[0].name}: holds no message.")
    texts = [json_object(message.data) for _, message in reader.messages(METADATA)]
    obstacles = reader.obstacles()
    odom = reader.with_times(_measured(reader))
    things = reader.things(task)
    surfaces = reader.vectors(SENSOR_WIRES["surfaces"], "position")
    return RunRecord(
        path=bag.path,
        info=info,
        truth=_motion(reader.odometry(TRUTH)),
        odom=_motion(odom),
        applied=_actuation(reader.vectors(ACTUATORS_STATE)),
        commanded=_actuation(_commands(reader, odom)),
        goals=tuple(GivenGoal(g.stamp_ns / NS, g.log_ns / NS, g.value) for g in reader.goals(task)),
        obstacles=obstacles[-1].value if obstacles else np.zeros((0, 3)),
        things={name: _places(poses) for name, poses in things.items() if poses},
        controller=next((text for text in reversed(texts) if text), {}),
        health=_health(reader, bag.name),
        warnings=tuple(reader.warnings),
        surfaces=Surfaces(surfaces.stamp_ns / NS, surfaces.names, surfaces.values),
        supply=pressures_of(reader),
        fuel=series(reader, SENSOR_WIRES["fuel"], "position"),
        wheels=series(reader, SENSOR_WIRES["wheels"], "velocity"),
        air_data=series(reader, SENSOR_WIRES["air_data"], "position"),
        gyroscope_s=gyroscope_s(reader),
        envelope=envelope_events(bag),
        inertia=inertias(reader),
        actions=series(reader, ACTION, "effort") if is_own(str(info.get("controller", ""))) else NO_SERIES,
        images=tuple(topic for topic in bag.topics.values() if topic.type in FRAME_TYPES and len(topic)),
    )


def _commands(reader: WireReader, odom: Odometries) -> Vectors:
    """Commands; those of speed without a stamp get one on the clock of the odometry, from when they were recorded."""
    command = VELOCITY_COMMAND if len(reader.bag.of(VELOCITY_COMMAND)) else COMMAND
    found = reader.vectors(command)
    plain = None if len(found) else reader.unstamped_commands()
    if plain is None or not len(odom):
        return found
    return replace(plain, stamp_ns=plain.stamp_ns + int(np.median(odom.stamp_ns - odom.log_ns)))


def _task_of(name: object, path: Path, thing: str) -> Task | None:
    """The task of the run; None where it is not known here."""
    try:
        return load_recorded_task(str(name), path, thing)
    except ConfigError:
        return None


def _measured(reader: WireReader) -> Odometries:
    """Odometry under the name of the wire; under any other where a bag has one odometry alone."""
    found = reader.odometry(ODOMETRY)
    if len(found) or len(reader.bag.of(TRUTH)):
        return found
    try:
        return odometries(reader.bag.odometry())
    except BagError:
        return found


def _places(poses: tuple[Received, ...]) -> Places:
    return Places(np.array([each.stamp_ns / NS for each in poses]), np.array([each.value for each in poses]))


def _motion(found: Odometries) -> Motion:
    quat = found.pose[:, 3:]
    return Motion(
        stamp_s=found.stamp_ns / NS,
        log_s=found.log_ns / NS,
        publish_s=found.publish_ns / NS,
        position=found.pose[:, :3],
        quat_xyzw=quat,
        velocity_in_world=rotate(quat, found.twist[:, :3]),
        angular_velocity_in_body=found.twist[:, 3:],
    )


def _actuation(found: Vectors) -> Actuation:
    return Actuation(found.stamp_ns / NS, found.log_ns / NS, found.publish_ns / NS, found.names, found.values)


def _health(reader: WireReader, name: str) -> tuple[HealthSample, ...]:
    """Diagnostics of a robot's nodes; of all robots, which share one topic, where no name is known."""
    own = f"{name}: " if name else ""
    samples = [
        HealthSample(
            log_ns / NS, s.name, int(s.level), s.message, {pair.key: pair.value for pair in s.values}
        )
        for log_ns, message in reader.messages(STATUS) + reader.messages(DIAGNOSTICS)
        for s in message.status
        if s.name.startswith(own)
    ]
    return tuple(sorted(samples, key=lambda sample: sample.log_s))
