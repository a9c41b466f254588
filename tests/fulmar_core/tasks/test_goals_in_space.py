"""Goals of a spacecraft: numbers as people write them, files, and their order."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_directory, config_names
from fulmar_core.robots.kinds import GOING
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.spatial import SpatialState
from fulmar_core.states.state import State
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal_files import HeldVelocity, Poses, Positions, Velocities, single_goal
from fulmar_core.tasks.goal_sequence import goal_sequence

CRAFT = load_robot("spacecraft_16")
POSES = Poses("poses", "two", ((1.0, 0.0, 0.5, 0.0, 0.0, 90.0), (0.0, 0.0, 0.0, 0.0, 30.0, 0.0)))


def at(*numbers: float) -> SpatialState:
    return SpatialState.resting(SpatialState.target_at(numbers))


@pytest.mark.parametrize(
    ("form", "numbers"),
    [
        (SpatialState, (1.0, -2.0, 3.0, 20.0, -30.0, 170.0)),
        (SpatialState, (0.0, 0.0, 0.0, -179.0, 80.0, -5.0)),
        (PlanarState, (1.0, -2.0, -135.0)),
    ],
)
def test_a_pose_is_written_as_it_was_read(form: type[State], numbers):
    target = form.target_at(numbers)
    assert form.written(target) == pytest.approx(numbers)
    resting = form.resting(target)
    assert np.asarray(resting.pose) == pytest.approx(target)
    assert not resting.to_rigid().velocity_in_world.any()
    assert not resting.to_rigid().angular_velocity_in_body.any()


@pytest.mark.parametrize("numbers", [(1.0,), (1.0, 2.0, 3.0, 4.0), (1.0,) * 7])
def test_another_count_of_numbers_is_no_pose(numbers):
    for form in (PlanarState, SpatialState):
        with pytest.raises(ValueError, match="unpack"):
            form.target_at(numbers)


def test_yaw_turns_about_z_after_roll_about_x():
    """REP-103: a craft that rolled by 90 deg and yawed by 90 deg looks along y, and its left side points up."""
    turned = SpatialState.target_at((0.0, 0.0, 0.0, 90.0, 0.0, 90.0))
    assert turned[3:] == pytest.approx([0.5, 0.5, 0.5, 0.5])
    assert SpatialState.target_at((1.0, 2.0, 3.0)).tolist() == [1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0]


def test_a_pose_gives_way_to_the_next_once_place_and_attitude_were_held():
    sequence = goal_sequence(POSES, CRAFT)
    assert (sequence.topic, sequence.form) == ("goal_pose", SpatialState)
    assert sequence.step(at(1.0, 0.0, 0.5, 0.0, 10.0, 90.0), 0.0).targets.shape == (1, 7)
    sequence.step(at(1.0, 0.0, 0.5, 0.0, 10.0, 90.0), 5.0)  # 10 deg off about another axis than yaw
    assert sequence.progress == "0 of 2 targets reached"
    sequence.step(at(1.0, 0.0, 0.4, 0.0, 0.0, 90.0), 6.0)  # 10 cm below
    sequence.step(at(1.0, 0.0, 0.4, 0.0, 0.0, 90.0), 8.0)
    assert sequence.progress == "0 of 2 targets reached"
    sequence.step(at(1.0, 0.0, 0.49, 0.0, 0.0, 88.0), 9.0)
    sequence.step(at(1.0, 0.0, 0.49, 0.0, 0.0, 88.0), 10.0)
    assert sequence.progress == "1 of 2 targets reached"
    sequence.step(at(0.0, 0.0, 0.0, 0.0, 30.0, 0.0), 11.0)
    sequence.step(at(0.0, 0.0, 0.0, 0.0, 30.0, 0.0), 12.0)
    assert sequence.done


def test_positions_have_no_attitude_and_may_all_come_at_once():
    file = Positions("positions", "two", ((1.0, 0.0, 0.5), (0.0, 0.0, 0.0)))
    sequence = goal_sequence(file, CRAFT)
    assert sequence.topic == "goal_point"
    sequence.step(at(1.0, 0.0, 0.5, 90.0, 0.0, 0.0), 0.0)
    sequence.step(at(1.0, 0.0, 0.5, 0.0, 0.0, 90.0), 1.0)
    assert sequence.progress == "1 of 2 targets reached"
    assert goal_sequence(file, CRAFT, as_path=True).step(at(0.0, 0.0, 0.0), 0.0).targets.shape == (2, 7)


def test_velocities_follow_the_clock_and_end_in_standstill():
    file = Velocities("velocities", "one", (HeldVelocity((0.1, 0.0, 0.2, 0.0, 90.0, 0.0), 2.0),))
    sequence = goal_sequence(file, CRAFT)
    goal = sequence.step(at(0.0, 0.0, 0.0), 0.0)
    assert goal.current == pytest.approx([0.1, 0.0, 0.2, 0.0, np.pi / 2, 0.0])
    assert sequence.step(at(0.0, 0.0, 0.0), 2.0).current.tolist() == [0.0] * 6
    assert sequence.done


def test_goals_of_the_other_space_are_refused_by_both_robots():
    with pytest.raises(
        ConfigError, match="is in space, and robot 'floating_platform' moves in two dimensions"
    ):
        goal_sequence(POSES, load_robot("floating_platform"))
    with pytest.raises(ConfigError, match="is in two dimensions, and robot 'spacecraft_16' moves in space"):
        goal_sequence(single_goal((1.0, 2.0, 90.0)), CRAFT)


def test_a_single_goal_says_what_it_is():
    assert single_goal((1.0, 0.0, 0.5), SpatialState).title == "x 1, y 0, z 0.5 m, any attitude"
    pose = single_goal((1.0, 0.0, 0.5, 0.0, 0.0, 90.0), SpatialState)
    assert pose.title == "x 1, y 0, z 0.5 m, roll 0, pitch 0, yaw 90 degrees"
    assert single_goal((1.0, 0.5, 90.0)).title == "x 1, y 0.5 m, heading 90 degrees"


@pytest.mark.parametrize(
    ("robot", "task"), [("spacecraft_16", "go_to_pose"), ("floating_platform", "go_to_pose_3d")]
)
def test_a_task_of_the_other_space_is_refused(robot, task):
    with pytest.raises(ConfigError, match=f"task '{task}' is for .*; '{robot}' is one of the .* pushed"):
        load_task(task).check(load_robot(robot))


def test_names_of_tasks_end_as_their_state_type_says():
    """But of those that have no twin in the plane."""
    tasks = [load_task(name) for name in config_names("tasks") if name not in ("dock", "inspect")]
    found = {task.name: task.state_type for task in tasks if task.kinds in GOING.values()}
    assert SpatialState in found.values()
    for name, form in found.items():
        assert name.endswith("_3d") == (form is SpatialState)
        assert name.endswith(form.SUFFIX)


def test_a_task_in_space_of_any_name_is_not_proposed_for_itself(tmp_path, monkeypatch):
    (tmp_path / "robots").mkdir()
    (tmp_path / "tasks").mkdir()
    text = (config_directory() / "tasks" / "go_to_pose_3d.yaml").read_text()
    (tmp_path / "tasks" / "arrive.yaml").write_text(text.replace("name: go_to_pose_3d", "name: arrive"))
    monkeypatch.setenv("FULMAR_CONFIGS", str(tmp_path))
    with pytest.raises(
        ConfigError, match=r"over a floor or water\. `fulmar list tasks` shows others, such as go_to_pose\.$"
    ):
        load_task("arrive").check(load_robot("floating_platform"))
    with pytest.raises(
        ConfigError,
        match=r"Did you mean 'go_to_pose'\? `fulmar list tasks` shows others, such as go_to_pose\.$",
    ):
        load_task("go_to_pose_3d").check(load_robot("floating_platform"))
    with pytest.raises(
        ConfigError,
        match=r"Did you mean 'go_to_pose_3d'\? `fulmar list tasks` shows others, such as go_to_pose_3d\.$",
    ):
        load_task("go_to_pose").check(load_robot("spacecraft_16"))
