"""A bag as the estimators of `fulmar_core.identification` see it."""

from __future__ import annotations

from pathlib import Path

from fulmar_bags.run_record import read_run
from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_evaluation.identification.drives import Drive, drive_of


def driven_run(path: Path, *, load: int = 0) -> tuple[Robot, Drive, tuple[str, ...]]:
    """Read the measured poses and what the actuators did.

    Args:
        path: Bag folder, or the MCAP file in it.
        load: Number of the ballast that was aboard; 0 for none.

    Returns:
        The robot, its run, and what of the bag could not be read. The simulator's own truth is not looked at, even
        where the bag has it.

    Raises:
        BagError: There is no bag, or it cannot be read.
        ConfigError: It does not say which robot it is of, or has no poses or commands of it.
    """
    record = read_run(path)
    robot = load_robot(str(record.info.get("robot", "")))
    actuation = record.actuation
    width = len(robot.actuators.names)
    if len(actuation) and actuation.effort.shape[1] != width:
        raise ConfigError(
            f"{path}: commands have {actuation.effort.shape[1]} values, '{robot.name}' takes {width}."
        )
    pose = robot.state_type.from_rigid(record.odom.states).pose
    drive = drive_of(str(path), record.odom.stamp_s, pose, actuation.stamp_s, actuation.effort, load=load)
    return robot, drive, record.warnings
