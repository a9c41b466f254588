"""Parts that fail in simulators are named by what their feedback says, and sound robots are not accused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.controllers.classical import load_classical
from fulmar_core.estimators.actuator_health.feedback_check import ActuatorFeedback
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episodes
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_in_float64, stack_goals
from fulmar_core.worlds.scenario import Scenario, load_scenario
from sim_nodes.mujoco_backend import MujocoBackend

WITHIN_S = 5.0
# Robot, task, scenario, and from when on the part fails: while it is commanded, since one at rest shows nothing.
FAILURES = {
    "turtlebot2": ("go_through_positions", "wheel_dead", (3.0, 6.0)),
    "jetbot": ("go_through_positions", "wheel_dead", (3.0, 6.0)),
    "cubesat_wheels": ("slew", "wheel_dead", (0.5, 1.0)),
    "kingfisher": ("go_through_positions", "propeller_lost", (3.0, 6.0)),
    "airship_v7": ("fly_hold", "surface_stuck", (1.0, 2.0)),
}
NOMINAL = load_scenario("nominal")


def fails_from(name: str, from_s: tuple[float, float]) -> Scenario:
    """A scenario whose part fails at another time."""
    scenario = load_scenario(name)
    stuck = replace(scenario.actuation.stuck, from_s=from_s)
    return replace(scenario, actuation=replace(scenario.actuation, stuck=stuck))


def observed(robot_name, task_name, scenario, *, number, seconds):
    """The part that fails, when, and when each part is accused first."""
    robot = load_robot(robot_name)
    task = load_task(task_name).fitted(robot)
    episode = draw_episodes(robot, task, scenario, seed=0, numbers=np.array([number]))[0]
    backend, controller = MujocoBackend(robot), load_classical(robot, task)
    loop, feedback = ControlLoop(robot, task, controller), ActuatorFeedback(robot, moves=True)
    sample = backend.reset(episode, seed=0, number=number)
    loop.begin(stack_goals([goal_in_float64(episode.goal)]))
    accused: dict[str, float] = {}
    for step in range(round(seconds / loop.dt)):
        speeds = sample.readings.get("wheels")
        readings = {} if speeds is None else {"wheels": speeds.value.speeds[None]}
        measured = task.state_type.from_rigid(sample.measured)[None]
        command = loop.step(measured, readings, round(1e9 * step * loop.dt)).command[0]
        sample = backend.step(command, robot.timing.substeps(controller.control_hz))
        feedback.see(command, loop.dt, sample)
        for finding in feedback.findings:
            accused.setdefault(finding.part, (step + 1) * loop.dt)
    backend.close()
    part = int(episode.world.stuck_part)
    name = robot.actuators.parts.names[part] if part >= 0 else ""
    return name, float(episode.world.stuck_from), accused


def check_named(robot_name, number):
    task, scenario, from_s = FAILURES[robot_name]
    scenario = fails_from(scenario, from_s)
    name, since_s, accused = observed(robot_name, task, scenario, number=number, seconds=from_s[1] + WITHIN_S)
    assert list(accused) == [name]
    assert 0.0 <= accused[name] - since_s <= WITHIN_S


@pytest.mark.parametrize("robot", ["turtlebot2", "cubesat_wheels", "kingfisher"])
def test_the_part_that_fails_is_named_within_five_seconds_and_no_other(robot):
    check_named(robot, 1)


def test_a_surface_that_sticks_is_named_before_the_craft_is_down():
    scenario = fails_from("surface_stuck", (0.2, 0.2))
    name, since_s, accused = observed("airship_v7", "fly_hold", scenario, number=0, seconds=1.0)
    assert list(accused) == [name]
    assert accused[name] - since_s < 0.6


@pytest.mark.slow
@pytest.mark.parametrize("number", range(20))
@pytest.mark.parametrize("robot", FAILURES)
def test_the_part_that_fails_is_named_in_each_of_twenty_episodes(robot, number):
    check_named(robot, number)


@pytest.mark.parametrize("robot", ["turtlebot2", "cubesat_wheels", "kingfisher"])
def test_no_part_of_a_sound_robot_is_accused(robot):
    assert observed(robot, FAILURES[robot][0], NOMINAL, number=2, seconds=12.0)[2] == {}


@pytest.mark.slow
@pytest.mark.parametrize("number", range(20))
@pytest.mark.parametrize("robot", [*FAILURES, "leatherback"])
def test_no_part_of_a_sound_robot_is_accused_in_any_of_twenty_episodes(robot, number):
    task = FAILURES.get(robot, ("go_through_positions",))[0]
    seconds = 10.0 if load_robot(robot).flies else 60.0
    assert observed(robot, task, NOMINAL, number=number, seconds=seconds)[2] == {}
