"""Tasks: what a controller sees, and what it is rewarded for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fulmar_core.errors import ConfigError, UnknownNameError
from fulmar_core.paths import config_directory
from fulmar_core.state import planar_pose, planar_state
from fulmar_core.tasks import load_task
from fulmar_core.tasks.planar import Start, Tolerance, fine_terms, planar_error

POSE, POSITION = load_task("go_to_pose"), load_task("go_to_position")
BOTH = pytest.mark.parametrize("task", [POSE, POSITION], ids=lambda task: task.name)
metres, radians = st.floats(-5, 5), st.floats(-3.1, 3.1)


def column(task, state, goal, name):
    return task.observe(state, goal)[..., task.observation_names.index(name)]


@BOTH
@settings(derandomize=True, deadline=None)
@given(
    x=metres, y=metres, yaw=radians, gx=metres, gy=metres, gyaw=radians, dx=metres, dy=metres, turn=radians
)
def test_moving_and_turning_the_whole_world_changes_no_observation(
    task, x, y, yaw, gx, gy, gyaw, dx, dy, turn
):
    def seen(turn, dx, dy):
        c, s = np.cos(turn), np.sin(turn)
        state = planar_state(
            c * x - s * y + dx, s * x + c * y + dy, yaw + turn,
            vx=c * 0.3 - s * 0.1, vy=s * 0.3 + c * 0.1, yaw_rate=0.2,
        )  # fmt: skip
        return task.observe(state, planar_pose(c * gx - s * gy + dx, s * gx + c * gy + dy, gyaw + turn))

    # The fine terms divide by 0.3 m what rounds at 1e-15 for metres.
    np.testing.assert_allclose(seen(turn, dx, dy), seen(0.0, 0.0, 0.0), rtol=0, atol=1e-12)


@BOTH
def test_each_name_is_one_column_and_no_name_comes_twice(task):
    assert task.observe(planar_state(0.0, 0.0, 0.0), planar_pose(1.0, 0.0, 0.0)).shape == (
        len(task.observation_names),
    )
    assert len(set(task.observation_names)) == len(task.observation_names)


@BOTH
def test_names_tell_what_is_in_the_columns(task):
    state = planar_state(1.0, 1.0, np.pi / 2, vx=0.3, vy=-0.2, yaw_rate=0.7)
    seen = dict(zip(task.observation_names, task.observe(state, planar_pose(1.0, 3.0, np.pi)), strict=True))
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
    assert seen == pytest.approx({name: expected[name] for name in task.observation_names}, abs=1e-12)


def test_the_fine_terms_magnify_near_the_goal_and_saturate_far_from_it():
    near = fine_terms(np.array([0.03, -0.06]), saturation=0.3)
    np.testing.assert_allclose(near[:2], [0.1, -0.2], rtol=0, atol=1e-15)
    far = fine_terms(np.array([3.0, 4.0]), saturation=0.3)
    np.testing.assert_allclose(far, [0.6, 0.8, 5.0], rtol=0, atol=1e-15)


def test_the_fine_terms_are_finite_at_the_goal_itself():
    assert fine_terms(np.zeros(2), saturation=0.3).tolist() == [0.0, 0.0, 0.0]


def test_a_position_task_does_not_see_the_heading_of_the_goal():
    state = planar_state(0.0, 0.0, 0.0)
    seen = [POSITION.observe(state, planar_pose(1.0, 2.0, yaw)).tolist() for yaw in (0.0, 2.0)]
    assert seen[0] == seen[1]


def test_a_pose_task_does_see_it():
    state = planar_state(0.0, 0.0, 0.0)
    seen = [POSE.observe(state, planar_pose(1.0, 2.0, yaw)).tolist() for yaw in (0.0, 2.0)]
    assert seen[0] != seen[1]


def test_heading_errors_go_the_short_way_around():
    error = planar_error(planar_state(0.0, 0.0, np.deg2rad(170)), planar_pose(3.0, 4.0, np.deg2rad(-170)))
    assert error.position == pytest.approx(5.0, abs=1e-12)
    assert np.rad2deg(error.heading) == pytest.approx(20.0, abs=1e-9)


@BOTH
def test_coming_nearer_is_worth_more_than_going_away(task):
    start, goal = planar_state(1.0, 0.0, 0.3), planar_pose(0.0, 0.0, 0.3)
    near, far = planar_state(0.9, 0.0, 0.3), planar_state(1.1, 0.0, 0.3)
    assert task.reward(start, near, goal, np.zeros(8)) > task.reward(start, far, goal, np.zeros(8))


@BOTH
def test_each_open_valve_costs_its_weight(task):
    state, goal = planar_state(1.0, 0.0, 0.3), planar_pose(0.0, 0.0, 0.0)
    closed, three = (task.reward(state, state, goal, np.array([1.0] * n + [0.0] * (8 - n))) for n in (0, 3))
    assert closed - three == pytest.approx(3 * task.reward_weights.open_valve, abs=1e-12)


def test_resting_at_the_goal_earns_every_standing_term_in_full():
    at_goal, goal = planar_state(0.0, 0.0, 0.0), planar_pose(0.0, 0.0, 0.0)
    w = POSE.reward_weights
    assert POSE.reward(at_goal, at_goal, goal, np.zeros(8)) == pytest.approx(
        w.position + w.heading + w.far + w.joint + w.facing, abs=1e-12
    )
    v = POSITION.reward_weights
    assert POSITION.reward(at_goal, at_goal, goal, np.zeros(8)) == pytest.approx(
        v.position + v.far + v.near, abs=1e-12
    )


def test_turning_to_the_goal_s_heading_pays_in_the_pose_task_alone():
    start, goal = planar_state(0.5, 0.0, 0.5), planar_pose(0.0, 0.0, 0.0)
    turned = planar_state(0.5, 0.0, 0.3)
    gain = [
        task.reward(start, turned, goal, np.zeros(8)) - task.reward(start, start, goal, np.zeros(8))
        for task in (POSE, POSITION)
    ]
    assert gain[0] > 0.1
    assert gain[1] == 0.0


def test_spinning_costs_in_the_position_task():
    goal = planar_pose(0.0, 0.0, 0.0)
    rest, spin = planar_state(0.0, 0.0, 0.0), planar_state(0.0, 0.0, 0.0, yaw_rate=-2.0)
    loss = POSITION.reward(rest, rest, goal, np.zeros(8)) - POSITION.reward(rest, spin, goal, np.zeros(8))
    assert loss == pytest.approx(2.0 * POSITION.reward_weights.spin, abs=1e-12)


@BOTH
def test_torch_sees_and_rewards_what_numpy_does(task):
    torch = pytest.importorskip("torch")
    rng = np.random.default_rng(4)
    state = planar_state(*rng.normal(size=(3, 10)), vx=rng.normal(size=10), yaw_rate=rng.normal(size=10))
    goal, command = planar_pose(*rng.normal(size=(3, 10))), (rng.uniform(size=(10, 8)) > 0.5).astype(float)

    def to_torch(value):
        return type(value)(*(torch.as_tensor(getattr(value, name)) for name in value.__slots__))

    seen = task.observe(to_torch(state), to_torch(goal))
    np.testing.assert_allclose(seen.numpy(), task.observe(state, goal), rtol=0, atol=1e-12)
    reward = task.reward(to_torch(state), to_torch(state), to_torch(goal), torch.as_tensor(command))
    np.testing.assert_allclose(reward.numpy(), task.reward(state, state, goal, command), rtol=0, atol=1e-12)


@pytest.mark.parametrize("span", [(2.0, 1.0), (-1.0, 1.0)])
def test_empty_start_distances_are_refused(span):
    with pytest.raises(ValueError, match="distances must be"):
        Start(span, (0.0, 1.0), 0.0)
    with pytest.raises(ValueError, match="distances must be"):
        Start((0.0, 1.0), span, 0.0)


def test_a_negative_goal_area_and_an_empty_tolerance_are_refused():
    with pytest.raises(ValueError, match="'goal_area'"):
        replace(POSE.start, goal_area=-1.0)
    for name in ("position", "heading_deg", "hold_s"):
        with pytest.raises(ValueError, match="must be greater than 0"):
            Tolerance(**{"position": 1.0, "heading_deg": 1.0, "hold_s": 1.0, name: 0.0})


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
