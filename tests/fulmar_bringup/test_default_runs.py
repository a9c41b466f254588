"""What `fulmar run ROBOT` is for every shipped robot: something that it can do, driven by what exists."""

from __future__ import annotations

from dataclasses import replace

import pytest

from fulmar_bringup.completion import completed
from fulmar_bringup.plan_checks import checked
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system_rows import system_rows
from fulmar_core.config.errors import BundleError, ConfigError
from fulmar_core.config.paths import config_names
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from policy_server.controllers import controller_entry, shipped_policy, usual_controller


def planned(robot, task="", controller="", **more):
    return checked(completed(RunPlan(robot, task, controller, "mujoco", **more)))


@pytest.mark.parametrize("robot", config_names("robots"))
def test_a_robot_alone_is_a_run_of_what_it_can_do_by_a_controller_that_exists(robot):
    plan = planned(robot)
    kind = load_robot(robot).kind
    assert plan.task in (kind.usual_task, kind.other_task)
    assert bool(plan.policy) is (plan.controller == "policy")
    assert plan.policy in ("", str(shipped_policy(robot, plan.task)))
    entry = controller_entry(plan.controller)
    assert entry.runs_bundle or entry.is_law
    assert plan.start[2] > 0.0 or kind.stays  # above the ground
    rows = system_rows(plan, record={"directory": "", "info": "{}", "files": "{}"})
    assert rows["controller"].parameters["controller"] == plan.controller
    assert rows["plant"].parameters["start"] == list(plan.start)


@pytest.mark.parametrize(
    ("robot", "task", "controller"),
    [
        ("floating_platform", "go_to_pose", "policy"),
        ("spacecraft_16", "go_to_pose_3d", "lqr"),  # thriftier than its policy
        ("jetbot", "go_to_pose", "classical"),  # no policy is shipped for poses
        ("leatherback", "go_to_position", "policy"),  # nothing parks it
        ("floating_platform_roboran", "go_to_pose", "classical"),
        ("cubesat_wheels", "point", "classical"),
        ("airship_v7", "fly_hold", "policy"),
        ("navion", "fly_attitude", "lqi"),  # a metre above the water its hull touches it
    ],
)
def test_the_usual_task_and_controller_are(robot, task, controller):
    plan = planned(robot)
    assert (plan.task, plan.controller) == (task, controller)


def test_every_pair_with_a_policy_or_a_law_has_a_usual_controller_that_is_there():
    for robot in map(
        load_robot, ("floating_platform", "spacecraft_16", "cubesat_wheels", "navion", "jetbot")
    ):
        for task in map(load_task, config_names("tasks")):
            try:
                task.check(robot)
            except ConfigError:
                continue
            controller = usual_controller(robot, task)
            if controller != "policy":
                controller_entry(controller).check(robot, task)
    assert usual_controller(load_robot("spacecraft_16"), load_task("go_to_pose_3d"), "mine") == "policy"


@pytest.mark.parametrize(
    "robot", ["cubesat_wheels", "microsat", "navion", "smallsat", "floating_platform_roboran"]
)
def test_a_policy_that_is_asked_for_runs_or_the_run_is_refused(robot):
    with pytest.raises(BundleError, match=rf"no policy is shipped for '{robot}'.*--controller classical"):
        planned(robot, controller="policy")


def test_a_policy_that_is_asked_for_decides_the_task_where_none_is():
    plan = planned("jetbot", controller="policy")
    assert (plan.task, plan.policy) == ("go_to_position", str(shipped_policy("jetbot", "go_to_position")))


def test_stars_that_are_not_installed_are_missed_before_anything_starts(monkeypatch):
    assert planned("cubesat_wheels", scenario="gyro_dies").guards.estimators == ("event_rate",)
    monkeypatch.setattr("fulmar_bringup.plan_checks.catalogue_path", lambda: None)
    with pytest.raises(ConfigError, match=r"not installed\. Run: fulmar install-stars"):
        planned("cubesat_wheels", scenario="gyro_dies")
    planned("cubesat_wheels")  # needs none


def test_a_scenario_of_another_family_is_refused_with_those_that_fit():
    with pytest.raises(
        ConfigError, match=r"'gyro_dies'.* is not for 'spacecraft_16'.*Scenarios that fit: .*low_orbit"
    ):
        planned("spacecraft_16", scenario="gyro_dies")
    with pytest.raises(
        ConfigError, match=r"'surface_stuck'.* is not for 'jetbot'.*Scenarios that fit: .*wheel_dead"
    ):
        planned("jetbot", scenario="surface_stuck")


def test_a_real_robot_takes_no_scenario():
    asked = {"goal": (1.0, 0.0), "hardware": "turtlebot2", "scenario": "wheel_dead"}
    with pytest.raises(ConfigError, match="a real robot has its own surroundings"):
        checked(completed(RunPlan("turtlebot2", "", "", "hardware", **asked)))
    assert checked(completed(RunPlan("turtlebot2", "", "", "hardware", emulated=True, **asked)))


def test_a_height_that_is_no_number_is_refused():
    with pytest.raises(ConfigError, match="height = nan must be finite"):
        planned("airship_v7", height=float("nan"))


def test_a_controller_of_ones_own_may_read_the_gyroscope(tmp_path, monkeypatch):
    file = tmp_path / "scenarios" / "blind.yaml"
    file.parent.mkdir()
    file.write_text("title: blind\nsensor_noise: true\nbody: nominal\nsensing: {gyroscope_dies_s: 5.0}\n")
    own = "class Controller:\n    def reset(self): ...\n    def act(self, inputs): return inputs.previous\n"
    (tmp_path / "reads_gyroscope.py").write_text(own)
    monkeypatch.setenv("FULMAR_CONFIGS", str(tmp_path))
    monkeypatch.syspath_prepend(str(tmp_path))
    plan = RunPlan("spacecraft_16", "go_to_pose_3d", "reads_gyroscope:Controller", "mujoco", scenario="blind")
    assert completed(plan).controller == plan.controller
    with pytest.raises(ConfigError, match="gyroscope would have no effect"):
        completed(replace(plan, controller="lqr"))


def test_a_usual_controller_of_ones_own_is_taken_where_no_law_is():
    robot = replace(load_robot("floating_platform"), usual_controller="mine:Controller")
    assert usual_controller(robot, load_task("track_velocities")) == "mine:Controller"
