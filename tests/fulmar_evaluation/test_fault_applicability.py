"""Which faults apply to which robots, by what the robots have."""

from __future__ import annotations

import functools
import re
from dataclasses import replace
from pathlib import Path

import pytest

from fulmar_bringup.system import Guards
from fulmar_core.config.paths import config_names
from fulmar_core.dynamics.flight_trim import find_trim
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.geofence import is_inside
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks.goal_files import load_goals
from fulmar_evaluation.faults import command_faults
from fulmar_evaluation.faults.fault import possible
from fulmar_evaluation.faults.fault_environment import (
    USUAL,
    FaultEnvironment,
    area_of,
    goal_of,
    plan_of,
    task_of,
)
from fulmar_evaluation.faults.suite import EVERY, faults_of, modules_for

DOCUMENT = Path(__file__).parents[2] / "docs" / "safety.md"
ROBOTS = config_names("robots")
FLYING = [
    name
    for name in ROBOTS
    if load_robot(name).state_type is SpatialState
    and not (load_robot(name).actuators.turns_only or load_robot(name).flies)
]
SATELLITES = [name for name in ROBOTS if load_robot(name).actuators.turns_only]
AIRCRAFT = [name for name in ROBOTS if load_robot(name).flies]
MOST_LEFT_OUT = 4
# Faults of parts that some robots have, by the robots of these that have them.
OF_PARTS = {
    "mocap_frozen": {
        "floating_platform",
        "spacecraft_16",
        "cubesat_8",
        "int_ball2",
        "kingfisher",
        "turtlebot2",
    },
    "star_tracker_frozen": {"cubesat_wheels"},
    "star_tracker_drifts": {"cubesat_wheels"},
    "gnss_creeps": {"kingfisher", "airship_v7"},
    "valve_stuck_open": {"floating_platform", "spacecraft_16", "cubesat_8", "int_ball2"},
    "valve_stuck_closed": {"floating_platform", "spacecraft_16", "cubesat_8", "int_ball2"},
    "surface_stuck": {"airship_v7"},
    "wheel_dead": {"cubesat_wheels", "turtlebot2"},
    "propeller_lost": {"kingfisher", "airship_v7"},
    "supply_pressure_falls": {"floating_platform", "spacecraft_16", "cubesat_8"},
    "camera_killed": {"cubesat_8", "int_ball2"},
    "camera_hangs": {"cubesat_8", "int_ball2"},
    "tank_empty": {"floating_platform", "spacecraft_16", "cubesat_8"},
}


@pytest.fixture(autouse=True)
def two_hosts_are_possible(monkeypatch) -> None:
    monkeypatch.setattr(command_faults, "why_not", lambda: "")


@functools.cache
def inapplicable(robot: str) -> dict[str, str]:
    """Reasons by fault; asked for with two possible hosts."""
    return {fault.name: fault.reason for fault in faults_of(robot)[1]}


def left_out(robot: str, *, parts: bool = False) -> dict[str, str]:
    """Reasons by fault; of `parts`: of those of `OF_PARTS` as well."""
    return {name: reason for name, reason in inapplicable(robot).items() if parts or name not in OF_PARTS}


@pytest.mark.parametrize("fault", OF_PARTS)
def test_a_fault_of_a_part_applies_to_the_robots_that_have_the_part(fault: str):
    robots = set().union(*OF_PARTS.values())
    assert {robot for robot in robots if fault not in left_out(robot, parts=True)} == OF_PARTS[fault]
    assert all(left_out(robot, parts=True)[fault] for robot in robots - OF_PARTS[fault])


@pytest.mark.parametrize("robot", FLYING)
def test_at_most_four_faults_do_not_apply_in_space_and_each_has_a_reason(robot: str):
    reasons = left_out(robot)
    assert len(reasons) <= MOST_LEFT_OUT
    assert all(reasons.values())


def test_a_spacecraft_has_every_fault_of_the_platform_but_that_of_its_air_bearing():
    assert set(left_out("spacecraft_16")) == {
        "driver_killed",
        "driver_hangs",
        "bearing_late",
        "gyroscope_dies",
    }
    platform = {fault.name for fault in faults_of("floating_platform")[0]}
    spacecraft = {fault.name for fault in faults_of("spacecraft_16")[0]}
    assert platform - spacecraft == {"bearing_late"}
    assert "mocap_frozen" in spacecraft


@pytest.mark.parametrize("robot", SATELLITES)
def test_a_satellite_lacks_what_needs_a_policy_a_place_or_a_person_and_each_has_a_reason(robot: str):
    reasons = left_out(robot)
    assert all(reasons.values())
    needs = (
        "swap", "bundle", "area", "geofence", "teleop", "driver", "mocap", "bearing", "gyroscope", "backwards",
    )  # fmt: skip
    assert [name for name in reasons if not any(word in name for word in needs)] == []
    assert ("gyroscope_dies" in reasons) is not bool(load_robot(robot).event_cameras)


@pytest.mark.parametrize("robot", AIRCRAFT)
def test_an_aircraft_has_every_fault_of_processes_commands_and_odometry_and_the_rest_has_a_reason(robot: str):
    reasons = left_out(robot)
    assert all(reasons.values())
    needs = (
        "swap", "bundle", "area", "geofence", "goal", "teleop", "driver", "mocap", "estimator", "bearing", "gyroscope",
    )  # fmt: skip
    assert [name for name in reasons if not any(word in name for word in needs)] == []
    assert "goal_outside_the_area" not in reasons


def test_an_aircraft_starts_in_level_flight_and_never_leaves_its_area_ahead(tmp_path):
    request = plan_of("airship_v7", tmp_path / "bag", FaultEnvironment(has_area=True))
    craft = load_robot("airship_v7")
    assert request.controller == "policy"
    assert request.control_hz == 25.0
    assert request.start[4] == pytest.approx(
        SpatialState.written(find_trim(craft, craft.airframe.speed, 1.0).state.pose)[4], abs=1e-6
    )
    assert is_inside((craft.airframe.speed * 300.0, 0.0, 1.0), request.guards.area)
    assert not is_inside((0.0, 0.0, 5.0), request.guards.area)


def test_a_satellite_keeps_its_place_and_gets_another_attitude_from_a_file_of_goals(tmp_path):
    request = plan_of("cubesat_wheels", tmp_path / "bag", FaultEnvironment(by_goal_node=True))
    poses = load_goals(request.goals).poses
    assert [pose[:3] for pose in poses] == [(0.0, 0.0, 0.0)] * 2
    assert poses[0] != poses[1]


def test_what_applies_follows_from_what_a_robot_has_not_from_its_name():
    platform = load_robot("floating_platform")
    (late,) = (fault for fault in EVERY if fault.name == "bearing_late")
    assert not late.why_not(platform)
    assert late.why_not(replace(platform, air_bearing=False))


@pytest.mark.parametrize("robot", ROBOTS)
def test_every_robot_has_a_task_and_a_goal_of_its_own_world_within_its_geofence_and_its_area(robot: str):
    the_robot = load_robot(robot)
    form = the_robot.state_type
    assert task_of(the_robot).state_type is form
    target = form.target_at(goal_of(the_robot))
    assert form.resting(target[None]).distance_to(0.0 * target) < the_robot.limits.geofence
    area = area_of(the_robot)
    assert len(area) == 2 * form.AXES
    assert is_inside(goal_of(the_robot)[: form.AXES], area)
    assert is_inside((0.0,) * form.AXES, area)


@pytest.mark.parametrize(
    ("robot", "form", "estimator"),
    [("floating_platform", PlanarState, "mocap_imu"), ("spacecraft_16", SpatialState, "mocap_imu_3d")],
)
def test_an_estimator_of_the_robots_own_world_runs_where_a_fault_needs_one(robot, form, estimator):
    the_robot = load_robot(robot)
    assert the_robot.state_type is form
    assert FaultEnvironment(estimated=True).guards_of(the_robot).estimator == estimator
    assert USUAL.guards_of(the_robot) == Guards(estop=True)
    assert "filterpy" in modules_for(robot, faults_of(robot)[0])


def test_the_document_lists_every_fault_and_those_that_may_not_apply():
    text = DOCUMENT.read_text()
    section = text[text.index("## Fault suite") :]
    assert [fault.name for fault in EVERY if f"`{fault.name}`" not in section] == []
    table = section[section.index("| Does not apply |") :]
    rows = re.findall(r"^\| (`[^|]+) \|", table[: table.index("\n\n")], re.MULTILINE)
    listed = {name for row in rows for name in re.findall(r"`(\w+)`", row)}
    others = load_robot("cubesat_wheels"), load_robot("airship_v7")
    may_not = {
        fault.name
        for fault in EVERY
        if fault.why_not is not possible or any(fault.inapplicable(robot) for robot in others)
    }
    assert listed == may_not

    for robot in re.findall(r"`(\w+)`", table.split("\n")[0]):
        column = [cell.strip(" `") for cell in table.split("\n")[0].split("|")].index(robot)
        cells = [line.split("|") for line in table[: table.index("\n\n")].split("\n")[2:]]
        said = {name for row in cells if row[column].strip() for name in re.findall(r"`(\w+)`", row[1])}
        assert said == set(left_out(robot, parts=True)), robot
