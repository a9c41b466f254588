"""Tasks of one place: what a controller sees, and what it is rewarded for."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.config.paths import config_directory
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_at
from fulmar_core.tasks.terms import Start, Tolerance, fine_terms, pose_errors

POSE, POSITION = load_task("go_to_pose"), load_task("go_to_position")
BOTH = pytest.mark.parametrize("task", [POSE, POSITION], ids=lambda task: task.name)
metres, radians = st.floats(-5, 5), st.floats(-3.1, 3.1)


def body(x=0.0, y=0.0, yaw=0.0, vx=0.0, vy=0.0, yaw_rate=0.0):
    return PlanarState(*(np.asarray(float(value)) for value in (x, y, yaw, vx, vy, yaw_rate)))


def seen(task, state, goal):
    return {
        name: float(term)
        for name, term in zip(task.observation_names, task.observe(state, goal), strict=True)
    }


@BOTH
@settings(derandomize=True, deadline=None)
@given(
    x=metres, y=metres, yaw=radians, gx=metres, gy=metres, gyaw=radians, dx=metres, dy=metres, turn=radians
)
def test_moving_and_turning_the_whole_world_changes_no_observation(
    task, x, y, yaw, gx, gy, gyaw, dx, dy, turn
):
    def observed(turn, dx, dy):
        c, s = np.cos(turn), np.sin(turn)
        state = body(
            c * x - s * y + dx, s * x + c * y + dy, yaw + turn, c * 0.3 - s * 0.1, s * 0.3 + c * 0.1, 0.2
        )
        return task.observe(state, goal_at((c * gx - s * gy + dx, s * gx + c * gy + dy, gyaw + turn)))

    # The fine terms divide by 0.3 m what rounds at 1e-15 for metres.
    np.testing.assert_allclose(observed(turn, dx, dy), observed(0.0, 0.0, 0.0), rtol=0, atol=1e-12)


@BOTH
def test_names_state_what_is_in_the_columns(task):
    expected = {
        "goal_x_in_body": 2.0,  # the goal lies straight ahead
        "goal_y_in_body": 0.0,
        "cos_heading_error": 0.0,
        "sin_heading_error": 1.0,
        "velocity_x_in_body": -0.2,
        "velocity_y_in_body": -0.3,
        "yaw_rate": 0.7,
        "fine_goal_x_in_body": 1.0,
        "fine_goal_y_in_body": 0.0,
        "goal_distance": 2.0,
    }
    columns = seen(task, body(1.0, 1.0, np.pi / 2, 0.3, -0.2, 0.7), goal_at((1.0, 3.0, np.pi)))
    assert columns == pytest.approx({name: expected[name] for name in task.observation_names}, abs=1e-12)


def test_the_fine_terms_magnify_near_the_goal_and_saturate_far_from_it():
    near = fine_terms(np.asarray(0.03), np.asarray(-0.06), saturation=0.3)
    np.testing.assert_allclose(near[:2], [0.1, -0.2], rtol=0, atol=1e-15)
    far = fine_terms(np.asarray(3.0), np.asarray(4.0), saturation=0.3)
    np.testing.assert_allclose(far, [0.6, 0.8, 5.0], rtol=0, atol=1e-15)
    assert [float(v) for v in fine_terms(np.asarray(0.0), np.asarray(0.0), saturation=0.3)] == [0.0, 0.0, 0.0]


def test_a_position_task_does_not_see_the_heading_of_the_goal_and_a_pose_task_does():
    position, pose = (
        [seen(task, body(), goal_at((1.0, 2.0, yaw))) for yaw in (0.0, 2.0)] for task in (POSITION, POSE)
    )
    assert position[0] == position[1]
    assert pose[0] != pose[1]


def test_heading_errors_go_the_short_way_around():
    error = pose_errors(body(yaw=np.deg2rad(170)), np.array([3.0, 4.0, np.deg2rad(-170)]), heading=True)
    assert float(error.position) == pytest.approx(5.0, abs=1e-12)
    assert np.rad2deg(error.heading) == pytest.approx(20.0, abs=1e-9)


@BOTH
def test_coming_nearer_is_worth_more_than_going_away(task):
    start, goal = body(1.0, yaw=0.3), goal_at((0.0, 0.0, 0.3))
    assert task.reward(start, body(0.9, yaw=0.3), goal, goal) > task.reward(
        start, body(1.1, yaw=0.3), goal, goal
    )


@BOTH
@settings(derandomize=True, deadline=None)
@given(x=st.floats(0.15, 5.0), yaw=radians)
def test_resting_at_the_goal_is_worth_more_than_resting_anywhere_else(task, x, yaw):
    goal, home, away = goal_at((0.0, 0.0, 0.0)), body(), body(x, 0.0, yaw)
    assert task.reward(home, home, goal, goal) > task.reward(away, away, goal, goal)


def test_turning_to_the_goal_s_heading_pays_in_the_pose_task_alone():
    start, goal = body(0.05, yaw=0.5), goal_at((0.0, 0.0, 0.0))
    turned = body(0.05, yaw=0.3)
    gains = [
        float(task.reward(start, turned, goal, goal) - task.reward(start, start, goal, goal))
        for task in (POSE, POSITION)
    ]
    assert gains[0] > 0.05
    assert gains[1] == 0.0


@settings(derandomize=True, deadline=None)
@given(x=st.floats(-4.0, 4.0), yaw=radians, speed=st.floats(-0.2, 0.2), rate=st.floats(-0.5, 0.5))
def test_magnified_terms_are_shares_of_where_they_saturate(x, yaw, speed, rate):
    task = load_task("drift_go_to_pose")
    terms = seen(task, body(x, yaw=yaw, vx=speed, yaw_rate=rate), goal_at((0.0, 0.0, 0.0)))
    error = math.atan2(terms["sin_heading_error"], terms["cos_heading_error"])
    for magnified, value, saturation in (
        ("fine_heading_error", error, math.radians(task.fine_heading_deg)),
        ("fine_velocity_x_in_body", terms["velocity_x_in_body"], task.fine_speed),
        ("fine_velocity_y_in_body", terms["velocity_y_in_body"], task.fine_speed),
        ("fine_yaw_rate", terms["yaw_rate"], task.fine_yaw_rate),
    ):
        assert terms[magnified] == pytest.approx(max(-1.0, min(1.0, value / saturation)), abs=1e-6)


def test_a_magnified_term_that_could_not_saturate_is_refused():
    with pytest.raises(ValueError, match="must not be negative"):
        replace(POSE, fine_speed=-0.1)


def test_spinning_costs_in_the_position_task():
    goal = goal_at((0.0, 0.0, 0.0))
    loss = POSITION.reward(body(), body(), goal, goal) - POSITION.reward(
        body(), body(yaw_rate=-2.0), goal, goal
    )
    assert float(loss) == pytest.approx(2.0 * POSITION.reward_weights.spin, abs=1e-12)


@pytest.mark.parametrize("span", [(2.0, 1.0), (-1.0, 1.0)])
def test_empty_start_distances_are_refused(span):
    with pytest.raises(ValueError, match="distances must be"):
        Start(span, (0.0, 1.0), 0.0)
    with pytest.raises(ValueError, match="distances must be"):
        Start((0.0, 1.0), span, 0.0)


def test_a_negative_goal_area_and_an_empty_tolerance_are_refused():
    with pytest.raises(ValueError, match="'goal_area'"):
        replace(POSE.start, goal_area=-1.0)
    with pytest.raises(ValueError, match="must be greater than 0"):
        Tolerance()
    with pytest.raises(ValueError, match="must not be negative"):
        Tolerance(position=0.1, hold_s=-1.0)


def test_an_unknown_task_gets_the_nearest_name():
    with pytest.raises(UnknownNameError, match="Did you mean 'go_to_pose'"):
        load_task("go_to_pos")


def test_a_task_whose_file_is_called_otherwise_is_refused(tmp_path, monkeypatch):
    for family in ("robots", "tasks"):
        (tmp_path / family).mkdir()
    text = (config_directory() / "tasks" / "go_to_pose.yaml").read_text()
    (tmp_path / "tasks" / "other.yaml").write_text(text)
    monkeypatch.setenv("FULMAR_CONFIGS", str(tmp_path))
    with pytest.raises(ConfigError, match="'name' is 'go_to_pose', the file's own name is 'other'"):
        load_task("other")
