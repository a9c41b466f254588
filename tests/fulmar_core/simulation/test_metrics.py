"""Figures of hand-made trajectories."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episodes
from fulmar_core.simulation.metrics import (
    TargetCounter,
    Trajectories,
    TrajectoryLog,
    episode_metrics,
    first_steps,
    join,
    successes,
    summary,
)
from fulmar_core.simulation.trajectories import BESIDE, COLUMNS, IN_SPACE, OF_FUEL
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_at, stack_goals
from fulmar_core.worlds.scenario import load_scenario
from fulmar_evaluation.figures import FIGURES
from tests.spaces import robot_for

POSE, POSITION = load_task("go_to_pose"), load_task("go_to_position")
VELOCITIES, WAYPOINTS = load_task("track_velocities"), load_task("go_through_positions")
AROUND = load_task("go_to_position_with_obstacles")
PLATFORM = load_robot("floating_platform")
DT = 0.2
STEPS = 50
WINDOW = 20  # 4 s
NAN = float("nan")


def rows(value):
    return np.broadcast_to(np.atleast_2d(np.asarray(value, dtype=float)), (1, STEPS)).copy()


def trajectories(position=0.0, degrees=0.0, shares=0.0, **others) -> Trajectories:
    """One episode of 10 s; what is not named is zero, or NaN where the tasks of poses do not ask."""
    columns = {name: rows(others.get(name, 0.0)) for name in ("x", "y", "yaw", "speed", "yaw_rate", "goals")}
    errors = {name: rows(others.get(name, NAN)) for name in ("velocity_error", "yaw_rate_error")}
    events = {name: rows(others.get(name, 0.0)) != 0.0 for name in ("touching", "outside")}
    return Trajectories(
        **columns,
        **errors,
        **events,
        position_error=rows(position),
        heading_error=np.deg2rad(rows(degrees)),
        shares=np.broadcast_to(np.asarray(shares, dtype=float), (1, STEPS, 2)),
        control_dt=DT,
    )


def tracking(velocity=0.0, degrees_s=0.0, goals=0.0) -> Trajectories:
    return trajectories(NAN, NAN, velocity_error=velocity, yaw_rate_error=np.deg2rad(degrees_s), goals=goals)


def first(n, high, low):
    """`high` for n steps, then `low`."""
    return np.where(np.arange(STEPS) < n, high, low)


def figure(run, name, task=POSE):
    return episode_metrics(run, task)[name][0]


@pytest.mark.parametrize(("limit", "share"), [(5, 80.0), (2, 50.0), (1, 20.0)])
def test_pt_is_the_share_of_steps_within_so_many_centimetres(limit, share):
    position = np.concatenate((np.full(10, 0.06), np.full(15, 0.03), np.full(15, 0.015), np.full(10, 0.005)))
    assert figure(trajectories(position), f"PT{limit}_percent") == pytest.approx(share)


@pytest.mark.parametrize(("limit", "share"), [(5, 80.0), (2, 50.0), (1, 20.0)])
def test_ot_is_the_share_of_steps_within_so_many_degrees_either_way(limit, share):
    degrees = np.concatenate((np.full(10, 6.0), np.full(15, -3.0), np.full(15, 1.5), np.full(10, -0.5)))
    assert figure(trajectories(degrees=degrees), f"OT{limit}_percent") == pytest.approx(share)


def test_alv_aav_and_aas_are_means_of_speed_turn_rate_and_use():
    shares = np.stack((first(10, -0.3, 0.0), np.zeros(STEPS)), axis=-1)
    run = trajectories(speed=first(25, 0.2, 0.1), yaw_rate=first(25, -0.4, 0.2), shares=shares)
    assert figure(run, "ALV_m_s") == pytest.approx(0.15)
    assert figure(run, "AAV_rad_s") == pytest.approx(0.3)
    assert figure(run, "AAS") == pytest.approx(0.1)


def test_final_errors_are_those_of_the_last_step():
    run = trajectories(first(STEPS - 1, 3.0, 0.25), first(STEPS - 1, 90.0, -7.0))
    assert figure(run, "final_position_error_m") == 0.25
    assert figure(run, "final_heading_error_deg") == pytest.approx(7.0)


@pytest.mark.parametrize(("outside", "success"), [(STEPS - WINDOW, True), (STEPS - WINDOW + 1, False)])
def test_success_is_the_whole_closing_window_inside_and_nothing_before_it(outside, success):
    assert successes(trajectories(first(outside, 1.0, 0.09)), POSE).tolist() == [success]
    assert successes(trajectories(0.0, first(outside, 90.0, 9.9)), POSE).tolist() == [success]


def test_one_step_outside_in_the_window_is_no_success():
    position = np.zeros(STEPS)
    position[-WINDOW // 2] = 0.101
    assert not successes(trajectories(position), POSE)[0]


def test_heading_counts_for_the_pose_task_alone():
    backwards = trajectories(0.01, 180.0)
    assert not successes(backwards, POSE)[0]
    assert successes(backwards, POSITION)[0]


def test_a_window_longer_than_the_run_is_the_whole_run():
    patient = replace(POSE, tolerance=replace(POSE.tolerance, hold_s=1000.0))
    assert successes(trajectories(0.01), patient)[0]
    assert not successes(trajectories(first(1, 1.0, 0.0)), patient)[0]


def test_time_to_target_is_when_it_comes_in_for_the_last_time():
    position = first(10, 1.0, 0.0)
    position[30] = 1.0  # out again, so only step 31 counts
    assert figure(trajectories(position), "time_to_target_s") == pytest.approx(32 * DT)
    assert figure(trajectories(first(10, 1.0, 0.0)), "time_to_target_s") == pytest.approx(11 * DT)
    assert figure(trajectories(0.0), "time_to_target_s") == pytest.approx(DT)


def test_a_target_that_is_never_held_has_no_time_and_is_none_in_the_summary():
    assert np.isnan(figure(trajectories(1.0), "time_to_target_s"))
    statistics = summary(trajectories(1.0), POSE)
    assert statistics["time_to_target_s"] == {"mean": None, "median": None, "p95": None}
    assert statistics["success_rate"] == 0.0


def test_episodes_without_a_time_do_not_spoil_the_others():
    run = join([trajectories(1.0), trajectories(first(10, 1.0, 0.0)), trajectories(first(20, 1.0, 0.0))])
    assert summary(run, POSE)["time_to_target_s"]["mean"] == pytest.approx(16 * DT)
    assert summary(run, POSE)["success_rate"] == pytest.approx(2 / 3)


def test_the_summary_has_mean_median_and_p95_of_every_figure_and_is_strict_json():
    run = join([trajectories(d) for d in (0.1, 0.2, 0.6)])
    statistics = summary(run, POSE)
    assert statistics["episodes"] == 3
    assert statistics["final_position_error_m"] == pytest.approx({"mean": 0.3, "median": 0.2, "p95": 0.56})
    assert set(statistics) == {"episodes", "success_rate", *episode_metrics(run, POSE)}
    json.dumps(statistics, allow_nan=False)


def test_touching_anything_once_is_no_success_however_it_ends():
    touched = np.zeros(STEPS)
    touched[3] = 1.0
    run = trajectories(0.01, NAN, touching=touched)
    assert not successes(run, AROUND)[0]
    assert figure(run, "collided", AROUND) == 1.0
    assert successes(trajectories(0.01, NAN), AROUND)[0]


def test_where_targets_are_counted_success_is_having_reached_enough_of_them():
    enough = trajectories(2.0, NAN, goals=first(30, 0.0, WAYPOINTS.required))
    too_few = trajectories(0.0, NAN, goals=WAYPOINTS.required - 1)
    assert successes(join([enough, too_few]), WAYPOINTS).tolist() == [True, False]
    assert figure(enough, "goals_reached", WAYPOINTS) == WAYPOINTS.required
    assert figure(enough, "time_to_first_goal_s", WAYPOINTS) == pytest.approx(31 * DT)
    assert "final_position_error_m" not in episode_metrics(enough, WAYPOINTS)


def test_first_inside_does_not_mind_going_out_again():
    position = first(10, 1.0, 0.0)
    position[30] = 1.0
    assert figure(trajectories(position), "first_inside_s") == pytest.approx(11 * DT)
    assert np.isnan(figure(trajectories(1.0), "first_inside_s"))


def test_velocity_errors_are_means_over_the_whole_episode():
    run = tracking(first(25, 0.4, 0.0), first(25, -20.0, 0.0))
    assert figure(run, "velocity_error_m_s", VELOCITIES) == pytest.approx(0.2)
    assert figure(run, "yaw_rate_error_deg_s", VELOCITIES) == pytest.approx(10.0)
    assert "time_to_target_s" not in episode_metrics(run, VELOCITIES)


def test_settling_is_timed_for_each_target_and_a_target_never_held_counts_whole():
    goals = np.where(np.arange(STEPS) < 25, 0.0, 1.0)
    error = np.zeros(STEPS)
    error[[0, 1, 2, 3, 25, 49]] = 1.0  # the first is held from its fifth step on, the second is not
    run = tracking(error, goals=goals)
    assert figure(run, "settling_time_s", VELOCITIES) == pytest.approx(0.5 * (4 + 25) * DT)
    assert figure(run, "targets_held_percent", VELOCITIES) == 50.0


def test_a_target_that_has_no_time_for_the_window_does_not_count():
    goals = np.where(np.arange(STEPS) < STEPS - WINDOW + 1, 0.0, 1.0)
    run = tracking(first(10, 1.0, 0.0), goals=goals)
    assert figure(run, "settling_time_s", VELOCITIES) == pytest.approx(10 * DT)
    assert figure(run, "targets_held_percent", VELOCITIES) == 100.0


def test_settling_of_many_episodes_is_that_of_each():
    rng = np.random.default_rng(1)
    runs = [
        tracking(rng.uniform(0.0, 0.25, STEPS).cumsum() % 0.21, goals=np.arange(STEPS) // length)
        for length in (10, 20, 24, 25)
    ]
    together = episode_metrics(join(runs), VELOCITIES)
    for name in ("settling_time_s", "targets_held_percent"):
        np.testing.assert_array_equal(together[name], [figure(run, name, VELOCITIES) for run in runs])


def test_control_variation_sums_changes_over_actuators_and_deviation_is_their_spread():
    shares = np.zeros((STEPS, 2))
    shares[::2, 0], shares[:, 1] = 1.0, 0.5
    run = trajectories(shares=shares)
    assert figure(run, "control_variation") == pytest.approx((STEPS + 0.5) / STEPS)
    assert figure(run, "control_deviation") == pytest.approx(0.25), "0.5 and 0, on average"


def test_success_by_the_words_of_the_thesis_looks_at_the_last_step_or_at_means():
    late = trajectories(first(STEPS - 1, 1.0, 0.0))
    assert figure(late, "thesis_success") == 1.0
    assert not successes(late, POSE)[0]
    assert figure(tracking(first(25, 0.38, 0.0)), "thesis_success", VELOCITIES) == 1.0
    assert figure(tracking(first(25, 0.42, 0.0)), "thesis_success", VELOCITIES) == 0.0
    assert figure(trajectories(1.0, NAN, goals=1.0), "thesis_success", WAYPOINTS) == 1.0


def test_the_beginning_of_episodes_is_evaluated_like_episodes():
    run = trajectories(first(10, 1.0, 0.0), goals=np.arange(STEPS) // 5, shares=1.0)
    cut = first_steps(run, 10)
    assert cut.shares.shape == (1, 10, 2)
    assert figure(cut, "goals_reached", WAYPOINTS) == 1.0
    assert np.isnan(figure(cut, "time_to_target_s"))


@pytest.mark.parametrize("task", [POSE, POSITION, VELOCITIES, WAYPOINTS, AROUND], ids=lambda task: task.name)
def test_every_figure_has_its_meaning_written_down(task):
    run = tracking() if task is VELOCITIES else trajectories(0.0, 0.0 if task is POSE else NAN)
    assert set(episode_metrics(run, task)) <= set(FIGURES)


def states(x, y, yaw, *, vx=0.0, vy=0.0, yaw_rate=0.0) -> PlanarState:
    return PlanarState(
        *(
            np.full(2, value) if np.ndim(value) == 0 else np.array(value)
            for value in (x, y, yaw, vx, vy, yaw_rate)
        )
    )


def test_the_log_notes_errors_motion_and_shares_of_each_step():
    log = TrajectoryLog(PLATFORM, POSE, DT)
    goal = stack_goals([goal_at((0.0, 0.0, 0.0))] * 2)
    log.add(states([3.0, 1.0], [4.0, 0.0], [0.5, -0.5], vx=0.6, vy=0.8), goal, np.zeros((2, 8)))
    log.add(states(0.0, 0.0, 0.0, yaw_rate=-0.2), goal, np.array([[1.0] * 4 + [0.0] * 4] * 2))
    run = log.trajectories()
    np.testing.assert_allclose(run.position_error, [[5.0, 0.0], [1.0, 0.0]], atol=1e-6)
    np.testing.assert_allclose(run.heading_error, [[-0.5, 0.0], [0.5, 0.0]], atol=1e-6)
    np.testing.assert_allclose(run.speed, [[1.0, 0.0]] * 2, atol=1e-6)
    np.testing.assert_allclose(run.yaw_rate, [[0.0, -0.2]] * 2, atol=1e-6)
    np.testing.assert_allclose(run.actuators_in_use, [[0.0, 0.5]] * 2, atol=1e-6)
    np.testing.assert_allclose(run.variation, [[0.0, 4.0]] * 2, atol=1e-6)
    assert np.isnan(run.velocity_error).all()
    assert run.x.dtype == run.shares.dtype == np.float32


def test_the_log_of_one_episode_has_the_axis_of_episodes_too():
    log = TrajectoryLog(PLATFORM, POSITION, DT)
    log.add(states(9.0, 0.0, 0.0)[0], goal_at((0.0, 0.0, 0.0)), np.zeros(8))
    run = log.trajectories()
    assert (run.x.shape, run.shares.shape, run.outside.shape) == ((1, 1), (1, 1, 8), (1, 1))
    assert run.outside.tolist() == [[True]], "beyond the geofence of 8 m"


def test_waypoints_count_by_the_tolerance_and_not_by_the_radius_of_controllers():
    goal = goal_at((0.0, 0.0, 0.0), (3.0, 0.0, 0.0))
    counter = TargetCounter(WAYPOINTS, goal, DT)
    between = 0.5 * (WAYPOINTS.reach + WAYPOINTS.tolerance.position)
    state = states(between, 0.0, 0.0)[0]
    assert WAYPOINTS.advance(goal, state, np.asarray(0.0)).done == 0.0
    assert counter.update(state).done == 1.0


@pytest.mark.parametrize(
    "task",
    [POSE, WAYPOINTS, *map(load_task, ("go_to_pose_3d", "go_through_poses_3d"))],
    ids=lambda task: task.name,
)
def test_a_whole_episode_noted_at_once_is_what_its_steps_are(task):
    robot, kind = robot_for(task, PLATFORM), task.state_type
    drawn = draw_episodes(robot, task, load_scenario("nominal"), seed=5, numbers=np.arange(1))[0]
    rng = np.random.default_rng(5)
    truths = [kind(*np.cumsum(row)) for row in rng.normal(size=(12, len(kind.COLUMNS)))]
    commands = list(rng.integers(0, 2, (12, len(robot.actuators.names))).astype(float))
    counter = TargetCounter(task, drawn.goal, DT)
    goals = [counter.update(truth) for truth in truths]
    single, whole = (TrajectoryLog(robot, task, DT) for _ in range(2))
    for truth, goal, command in zip(truths, goals, commands, strict=True):
        single.add(truth, goal, command)
    whole.add_episode(truths, goals, commands)
    one, other = single.trajectories(), whole.trajectories()
    assert set(one.columns) == set(COLUMNS) - {*OF_FUEL, *BESIDE} - (
        set(IN_SPACE) if kind is PlanarState else set()
    )
    for name in one.columns:
        left, right = getattr(one, name), getattr(other, name)
        assert left.dtype == right.dtype
        np.testing.assert_array_equal(left, right, err_msg=name)
