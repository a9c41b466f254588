"""The line before a run says what the run is: goal, task, start, controller, surroundings and length."""

from __future__ import annotations

import random
import re

import numpy as np
import pytest

from fulmar_bringup.completion import completed
from fulmar_bringup.controller_row import controller_spec
from fulmar_bringup.plan_checks import checked
from fulmar_bringup.plant_row import plant_spec
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.config.errors import ConfigError, FulmarError
from fulmar_core.config.paths import config_names
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task

NUMBER = r"-?[\d.]+(?:e[+-]?\d+)?"
NAMED = ("robot", "task", "start:", "controller", "scenario")
GOALS = {  # a goal of each form, by kind of robot
    "planar": [{}, {"goal": (1.0, -0.5)}, {"goal": (1.0, -0.5, 90.0)}, {"velocity": (0.2, 0.0, 5.0)}],
    "rolling": [{}, {"goal": (1.0, -0.5)}, {"goal": (1.0, -0.5, 90.0)}, {"velocity": (0.2, 0.0, 5.0)}],
    "free_flyer": [
        {},
        {"goal": (1.0, 0.0, 0.5, 0.0, 30.0, 90.0)},
        {"velocity": (0.1, 0.0, 0.0, 0.0, 0.0, 5.0)},
    ],
    "satellite": [{}, {"goal": (0.0, 20.0, 90.0)}, {"goal": (0.0, 0.0, 0.0, 10.0, 0.0, -90.0)}],
    "aircraft": [{}, {"height": 30.0}, {"goal": (15.0, -3.0, 0.0), "task": "fly_attitude", "height": 200.0}],
}


def planned(robot, **asked):
    return checked(
        completed(RunPlan(robot, asked.pop("task", ""), asked.pop("controller", ""), "mujoco", **asked))
    )


def parts_of(line):
    """The parts of the line by the word that each begins with."""
    first, *rest = line.split("; ")
    named = dict(
        part.split(" ", 1)
        for part in rest
        if part.split(" ")[0] in ("robot", "task", "start:", "controller", "scenario")
    )
    return {"goal": first.removeprefix("goal: "), **named, "pace": rest[-2], "length": rest[-1]}


def numbers_of(words):
    return [float(number) for number in re.findall(rf"(?<![\w']){NUMBER}", words)]


def said_as_run(plan):
    """Compare the line with what the nodes are started with, and with the goal that is sent."""
    parts, robot, task = parts_of(plan.line), load_robot(plan.robot), load_task(plan.task)
    form = robot.state_type
    plant = plant_spec(plan).parameters
    assert (parts["robot"], parts["task"]) == (plan.robot_name, plant["task"])
    assert parts["controller"].startswith(
        f"{plan.controller} at {plant['control_hz']:g} Hz on {plant['backend']}"
    )
    if plan.controller != "external":
        assert controller_spec(plan).parameters["controller"] == plan.controller
    assert parts["scenario"] == f"{plant['scenario']}, seed {plant['seed']}"
    assert numbers_of(parts["length"])[0] == pytest.approx(plant["duration_s"], abs=1e-3)
    assert (parts["pace"] == "in lock step") is plant["lockstep"]
    start = np.asarray(plant["start"], dtype=float)
    begun = numbers_of(parts["start:"].partition(", drawn")[0])
    assert begun == pytest.approx(
        list(start[form.AXES :] if not robot.kind.goes_anywhere else start), abs=6e-3
    )
    target = plan.mission.current
    sent = list(form.written(target)) if task.goal_topic != "goal_velocity" else target.tolist()
    if task.goal_topic == "goal_velocity":
        sent[form.AXES :] = np.degrees(target[form.AXES :]).tolist()
    said = numbers_of(
        parts["goal"].partition(" in turn, the first ")[2] or parts["goal"].partition(", around")[0]
    )
    for number in said:
        assert min(abs(number - one) for one in (*sent, plan.duration_s, *numbers_of(task.title))) < 0.11, (
            plan.line
        )
    if task.goal_topic in ("goal_pose", "goal_point") and robot.kind.stays:
        places = form.AXES if robot.kind.goes_anywhere else 0
        assert len(said) == places + (len(sent) - form.AXES) * (task.goal_topic == "goal_pose")


@pytest.mark.parametrize("seed", range(12))
def test_the_line_is_what_runs(seed):
    rng = random.Random(seed)
    done = 0
    while done < 2:
        name = rng.choice(config_names("robots"))
        robot = load_robot(name)
        asked = dict(rng.choice(GOALS[robot.kind.name]))
        task = asked.get("task") or rng.choice(["", *config_names("tasks")])
        more = {"controller": rng.choice(["", "classical", "policy", "external"]), "seed": rng.randrange(99)}
        try:
            plan = planned(name, **asked | more | {"task": task}, lockstep=rng.random() < 0.5)
        except FulmarError as error:
            assert "\n" not in str(error)
            continue
        said_as_run(plan)
        done += 1


@pytest.mark.parametrize(
    ("robot", "asked", "words"),
    [
        ("floating_platform", {"goal": (1.0, 2.0)}, "x 1, y 2 m, any heading"),
        ("floating_platform", {"goal": (1.0, 2.0, 1.5708)}, "x 1, y 2 m, heading 1.57 degrees"),
        (
            "spacecraft_16",
            {"goal": (1.0, 0.0, 90.0), "task": "go_to_position_3d"},
            "x 1, y 0, z 90 m, any attitude",
        ),
        (
            "spacecraft_16",
            {"goal": (1.0, 0.0, 0.5, 0.0, 30.0, 90.0)},
            "x 1, y 0, z 0.5 m, roll 0, pitch 30, yaw 90 degrees",
        ),
        ("cubesat_wheels", {"goal": (0.0, 0.0, 90.0)}, "roll 0, pitch 0, yaw 90 degrees"),
        ("navion", {"height": 20.0}, "height 20 m"),
        ("navion", {"velocity": (50.0,)}, "50 m/s through the air, level"),
        (
            "navion",
            {"goal": (20.0, 0.0, 0.0), "task": "fly_attitude"},
            "roll 20, pitch 0 degrees, any heading",
        ),
        (
            "floating_platform",
            {"velocity": (0.3, 0.0, 20.0)},
            "0.3 m/s ahead, 0 m/s to the left, turning 20 degrees/s",
        ),
        ("turtlebot2", {"goals": "circle", "controller": "classical"}, "'circle', circle of 1.5 m"),
        ("turtlebot2", {"task": "go_through_positions"}, "10 positions in turn, the first x "),
        ("microsat", {"controller": "excite", "goals": "excite_chirp"}, "torques of 'excite_chirp'"),
        ("floating_platform", {"task": "go_to_pose", "standing": True}, "awaited on goal_pose"),
    ],
)
def test_a_goal_is_said_back_as_it_was_understood(robot, asked, words):
    plan = planned(robot, **asked)
    assert plan.line.startswith(f"goal: {words}")
    assert f"; task {plan.task}; start: " in plan.line


def test_a_start_that_was_not_given_is_said_to_be_drawn():
    assert ", drawn by seed 3; " in planned("floating_platform", goal=(1.0, 0.0, 0.0), seed=3).line
    assert "drawn" not in planned("floating_platform", goal=(1.0, 0.0, 0.0), start=(0.0, 0.0, 0.0)).line


def test_a_velocity_and_a_height_are_the_goal_that_is_sent():
    plan = planned("floating_platform", velocity=(0.3, 0.0, 20.0))
    assert plan.task == "track_velocities"
    assert plan.mission.targets == pytest.approx(np.array([[0.3, 0.0, np.radians(20.0)]]))
    plan = planned("navion", height=20.0)
    assert (plan.task, plan.mission.current[2]) == ("fly_hold", 20.0)
    assert 19.0 < plan.start[2] < 21.1
    assert planned("navion", velocity=(50.0,), height=500.0).start[2] == 500.0


def test_a_run_at_a_height_of_its_own_is_read_again_where_its_task_would_touch_the_ground():
    task, navion = load_task("fly_hold"), load_robot("navion")
    with pytest.raises(ConfigError, match=r"touches the ground.*--height"):
        task.check(navion)
    task.check_running(navion)
    task.at_height(20.0).check(navion)


def test_a_goal_of_an_aircraft_s_attitude_leaves_its_start_in_the_air():
    plan = planned("navion", goal=(20.0, 0.0, 0.0), task="fly_attitude")
    assert plan.start[2] == 300.0
