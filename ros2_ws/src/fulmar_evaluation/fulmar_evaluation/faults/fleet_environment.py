"""The fleet that a fault is done to: as its file has it, with what the fault needs at one of its robots."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from fulmar_bringup.fleet_file import FleetRow, load_fleet
from fulmar_bringup.fleet_plan import FleetChoices, FleetPlan, planned
from fulmar_bringup.plan_checks import checked
from fulmar_core.config.errors import UnknownNameError
from fulmar_core.estimators.kinds import default_estimator
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import GOAL_POSE
from fulmar_core.tasks import load_task
from fulmar_evaluation.faults.fault import Fault
from fulmar_evaluation.faults.fault_environment import USUAL, FaultEnvironment
from fulmar_evaluation.faults.live_system import interceptions

OF_ALL = ("plant_killed", "plant_hangs", "supervisor_killed", "fleet_estop")  # no robot arrives after these
ONE_HOST = "the processes of a fleet run on one host"
OTHER_GOAL = "the suite measures the way to a goal of its own, and the fleet's file has others"
# Faults that end at a goal or an area of the single robot's suite, by name.
EXCUSED = {"odometry_leaves_the_geofence": OTHER_GOAL, "bearing_late": OTHER_GOAL}


def row_of(name: str, robot: str) -> FleetRow:
    """The row of a robot in the file of a fleet; the first one where no robot is named.

    Raises:
        ConfigError: As in `load_fleet`.
        UnknownNameError: The fleet has no robot of this name.
    """
    rows = {row.called: row for row in load_fleet(name).robots}
    if robot and robot not in rows:
        raise UnknownNameError(f"robot of the fleet '{name}'", robot, rows)
    return rows[robot] if robot else next(iter(rows.values()))


def why_not_in_fleet(fault: Fault, row: FleetRow) -> str:
    """Why a robot of a fleet cannot have a fault of the suite; empty if it can.

    Args:
        fault: Which.
        row: Of the robot.
    """
    robot, task, about = load_robot(row.robot), load_task(row.task), fault.about
    reasons = {
        EXCUSED.get(fault.name, ""): fault.name in EXCUSED,
        "a fleet has no devices": about.emulated,
        "a fleet has no simulated cameras": about.filmed,
        ONE_HOST: about.two_hosts or bool(about.clock_of),
        OTHER_GOAL: about.has_area or about.nadir or about.scenario != "nominal",
        "the suite of a fleet has no person at a gamepad": about.by_hand,
        f"'{row.called}' has no file of goals": about.by_goal_node and not row.goals,
        f"'{row.called}' runs no policy": row.controller != "policy"
        and (about.bundle is not None or fault.name.startswith("swap_to")),
        "the fleet's file names the controller": about.bundle is not None or about.fallback is not None,
        f"the goals of task '{task.name}' are no poses one by one": fault.name
        == "goal_with_a_wrong_quaternion"
        and task.goal_topic != GOAL_POSE.name,
    }
    return fault.inapplicable(robot) or next((why for why, counts in reasons.items() if counts), "")


def harmed_fleet(
    name: str, robot: str, record: Path, about: FaultEnvironment = USUAL, *, seed: int = 0
) -> FleetPlan:
    """The plan of a fleet, one robot of which has an e-stop and what a fault needs.

    Args:
        name: Of the fleet's file.
        robot: Name of that robot.
        record: Folder of the bag.
        about: What is unusual at the robot.
        seed: Of everything that is drawn.

    Raises:
        ConfigError: As in `fleet_plan`.
        UnknownNameError: As in `row_of`.
    """
    row = row_of(name, robot)
    estimator = default_estimator(load_robot(row.robot)) if about.estimated else row.guards.estimator
    harmed = replace(row, guards=replace(row.guards, estop=True, estimator=estimator))
    fleet = load_fleet(name)
    rows = tuple(harmed if one.called == row.called else one for one in fleet.robots)
    choices = FleetChoices(seed=seed, record=record, command="fulmar faults")
    plan = planned(name, replace(fleet, robots=rows), choices)
    return replace(
        plan,
        robots=tuple(
            checked(
                replace(
                    one,
                    extras=("markers",) if about.drawn else (),
                    intercepted=interceptions(one, about),
                )
            )
            if one.robot_name == row.called
            else one
            for one in plan.robots
        ),
    )
