"""A bag as the estimators of `fulmar_core.identification` see it."""

from __future__ import annotations

from pathlib import Path

from fulmar_bags.bag_reading import AS_IT_IS, BagReading, types_of
from fulmar_bags.run_record import read_any_run
from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import ACTUATORS_STATE, ODOMETRY, command_wire
from fulmar_core.tasks import load_task
from fulmar_evaluation.identification.drives import Drive, drive_of


def driven_run(
    path: Path, reading: BagReading = AS_IT_IS, *, load: int = 0
) -> tuple[Robot, Drive, tuple[str, ...]]:
    """Read the measured poses and what the actuators did.

    Args:
        path: Bag folder, or a file in it; any program may have recorded it.
        reading: What the bag does not say itself.
        load: Number of the ballast that was aboard; 0 for none.

    Returns:
        The robot, its run, and what of the bag could not be read. The simulator's own truth is not looked at, even
        where the bag has it.

    Raises:
        BagError: There is no bag, or it cannot be read.
        ConfigError: It does not say which robot it is of, or has no poses or commands of it.
    """
    record = read_any_run(path, reading)
    if not record.info.get("robot"):
        raise ConfigError(f"{path}: the bag does not say its robot. Give --robot.")
    robot = load_robot(str(record.info["robot"]))
    if reading.task:
        load_task(reading.task).check(robot)
    actuation = record.actuation
    missing = [
        f"{what} ({', '.join(f'{name} of {kind}' for name, kind in topics)})"
        for what, there, topics in (
            ("poses", record.odom, [(ODOMETRY.name, ODOMETRY.type)]),
            ("commands", actuation, _commands(robot)),
        )
        if not len(there)
    ]
    if missing:
        raise ConfigError(
            f"{path}: holds no {' and no '.join(missing)}. If they have other names there, give --topics OURS=THEIRS."
        )
    width = len(robot.actuators.names)
    if len(actuation) and actuation.effort.shape[1] != width:
        raise ConfigError(
            f"{path}: commands have {actuation.effort.shape[1]} values, '{robot.name}' takes {width}."
        )
    pose = robot.state_type.from_rigid(record.odom.states).pose
    drive = drive_of(str(path), record.odom.stamp_s, pose, actuation.stamp_s, actuation.effort, load=load)
    return robot, drive, record.warnings


def _commands(robot: Robot) -> list[tuple[str, str]]:
    """Names and types of the topics with what actuators received."""
    wire = command_wire(robot)
    return [(wire.name, kind) for kind in types_of(wire)] + [(ACTUATORS_STATE.name, ACTUATORS_STATE.type)]
