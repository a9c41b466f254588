"""What no single number of a robot's file shows is a problem of a check, with numbers and what is allowed."""

from __future__ import annotations

import re

import pytest

from fulmar_core.config.paths import config_path
from fulmar_evaluation.robot_check import check_robot
from tests.wrong_robots import altered

PROPELLERS, TERMS, ENGINE = "actuators.propellers", "airframe.aerodynamics.terms", "actuators.motors.0.engine"
# Robot, changes, and words of the only problem.
COMPUTED = [
    ("floating_platform", {"performance.force": 10.0}, "'performance.force' = 10 N.* accepted is 0.2 to 5 N"),
    ("spacecraft_16", {"performance.force": 10.0}, "'performance.force' = 10 N.* give 1 N at most"),
    ("spacecraft_16", {"performance.torque": 3.1}, "'performance.torque' = 3.1 N·m.* accepted is 0.062 to 1.55"),
    ("int_ball2", {"performance.torque": 0.0819}, "'performance.torque' = 0.0819 N·m"),
    ("int_ball2", {"actuators.thrust": 60.0}, "its actuators give 181 N at most.* accepted is"),
    ("turtlebot2", {"performance.force": 240.0}, "'performance.force' = 240 N.* accepted is 4.8 to 120 N"),
    ("turtlebot2", {"performance.torque": 27.6}, "'performance.torque' = 27.6 N·m"),
    ("leatherback", {"performance.force": 160.0}, "'performance.force' = 160 N"),
    ("kingfisher", {"performance.torque": 89.0}, "'performance.torque' = 89 N·m"),
    ("kingfisher", {"actuators.curve.20": 195.0}, "its actuators give 390 N at most"),
    ("kingfisher", {"hydrodynamics.quadratic_damping.0": 1.7257}, "'performance.top_speed' = 1.5 m/s.* 4.754 m/s"),
    ("kingfisher", {f"{PROPELLERS}.0.position.1": 0.0, f"{PROPELLERS}.1.position.1": 0.0}, "rank 1 of 3: .*yaw"),
    ("cubesat_wheels", {"performance.torque": 0.1}, "'performance.torque' = 0.1 N·m"),
    ("cubesat_wheels", {"performance.yaw_rate": 0.3}, "'performance.yaw_rate' = 0.3 rad/s.* 0.1769 rad/s at most"),
    ("cubesat_wheels", {"actuators.wheels.2.axis": [1.0, 0.0, 0.0]}, "rank 2 of 3: .*yaw"),
    (
        "spacecraft_16", {f"actuators.nozzles.{i}.direction": [0.0, 0.0, 1.0] for i in range(16)},
        "have rank 3 of 6: no command makes a force along x or a force along y or a torque about z",
    ),
    (
        "navion", {f"{ENGINE}.thrust": 440.0, "performance.force": 440.0},
        "no trim at 53.64 m/s .* 0.84 m/s² ahead.* It is 'airframe.speed'",
    ),
    (
        "navion", {"airframe.speed": 26.0, "performance.speed": 26.0, "performance.top_speed": 40.0},
        "'airframe.speed' = 26 m/s asks for an angle of attack of .* beyond 'airframe.stall_deg' = 15°",
    ),
    (
        "a0s", {f"{TERMS}.Cn.r": -0.001, f"{TERMS}.Cl.beta": -1.2, f"{TERMS}.Cn.p": -0.9},
        "its Dutch roll doubles in 0.2 s; accepted is from 1 s on",
    ),
]  # fmt: skip


@pytest.mark.parametrize("case", COMPUTED, ids=[f"{row[0]}-{min(row[1])}" for row in COMPUTED])
def test_numbers_that_do_not_fit_one_another_are_one_problem(tmp_path, case):
    robot, changes, words = case
    path, _ = altered(tmp_path, robot, changes)
    found = check_robot(str(path))
    (problem,) = found.problems
    assert re.search(words, problem), problem
    assert not found.passed


def test_each_speed_that_was_tried_is_listed_with_whether_it_trims():
    found = check_robot("cessna_182")
    tried = found.as_json()["tried"]
    assert found.passed
    assert [each["trims"] for each in tried] == [True, True, True, True, False, True, True, True]
    assert "throttle at a limit" in tried[4]["reason"]
    assert [each["reason"] is None for each in tried] == [each["trims"] for each in tried]
    assert found.findings is not None
    texts = dict(found.findings.lines())
    assert texts["80.47 m/s, free air"].startswith("no trim: 'cessna_182' has no trim at 80.472 m/s")
    assert texts["67.06 m/s, free air"].startswith("trims: α -0.7")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("lqrr", "'usual_controller': unknown controller 'lqrr'. Did you mean 'lqr'"),
        ("mine:", "'usual_controller'"),
    ],
)
def test_a_usual_controller_that_nobody_knows_is_a_problem(tmp_path, name, words):
    path, _ = altered(tmp_path, "floating_platform", {"usual_controller": name})
    (problem,) = check_robot(str(path)).problems
    assert words in problem


def test_a_usual_controller_of_ones_own_is_none(tmp_path):
    path, _ = altered(tmp_path, "floating_platform", {"usual_controller": "mine:Controller"})
    assert check_robot(str(path)).passed


def test_a_speed_that_was_asked_for_is_not_blamed_on_the_file():
    found = check_robot("navion", speed=26.0)
    assert not any("'airframe.speed' = " in problem for problem in found.problems)


def test_a_file_of_another_name_than_its_robots_is_passed_with_a_warning(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(config_path("robots", "jetbot").read_text())
    found = check_robot(str(path))
    assert found.passed
    assert any("'name' is 'jetbot', the file's own name is 'mine'" in line for line in found.warnings)
