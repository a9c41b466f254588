"""A goal of an action client on its way, and how it ends."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.loop import action_end
from fulmar_core.loop.action_end import ActionEnd, end_of
from fulmar_core.loop.pursuit import AHEAD_M, HOLD_S, PASSED_M, Pursuit, checked_task
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.planar import at_rest
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import load_task

STAMP = 7_000_000_000


def pose(x: float, y: float, yaw: float = 0.0) -> list[float]:
    return [x, y, 0.0, 0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0)]


def state(x: float, y: float, yaw: float = 0.0) -> RigidBodyState:
    return at_rest(x, y, yaw).to_rigid()


def pursuit(*poses: list[float], follows: bool = False, task: str = "go_to_pose") -> Pursuit:
    return Pursuit(load_robot("floating_platform"), load_task(task), np.array(poses), follows=follows)


def test_a_goal_is_met_once_its_tolerance_held_for_a_while() -> None:
    goal = pursuit(pose(1.0, 0.0))
    goal.see(state(0.0, 0.0), 0.0)
    assert goal.remaining_m == pytest.approx(1.0)
    goal.see(state(1.0, 0.0), 1.0)
    assert not goal.reached
    goal.see(state(1.0, 0.5), 1.2)  # through it, and away
    goal.see(state(1.0, 0.0), 1.4)
    goal.see(state(1.0, 0.0), 1.4 + HOLD_S - 0.1)
    assert not goal.reached
    goal.see(state(1.0, 0.0), 1.4 + HOLD_S)
    assert goal.reached


def test_a_heading_that_a_task_asks_for_counts_and_another_does_not() -> None:
    for task, counts in (("go_to_pose", True), ("go_to_position", False)):
        goal = pursuit(pose(1.0, 0.0, yaw=2.0), task=task)
        for time_s in (0.0, 1.0):
            goal.see(state(1.0, 0.0, yaw=0.0), time_s)
        assert goal.reached is not counts


def test_poses_are_passed_in_their_order_and_the_way_through_all_of_them_counts() -> None:
    goal = pursuit(pose(1.0, 0.0), pose(1.0, 1.0), pose(0.0, 1.0))
    goal.see(state(0.0, 0.0), 0.0)
    assert (goal.left, goal.remaining_m) == (3, pytest.approx(3.0))
    goal.see(state(0.0, 1.0), 1.0)  # at the last one already, which is not its turn
    assert goal.left == 3
    goal.see(state(1.0, PASSED_M - 0.01, yaw=1.0), 2.0)
    assert (goal.left, goal.target[0, 1]) == (2, 1.0)
    goal.see(state(1.0, 1.0), 3.0)
    for time_s in (4.0, 5.0):
        goal.see(state(0.0, 1.0), time_s)
    assert goal.reached


def test_the_target_on_a_path_is_ahead_of_the_robot_and_ends_at_its_end() -> None:
    goal = pursuit(pose(0.0, 0.0), pose(2.0, 0.0), pose(2.0, 2.0), follows=True)
    goal.see(state(0.0, 0.1), 0.0)
    assert goal.target[0, 0] == pytest.approx(AHEAD_M)
    seen = []
    for step, x in enumerate(np.linspace(0.0, 2.0, 41)):
        goal.see(state(x, 0.1), float(step))
        seen.append(goal.target[0, :2].copy())
    assert np.all(np.linalg.norm(np.diff(seen, axis=0), axis=1) < AHEAD_M)  # no shortcut over the corner
    assert seen[-1][0] == pytest.approx(2.0)
    for step, y in enumerate(np.linspace(0.1, 2.0, 41)):
        goal.see(state(2.0, y), 50.0 + step)
    assert goal.target[0, :2].tolist() == pytest.approx([2.0, 2.0])
    goal.see(state(2.0, 2.0), 100.0)
    goal.see(state(2.0, 2.0), 101.0)
    assert goal.reached


def test_a_path_that_crosses_itself_is_not_cut_short() -> None:
    goal = pursuit(
        pose(0.0, 0.0), pose(2.0, 0.0), pose(2.0, 1.0), pose(0.0, 1.0), pose(0.0, 0.0), follows=True
    )
    for time_s in (0.0, 1.0, 2.0):
        goal.see(state(0.0, 0.0), time_s)
    assert not goal.reached
    assert goal.remaining_m > 5.0


OTHER = 5
REFUSED = {"goal_refused_stamp_ns": str(STAMP)}


@pytest.mark.parametrize(
    ("status", "code"),
    [
        ({"mode": "fault", "reason": "broken"}, action_end.NO_VALID_CONTROL),
        ({"mode": "armed", "reason": "e-stop: pressed."}, action_end.NO_VALID_CONTROL),
        ({"goal_refused": "out of bounds: far", **REFUSED}, action_end.GOAL_OUTSIDE_MAP),
        ({"goal_refused": "99 m away, beyond the geofence of 9 m", **REFUSED}, action_end.GOAL_OUTSIDE_MAP),
        ({"goal_refused": "stopped", **REFUSED}, action_end.NO_VALID_CONTROL),
        ({"unconverged": "no nearer", "goal_stamp_ns": str(STAMP)}, action_end.FAILED_TO_MAKE_PROGRESS),
        ({"goal_stamp_ns": str(OTHER), "goal_by": "alice"}, action_end.UNKNOWN),
        ({"goal_stamp_ns": "0"}, action_end.NO_VALID_CONTROL),
    ],
)
@pytest.mark.parametrize(("since_s", "taken"), [(10.0, False), (0.1, True)])
def test_what_a_controller_reports_ends_a_goal_with_nav2s_code(
    status: dict[str, str], code: int, since_s: float, taken: bool
) -> None:
    end = end_of(status, {STAMP - 1, STAMP}, since_s=since_s, taken=taken)
    assert isinstance(end, ActionEnd)
    assert end.code == code
    assert end.words


@pytest.mark.parametrize(
    ("status", "since_s"),
    [
        ({"mode": "active", "reason": "", "goal_stamp_ns": str(STAMP - 1)}, 10.0),
        ({"goal_refused": "far", "goal_refused_stamp_ns": str(OTHER), "goal_stamp_ns": str(STAMP)}, 10.0),
        ({"unconverged": "no nearer", "goal_stamp_ns": str(OTHER)}, 0.1),  # of the goal before
        ({"goal_stamp_ns": str(OTHER)}, 0.1),  # not taken yet
    ],
)
def test_a_goal_goes_on_while_nothing_is_wrong_with_it(status: dict[str, str], since_s: float) -> None:
    assert end_of(status, {STAMP - 1, STAMP}, since_s=since_s, taken=False) is None


def test_a_controller_that_does_not_act_for_long_ends_a_goal() -> None:
    status = {"mode": "armed", "reason": "the air bearing is off", "goal_stamp_ns": str(STAMP)}
    assert end_of(status, {STAMP}, since_s=9.0, taken=True, held_s=1.0) is None
    end = end_of(status, {STAMP}, since_s=9.0, taken=True, held_s=9.0)
    assert end == ActionEnd(
        action_end.NO_VALID_CONTROL, "the controller does not act: the air bearing is off"
    )


@pytest.mark.parametrize(
    ("task", "words"),
    [
        ("track_velocities", "takes goals on 'goal_velocity'"),
        ("fly_path", "takes goals on 'goal_path'"),
        ("push_block", "is about the block"),
    ],
)
def test_tasks_whose_goals_are_no_places_of_the_robot_are_refused(task: str, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        checked_task(load_task(task))
