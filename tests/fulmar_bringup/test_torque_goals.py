"""Goal files of torques: every profile of the study, and how a run plays them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from fulmar_bringup.bag_origin import attachments
from fulmar_bringup.controller_row import controller_spec
from fulmar_bringup.excitation_plan import torques_note
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.task_choice import goal_note, task_of
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names
from fulmar_core.controllers.by_kind import exciting
from fulmar_core.controllers.controller import Inputs
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.tasks import load_task
from fulmar_core.tasks.excitation import Torques
from fulmar_core.tasks.goal_files import load_goals, load_torques
from fulmar_core.tasks.torque_profiles import DURATION_S, PROFILES
from fulmar_core.worlds.scenario import load_scenario

SATELLITES = ("cubesat_wheels", "microsat", "smallsat")


@pytest.fixture
def planned(plan):
    """The plan of a run with a goal file."""

    def made(goals, *, robot="microsat", controller="excite", **more):
        asked = RunPlan(robot, "", controller, "mujoco", goals=goals)
        goal_note(asked)  # as the command line asks first
        task = task_of(asked)
        return plan(robot=robot, task=task, controller=controller, goals=goals, lockstep=True, **more)

    return made


def test_every_profile_ships_as_a_goal_file():
    files = [load_torques(name) for name in config_names("goals") if name.startswith("excite_")]
    assert sorted(file.profile for file in files) == sorted(PROFILES)
    assert not any(file.saturate for file in files)


def test_a_misspelt_profile_gets_the_nearest_name():
    with pytest.raises(ValueError, match=r"'chrip' is not known.*[Dd]id you mean 'chirp'"):
        Torques(profile="chrip")


def test_torques_are_no_goals_and_goals_no_torques():
    with pytest.raises(ConfigError, match="--controller excite --goals excite_sine"):
        load_goals("excite_sine")
    with pytest.raises(ConfigError, match="kind: trajectory"):
        load_torques("helix")


def test_a_run_hands_the_file_to_its_controller_and_keeps_it_in_the_bag(planned):
    plan = planned("excite_chirp")
    assert (plan.goals, plan.task, plan.duration_s) == ("", "point_inertial", DURATION_S)
    assert controller_spec(plan).parameters["excitation"] == "excite_chirp"
    carried = Path(json.loads(attachments(plan))["goals.yaml"])
    assert carried.name == "excite_chirp.yaml" and carried.is_file()
    assert planned("excite_chirp", duration_s=20.0).duration_s == 20.0


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ({"controller": "lqr"}, "controller 'lqr' takes none. Say --controller excite"),
        ({"robot": "spacecraft_16"}, "torques of reaction wheels; 'spacecraft_16' has thrusters"),
        ({"goal": (0.0,) * 6}, "it takes no --goal"),
    ],
)
def test_what_plays_no_torques_is_refused(planned, more, says):
    with pytest.raises(ConfigError, match=says):
        planned("excite_chirp", **more)


def test_wheels_saturate_only_where_the_file_wants_it_and_the_run_says_so(tmp_path):
    wild = tmp_path / "wild.yaml"
    wild.write_text("kind: torques\ntitle: t\nprofile: one_step\nsaturate: true\n")
    cubesat = load_robot("cubesat_wheels")
    assert "saturates the wheels" in torques_note(str(wild), cubesat, "excite")
    assert not torques_note("excite_one_step", cubesat, "excite")
    for goals, saturates in ((str(wild), True), ("excite_one_step", False)):
        assert (fastest(cubesat, goals, 60.0) > 0.999 * cubesat.actuators.top_speed) is saturates


@pytest.mark.parametrize("name", SATELLITES)
def test_our_own_profile_uses_the_wheels_and_saturates_none(name):
    robot = load_robot(name)
    share = fastest(robot, "excite_persistent", 40.0) / robot.actuators.top_speed
    assert 0.8 < share < 0.999


def fastest(robot, goals, seconds):
    """Largest speed of a wheel while the controller plays, by the momentum that the body lacks [rad/s]."""
    task, hz = load_task("point_inertial"), robot.timing.control_hz
    controller = exciting(robot)(robot, task, load_torques(goals))
    simulation = BatchSimulation(robot, task, load_scenario("nominal"), worlds=1, seed=0)
    largest, previous = 0.0, np.zeros((1, len(robot.actuators.names)))
    for k in range(round(seconds * hz)):
        stamp = 1_000_000_000 + round(1e9 * k / hz)
        inputs = Inputs(
            simulation.truth, simulation.goal, simulation.observe(), previous, None, stamp, 1.0 / hz
        )
        previous = controller.act(inputs)
        simulation.step(previous)
        momentum = robot.body.inertia_matrix @ np.concatenate(simulation.truth.rate)
        largest = max(largest, float(np.abs(momentum).max()) / robot.actuators.spin_inertia)
    return largest
