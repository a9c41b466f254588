"""Figures of hand-made trajectories."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.metrics import Trajectories, TrajectoryLog, episode_metrics, join, successes, summary
from fulmar_core.state import planar_pose, planar_state
from fulmar_core.tasks import load_task

POSE, POSITION = load_task("go_to_pose"), load_task("go_to_position")
DT = 0.2
STEPS = 50
WINDOW = 20  # 4 s


def trajectories(position=0.0, degrees=0.0, **others) -> Trajectories:
    def rows(value):
        return np.broadcast_to(np.atleast_2d(np.asarray(value, dtype=float)), (1, STEPS)).copy()

    return Trajectories(
        rows(position),
        np.deg2rad(rows(degrees)),
        rows(others.get("speed", 0.0)),
        rows(others.get("yaw_rate", 0.0)),
        rows(others.get("in_use", 0.0)),
        control_dt=DT,
    )


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
    run = trajectories(speed=first(25, 0.2, 0.1), yaw_rate=first(25, -0.4, 0.2), in_use=first(10, 0.5, 0.0))
    assert figure(run, "ALV_m_s") == pytest.approx(0.15)
    assert figure(run, "AAV_rad_s") == pytest.approx(0.3)
    assert figure(run, "AAS") == pytest.approx(0.1)


def test_final_errors_are_those_of_the_last_step():
    run = trajectories(first(STEPS - 1, 3.0, 0.25), first(STEPS - 1, 90.0, -7.0))
    assert figure(run, "final_position_error_m") == 0.25
    assert figure(run, "final_heading_error_deg") == pytest.approx(7.0)


@pytest.mark.parametrize(("outside", "success"), [(STEPS - WINDOW, True), (STEPS - WINDOW + 1, False)])
def test_success_is_the_whole_closing_window_inside_and_nothing_before_it(outside, success):
    assert successes(trajectories(first(outside, 1.0, 0.04)), POSE).tolist() == [success]
    assert successes(trajectories(0.0, first(outside, 90.0, 4.9)), POSE).tolist() == [success]


def test_one_step_outside_in_the_window_is_no_success():
    position = np.zeros(STEPS)
    position[-WINDOW // 2] = 0.051
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


def test_the_log_notes_errors_speed_turn_rate_and_valves_of_each_step():
    log = TrajectoryLog(DT)
    goal = planar_pose(np.zeros(2), np.zeros(2), np.zeros(2))
    log.add(
        planar_state(np.array([3.0, 1.0]), np.array([4.0, 0.0]), np.array([0.5, -0.5]), vx=0.6, vy=0.8),
        goal,
        np.zeros((2, 8)),
    )
    log.add(
        planar_state(np.zeros(2), np.zeros(2), np.zeros(2), yaw_rate=-0.2),
        goal,
        np.array([[1.0] * 4 + [0.0] * 4] * 2),
    )
    run = log.trajectories()
    np.testing.assert_allclose(run.position_error, [[5.0, 0.0], [1.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(run.heading_error, [[-0.5, 0.0], [0.5, 0.0]], atol=1e-12)
    np.testing.assert_allclose(run.speed, [[1.0, 0.0]] * 2, atol=1e-12)
    np.testing.assert_allclose(run.yaw_rate, [[0.0, -0.2]] * 2, atol=1e-12)
    np.testing.assert_allclose(run.actuators_in_use, [[0.0, 0.5]] * 2, atol=1e-12)
