"""Plans of runs of a spacecraft: starts, goals and areas with six numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fulmar_bringup.controller_row import controller_spec
from fulmar_bringup.plant_row import plant_spec
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.task_choice import check_heading, default_task, goal_note, task_of_goals
from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.spatial import SpatialState


class Still:
    """A controller that does nothing."""

    def __init__(self, robot, task, settings):
        """Keep nothing."""

    def reset(self):
        """Forget nothing."""

    def act(self, inputs):
        """Open no valve."""
        return np.zeros_like(inputs.previous)


STILL = f"{__name__}:Still"
SPACE = {"robot": "spacecraft_16", "task": "go_to_pose_3d", "controller": "external"}
GOAL, START = (1.0, 0.0, -0.5, 0.0, 30.0, 90.0), (0.0, 0.5, 0.0, 10.0, 20.0, 30.0)


def test_what_was_said_is_kept_and_reaches_the_plant(plan):
    request = plan(**SPACE, goal=GOAL, start=START)
    assert (request.goal, request.start) == (GOAL, START)
    assert plant_spec(request).parameters["start"] == list(START)
    assert SpatialState.written(request.mission.current) == pytest.approx(GOAL)


def test_a_place_alone_is_upright(plan):
    request = plan(**SPACE, goal=GOAL[:3], start=START[:3])
    assert request.goal == (*GOAL[:3], 0.0, 0.0, 0.0)
    assert request.start == (*START[:3], 0.0, 0.0, 0.0)


def test_one_seed_gives_one_plan_as_far_from_the_goal_as_the_task_says(plan):
    request = plan(**SPACE, seed=7)
    assert request == plan(**SPACE, seed=7)
    assert request.goal != plan(**SPACE, seed=8).goal
    assert (len(request.goal), len(request.start)) == (6, 6)
    assert 0.25 <= math.dist(request.goal[:3], request.start[:3]) <= 6.0


def test_a_goal_alone_moves_the_start_along_and_keeps_its_attitude(plan):
    drawn, moved = plan(**SPACE, seed=3), plan(**SPACE, seed=3, goal=(5.0, 5.0, -5.0, 0.0, 0.0, 0.0))
    offsets = [np.subtract(each.start, each.goal)[:3] for each in (drawn, moved)]
    assert offsets[0] == pytest.approx(offsets[1])
    assert moved.start[3:] == drawn.start[3:]


def test_a_box_reaches_the_controller(plan):
    box = (-9.0, 9.0, -9.0, 9.0, -9.0, 9.0)
    request = plan(**SPACE | {"controller": STILL}, goal=GOAL, start=START, guards={"area": box})
    assert controller_spec(request).parameters["area"] == list(box)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"goal": (1.0, 2.0)},
            "--goal = '1,2' has 2 numbers; 'spacecraft_16' moves in space: 3 (x,y,z) or 6",
        ),
        ({"start": (1.0, 2.0, 0.0, 90.0)}, "--start = '1,2,0,90' has 4 numbers"),
        ({"goal": (0.0, 0.0, 30.0), "start": (0.0, 0.0, 0.0)}, "start and goal are 30.0 m apart"),
        ({"goal": (0.0, 0.0, 2000.0)}, "z = 2000 m lies 2,000 m from the origin"),
        ({"goal": (0.0, math.inf, 0.0)}, "must be finite"),
        (
            {"guards": {"estimator": "mocap_imu"}},
            "pushed in space. Use 'mocap_imu_3d' of configs/estimators, or leave it out.",
        ),
        ({"task": "go_to_pose"}, "task 'go_to_pose' is for robots that are pushed over a floor or water"),
        ({"robot": "floating_platform"}, "task 'go_to_pose_3d' is for bodies that are pushed in space"),
        (
            {"controller": STILL, "guards": {"area": (-1.0, 1.0, -1.0, 1.0)}},
            "moves in space, where an area has 6",
        ),
    ],
)
def test_what_cannot_be_is_refused(change, words, plan):
    with pytest.raises(ConfigError) as caught:
        plan(**SPACE | change)
    assert words in str(caught.value)


def test_an_estimator_in_space_is_refused_in_the_plane_with_the_one_to_use(plan):
    with pytest.raises(ConfigError, match=r"over a floor or water\. Use 'mocap_imu' of configs/estimators"):
        plan(guards={"estimator": "mocap_imu_3d"})


def test_a_box_in_the_plane_is_refused(plan):
    with pytest.raises(ConfigError, match="moves in two dimensions, where an area has 4 sides"):
        plan(guards={"area": (-1.0, 1.0, -1.0, 1.0, -1.0, 1.0)})


@pytest.mark.parametrize(
    ("goal", "task"),
    [(None, "go_to_pose_3d"), (GOAL, "go_to_pose_3d")],
)
def test_the_goal_decides_the_task(goal, task):
    assert default_task("spacecraft_16", "external", goal=goal) == task


def test_three_numbers_where_six_are_usual_are_asked_back_with_both_forms():
    with pytest.raises(
        ConfigError, match=r"has 3 numbers.*--goal x,y,z,roll,pitch,yaw.*--task go_to_position_3d"
    ):
        default_task("spacecraft_16", "external", goal=(1.0, 0.0, 90.0))
    with pytest.raises(ConfigError, match=r"cannot stop at a place.*--height H.*--velocity V.*fly_attitude"):
        default_task("navion", "lqi", goal=(100.0, 0.0, 50.0))


def test_a_hardware_file_that_is_named_counts_more_than_what_is_shipped(plan, tmp_path):
    path = tmp_path / "valves.yaml"
    lines, order = [str(number) for number in range(16)], list(range(16))
    path.write_text(
        f"title: t\nrobot: spacecraft_16\ndriver: {{kind: gpio_valves, port: x, lines: {lines}, order: {order}}}\n"
    )
    with pytest.raises(ConfigError, match="there is no hardware driver for 'int_ball2'"):
        default_task("int_ball2", "lqr", "hardware")
    task = default_task("spacecraft_16", "lqr", "hardware", hardware=str(path))
    asked = {"robot": "spacecraft_16", "task": task, "controller": "lqr", "goal": GOAL}
    found = plan(**asked, backend="hardware", hardware=str(path), emulated=True)
    assert (task, found.hardware) == ("go_to_pose_3d", str(path))
    assert found.guards.estimator == "mocap_imu_3d"  # valves measure nothing


def test_a_place_is_no_pose_and_an_attitude_without_effect_is_said():
    with pytest.raises(ConfigError, match="needs an attitude: --goal x,y,z,roll,pitch,yaw"):
        check_heading("go_to_pose_3d", GOAL[:3])
    note = check_heading("go_to_position_3d", GOAL)
    assert note == "task 'go_to_position_3d' has no attitude: the 0, 30, 90 deg of --goal have no effect"
    with pytest.raises(ConfigError, match="has 2 numbers"):
        goal_note(RunPlan("spacecraft_16", "", "lqr", "mujoco", goal=(1.0, 2.0)))


@pytest.mark.parametrize(
    ("text", "task"),
    [
        ("kind: positions\ntitle: t\npositions: [[1, 0, 1]]\n", "go_to_position_3d"),
        ("kind: poses\ntitle: t\nposes: [[1, 0, 1, 0, 0, 90]]\n", "go_to_pose_3d"),
        (
            "kind: velocities\ntitle: t\nvelocities:\n- {velocity: [0, 0, 0.1, 0, 5, 0], hold_s: 4}\n",
            "track_velocities_3d",
        ),
    ],
)
def test_a_file_in_space_is_for_the_tasks_in_space(text, task, plan, tmp_path):
    (tmp_path / "goals.yaml").write_text(text)
    goals = str(tmp_path / "goals.yaml")
    assert task_of_goals(goals) == task
    request = plan(**SPACE | {"task": task}, goals=goals)
    assert len(request.start) == 6
    with pytest.raises(ConfigError, match="no goals of task"):
        plan(
            **SPACE | {"task": "go_through_poses_3d" if "velocities" in text else "track_velocities_3d"},
            goals=goals,
        )


def test_a_turn_rate_beyond_the_limit_is_refused_whatever_its_axis(plan, tmp_path):
    (tmp_path / "fast.yaml").write_text(
        "kind: velocities\ntitle: t\nvelocities:\n- {velocity: [0, 0, 0, 300, 300, 0], hold_s: 4}\n"
    )
    with pytest.raises(ConfigError, match="ask for 424"):
        plan(**SPACE | {"task": "track_velocities_3d"}, goals=str(tmp_path / "fast.yaml"))


def test_a_target_that_moves_starts_where_it_begins_and_lasts_as_long_as_it_moves(plan):
    request = plan(**SPACE, goals="helix")
    assert task_of_goals("helix") == "go_to_pose_3d"
    assert request.start[:3] == pytest.approx((1.0, 0.0, -0.5))
    assert request.duration_s == pytest.approx(2.0 * math.hypot(2.0 * math.pi, 0.5) / 0.1 + 10.0, rel=1e-3)


HELIX = "kind: trajectory\ntitle: t\nspeed: {}\nfacing: {}\npath: {{kind: helix, radius: 1, pitch: 9, turns: 1}}\n"


@pytest.mark.parametrize(
    ("values", "change", "words"),
    [
        ((0.3, "along_path"), {}, "at 5 Hz by more than the task's tolerance in a control step: at most 0.25 m/s"),
        ((0.1, "any"), {}, "Leave --task out: they are for 'go_to_position_3d'"),
        ((0.1, "fixed"), {"guards": {"area": (-2.0, 2.0, -2.0, 2.0, -1.0, 1.0)}}, "z = -4.5 m lies outside"),
        ((0.1, "sideways"), {}, "'facing' = 'sideways'"),
    ],
)  # fmt: skip
def test_a_target_that_cannot_be_followed_is_refused(values, change, words, plan, tmp_path):
    (tmp_path / "fast.yaml").write_text(HELIX.format(*values))
    with pytest.raises(ConfigError) as caught:
        plan(**SPACE | {"controller": STILL} | change, goals=str(tmp_path / "fast.yaml"))
    assert words in str(caught.value)


CIRCLE = "kind: trajectory\ntitle: t\nspeed: {}\nfacing: {}\npath: {{kind: tilted_circle, radius: {}}}\n"


def test_a_target_that_turns_beyond_the_tolerance_from_step_to_step_is_refused(plan, tmp_path):
    goals = tmp_path / "tight.yaml"

    def planned(*values, **change):
        goals.write_text(CIRCLE.format(*values))
        return plan(**SPACE | {"controller": STILL} | change, goals=str(goals))

    with pytest.raises(ConfigError, match=r"turn by up to 27.5 deg in a control step at 5 Hz.* is 5 deg"):
        planned(0.24, "along_path", 0.1)
    with pytest.raises(ConfigError, match=r"turn by up to 5.2 deg"):
        planned(0.09, "along_path", 0.2)
    planned(0.08, "along_path", 0.2)
    planned(0.24, "fixed", 0.5)
    with pytest.raises(ConfigError, match=r"turn by up to 13.8 deg in a control step at 10 Hz"):
        planned(0.24, "along_path", 0.1, control_hz=25.0)  # goals come at 10 Hz


def test_the_pace_of_a_target_is_that_of_the_runs_goals(plan, tmp_path):
    goals = tmp_path / "fast.yaml"
    goals.write_text(CIRCLE.format(0.4, "along_path", 2.0))
    request = {**SPACE, "controller": STILL, "goals": str(goals)}
    with pytest.raises(ConfigError, match="at 5 Hz by more than"):
        plan(**request)
    plan(**request, control_hz=12.5)
    goals.write_text(CIRCLE.format(0.6, "along_path", 2.0))
    with pytest.raises(ConfigError, match=r"at 10 Hz by more than .* at most 0.5 m/s"):
        plan(**request, control_hz=12.5)
    with pytest.raises(ConfigError, match=r"0.6 m/s, and tasks of 'spacecraft_16' ask for 0.4 m/s"):
        plan(**request, control_hz=12.5, lockstep=True)


def test_a_target_that_bends_or_turns_harder_than_the_robot_sustains_is_refused(plan, tmp_path):
    goals = tmp_path / "tight.yaml"
    request = {**SPACE, "controller": STILL, "goals": str(goals)}
    goals.write_text(CIRCLE.format(0.24, "fixed", 0.4))
    with pytest.raises(
        ConfigError, match=r"0.24 m/s takes 0.144 m/s².* sustains 0.12 m/s².* of 0.22 m/s at most"
    ):
        plan(**request)
    goals.write_text(CIRCLE.format(0.21, "fixed", 0.4))
    plan(**request)
    goals.write_text(CIRCLE.format(0.15, "along_path", 0.2))
    with pytest.raises(ConfigError, match=r"turn by up to 8.6 deg in a control step"):
        plan(**request)
    with pytest.raises(
        ConfigError, match=r"turn by 43 deg/s, and tasks of 'spacecraft_16' ask for 34.4 deg/s"
    ):
        plan(**request, control_hz=25.0, lockstep=True)


def test_a_plan_of_an_inspection_has_its_path_its_thing_and_the_time_of_one_whole_round(plan):
    inspect = {"robot": "cubesat_8", "task": "inspect", "controller": "pd"}
    request = plan(**inspect, thing="venus_express", along="capsule", seed=3)
    assert "goal: the capsule about 'venus_express', " in request.line
    task = request.asked_task
    assert request.duration_s == task.episode_of(load_robot("cubesat_8")) != task.episode_s
    assert request.mission.targets.shape[0] * task.spacing_s >= request.duration_s
    assert controller_spec(request).parameters["thing"] == "venus_express"
    written = SpatialState.written(request.mission.targets[0])
    assert request.start == pytest.approx(written, abs=1e-3)
