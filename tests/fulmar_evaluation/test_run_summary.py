"""A run's figures are true, ready for JSON, and there also for runs that went wrong."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from fulmar_bags.run_record import Motion, Places, read_run
from fulmar_bags.writer import BagWriter
from fulmar_core.config.errors import BagError
from fulmar_core.states.rotation import yaw_of
from fulmar_core.tasks import load_task
from fulmar_evaluation.run_evaluation import _goals, evaluate_run
from fulmar_evaluation.run_summary import latencies_ms, summarise, summary_text
from tests.synthetic_run import Plan, write_run


def pick(motion: Motion, index: object) -> Motion:
    names = [field.name for field in dataclasses.fields(motion)]
    return Motion(**{name: getattr(motion, name)[index] for name in names})


def test_a_run_that_reached_its_goal_says_so(reached):
    record = read_run(reached)
    summary = summarise(record)
    end = record.truth.position[-1]
    assert summary["success"] is True
    assert summary["final_position_error_m"] == pytest.approx(float(np.hypot(end[0], end[1])))
    degrees = abs(np.rad2deg(yaw_of(record.truth.quat_xyzw[-1])))
    assert summary["final_heading_error_deg"] == pytest.approx(float(degrees))
    assert summary["duration_s"] == pytest.approx(40.0)
    assert summary["steps"] == 201
    assert 4.0 < summary["time_to_target_s"] < 15.0
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary


def test_time_to_goal_and_length_of_the_run_differ(reached, silenced):
    summary = summarise(read_run(reached))
    line = summary_text(summary).splitlines()[0]
    assert line.startswith(f"lqr: goal met after {summary['time_to_target_s']:.1f} s, ")
    assert line.endswith("; length of the run 40 s")
    missed = summary_text(summarise(read_run(silenced))).splitlines()[0]
    assert missed.startswith("lqr: goal missed, ")
    assert missed.endswith("; length of the run 15 s")


def test_times_count_from_the_first_state_as_they_do_for_steps_in_metrics(reached):
    record = read_run(reached)
    position = np.hypot(*record.truth.position[:, :2].T)
    heading = np.abs(np.rad2deg(yaw_of(record.truth.quat_xyzw)))
    outside = np.flatnonzero((position > 0.1) | (heading > 10.0))
    result = evaluate_run(record)
    assert result.figure("time_to_target_s") == pytest.approx(0.02 * (outside[-1] + 1), abs=1e-6)
    assert result.time_s[[0, -1]] == pytest.approx([0.02, 40.0])
    assert result.duration_s == pytest.approx(40.0)
    np.testing.assert_allclose(result.run.position_error[0], position[1:], rtol=1e-6)
    np.testing.assert_allclose(result.run.actuators_in_use[0], record.applied.effort[:-1].mean(axis=1))


def test_a_run_of_exactly_the_window_is_long_enough_whatever_its_stamps_round_to(reached):
    record = read_run(reached)
    stamps = record.truth.stamp_s
    at_goal = range(1000, 1800)
    firsts = [first for first in at_goal if stamps[first + 200] - stamps[first] < 4.0]
    assert firsts, "some differences of stamps round to less than 4 s"
    window = slice(firsts[0], firsts[0] + 201)
    assert evaluate_run(dataclasses.replace(record, truth=pick(record.truth, window))).success
    shorter = slice(firsts[0], firsts[0] + 200)
    assert not evaluate_run(dataclasses.replace(record, truth=pick(record.truth, shorter))).success


def before_the_start(record, count):
    """The record with commands that answer nothing, as a controller sends them before the plant starts."""
    first = record.commanded
    times = np.concatenate((first.log_s[0] - 10.0 * np.arange(count, 0, -1), first.log_s))
    early = {
        "stamp_s": np.concatenate((np.zeros(count), first.stamp_s)),
        "log_s": times,
        "publish_s": times,
        "effort": np.concatenate((np.zeros((count, 8)), first.effort)),
    }
    return dataclasses.replace(record, commanded=dataclasses.replace(first, **early))


def test_commands_from_before_the_start_are_no_steps_and_no_rate(reached):
    record = dataclasses.replace(before_the_start(read_run(reached), 4), health=())
    summary = summarise(record)
    assert summary["steps"] == 201
    assert summary["wall_control_rate_hz"] == pytest.approx(5.0, rel=1e-3)


def test_the_control_rate_is_that_of_the_robot_s_own_time(reached):
    record = read_run(reached)

    def rates(**info):
        summary = summarise(dataclasses.replace(record, info={**record.info, **info}))
        return summary["control_rate_hz"], summary["wall_control_rate_hz"]

    assert rates(rate=4.0) == (pytest.approx(5.0002 / 4.0), 5.0002)
    assert rates(lockstep=True, control_hz=10.0) == (10.0, 5.0002)


def test_figures_of_the_nodes_are_taken_over(reached):
    summary = summarise(read_run(reached))
    assert summary["control_rate_hz"] == summary["wall_control_rate_hz"] == 5.0002
    assert summary["inference_ms"] == {"p50": 0.1, "p99": 0.3, "max": 0.9}
    assert summary["period_error_ms"] == {"p50": 0.05, "p99": 0.4, "max": 1.2}
    assert summary["overruns"] == 3
    assert summary["watchdog_trips"] == 0


def test_latency_comes_from_the_bag_where_the_plant_does_not_state_it(reached):
    latency = summarise(read_run(reached))["latency_ms"]
    assert 1.5 < latency["p50"] < latency["p99"] <= latency["max"] < 6.0


def test_latency_does_not_count_how_late_the_recorder_received_a_command(reached):
    record = dataclasses.replace(read_run(reached), health=())
    late = dataclasses.replace(record.commanded, log_s=record.commanded.log_s + 0.5)
    record = dataclasses.replace(record, commanded=late)
    assert summarise(record)["latency_ms"]["max"] < 6.0
    sent_later = dataclasses.replace(late, publish_s=late.publish_s + 0.001)
    before, after = (latencies_ms(dataclasses.replace(record, commanded=each)) for each in (late, sent_later))
    np.testing.assert_allclose(after, before + 1.0, atol=1e-3)


def test_latency_of_the_plant_counts_where_it_states_it(reached):
    record = read_run(reached)
    plant = record.last_health("plant")
    reported = {"latency_ms_p50": "1.0", "latency_ms_p99": "2.0", "latency_ms_max": "3.0"}
    newer = dataclasses.replace(plant, values={**plant.values, **reported})
    summary = summarise(dataclasses.replace(record, health=(*record.health, newer)))
    assert summary["latency_ms"] == {"p50": 1.0, "p99": 2.0, "max": 3.0}


def test_a_silent_controller_shows_as_a_trip_and_a_miss(silenced):
    summary = summarise(read_run(silenced))
    assert summary["watchdog_trips"] == 1
    assert summary["success"] is False


def test_a_run_shorter_than_the_window_is_no_success(tmp_path):
    at_goal = Plan(duration_s=3.0, start=(0.0, 0.0, 0.0))
    summary = summarise(read_run(write_run(tmp_path / "bag", at_goal)))
    assert summary["final_position_error_m"] < 0.1
    assert summary["success"] is False


def test_leaving_the_tolerance_once_in_the_window_is_no_success(reached):
    record = read_run(reached)
    assert evaluate_run(record).success
    position = record.truth.position.copy()
    position[-100, 0] += 0.15
    assert not evaluate_run(
        dataclasses.replace(record, truth=dataclasses.replace(record.truth, position=position))
    ).success


def test_lost_samples_do_not_shift_the_window(reached):
    record = read_run(reached)
    kept = np.ones(len(record.truth), dtype=bool)
    kept[-150::3] = False
    fields = {
        field.name: getattr(record.truth, field.name)[kept] for field in dataclasses.fields(record.truth)
    }
    thinned = evaluate_run(dataclasses.replace(record, truth=type(record.truth)(**fields)))
    assert thinned.duration_s == pytest.approx(40.0)
    assert thinned.run.control_dt == pytest.approx(0.02)
    assert thinned.success


def test_a_robot_without_truth_is_evaluated_by_its_odometry(reached):
    record = read_run(reached)
    nothing = type(record.truth)(
        **{f.name: getattr(record.truth, f.name)[:0] for f in dataclasses.fields(record.truth)}
    )
    assert summarise(dataclasses.replace(record, truth=nothing))["success"] is True


def test_a_goal_that_is_no_number_is_a_miss_with_unknown_errors(reached):
    record = read_run(reached)
    broken = dataclasses.replace(record, goals=(), info={**record.info, "goal": [float("nan"), 0.0, 0.0]})
    summary = summarise(broken)
    assert summary["success"] is False
    assert summary["final_position_error_m"] is None


def test_a_run_that_recorded_nothing_has_a_summary_of_unknowns(tmp_path):
    BagWriter(tmp_path / "bag", run_info={"robot": "floating_platform", "task": "go_to_pose"}).close()
    summary = summarise(read_run(tmp_path / "bag"))
    assert summary["success"] is False
    assert summary["steps"] == 0
    assert summary["final_position_error_m"] is None
    assert summary["latency_ms"] == {"p50": None, "p99": None, "max": None}
    assert summary["watchdog_trips"] is None


def test_a_record_without_a_task_or_a_goal_is_refused(reached):
    record = read_run(reached)
    with pytest.raises(BagError, match="names no task"):
        summarise(dataclasses.replace(record, info={}))
    with pytest.raises(BagError, match="holds no goal"):
        summarise(dataclasses.replace(record, goals=(), info={"task": "go_to_pose"}))
    with pytest.raises(BagError, match="names no robot"):
        summarise(dataclasses.replace(record, info={"task": "go_to_pose"}))


DRIVEN = {"controller": "classical", "control_hz": 10.0, "start": None, "goal": None, "weights": None}
NEW = ("goals_reached", "velocity_error_m_s", "yaw_rate_error_deg_s")


def summary_of(folder, robot, task, **changes):
    plan = Plan(**{**DRIVEN, "robot": robot, "task": task, "duration_s": 30.0, **changes})
    return summarise(read_run(write_run(folder / "bag", plan)))


def test_waypoints_are_counted_by_the_tolerance_of_the_task(tmp_path):
    summary = summary_of(tmp_path, "turtlebot2", "go_through_positions", duration_s=60.0)
    assert summary["goals_reached"] >= 3.0
    assert summary["success"] is (summary["goals_reached"] >= 5.0)
    assert summary["final_position_error_m"] is None
    assert summary["time_to_target_s"] is None


def test_gates_are_counted_from_the_robot_s_own_way(tmp_path):
    plan = Plan(**{**DRIVEN, "robot": "turtlebot2", "task": "race_waypoints"}, duration_s=60.0)
    record = read_run(write_run(tmp_path / "bag", plan))
    as_gates = dataclasses.replace(record, info={**record.info, "task": "race_gates"})
    assert evaluate_run(as_gates).figure("goals_reached") >= 1.0


def test_a_goal_that_is_repeated_with_its_stamp_is_the_same_goal(reached):
    record = read_run(reached)
    again = dataclasses.replace(record.goals[0], stamp_s=5.0)
    later = dataclasses.replace(again, log_s=again.log_s + 20.0)
    once = dataclasses.replace(record, goals=(again, later))
    task = load_task("go_to_pose")
    assert len(_goals(once, task)) == 1
    anew = dataclasses.replace(record, goals=(again, dataclasses.replace(later, stamp_s=6.0)))
    assert len(_goals(anew, task)) == 2


def test_a_velocity_is_evaluated_against_the_target_of_its_time(tmp_path):
    plan = Plan(**{**DRIVEN, "robot": "turtlebot2", "task": "track_velocities"}, duration_s=30.0)
    record = read_run(write_run(tmp_path / "bag", plan))
    assert [goal.targets.shape for goal in record.goals] == [(1, 6)] * 3
    result, summary = evaluate_run(record), summarise(record)
    assert result.run.goals[0, [0, -1]].tolist() == [0.0, 2.0]
    assert 0.0 < summary["velocity_error_m_s"] < 0.2
    assert 0.0 < summary["yaw_rate_error_deg_s"] < 20.0
    assert summary["final_position_error_m"] is summary["final_heading_error_deg"] is None


def test_obstacles_of_the_bag_count_as_touched(tmp_path):
    plan = Plan(**{**DRIVEN, "robot": "turtlebot2", "task": "go_to_position_with_obstacles"}, duration_s=20.0)
    record = read_run(write_run(tmp_path / "bag", plan))
    assert record.obstacles.shape[1] == 3
    assert len(record.obstacles) > 0
    assert summarise(record)["collided"] is False
    x, y = record.truth.position[500, :2]
    there = np.concatenate((record.obstacles, [[x, y, 0.2]]))
    assert summarise(dataclasses.replace(record, obstacles=there))["collided"] is True


def test_of_a_block_its_own_place_counts_and_not_the_robot_s(tmp_path):
    plan = Plan(**{**DRIVEN, "robot": "floating_platform", "task": "go_to_position"}, duration_s=5.0)
    record = read_run(write_run(tmp_path / "bag", plan))
    stamps = record.truth.stamp_s
    x, y = record.goals[0].targets[0, :2]
    block = Places(stamps, np.tile([x + 0.03, y + 0.04, 0.0, 0.0, 0.0, 0.0, 1.0], (len(stamps), 1)))
    info = {**record.info, "task": "push_block"}
    summary = summarise(dataclasses.replace(record, info=info, things={"block": block}))
    assert summary["final_position_error_m"] == pytest.approx(0.05, abs=1e-6)
    assert summary["success"] is True


def test_what_a_task_does_not_ask_is_none(reached):
    summary = summarise(read_run(reached))
    assert [summary[name] for name in NEW] == [None] * 3
    assert summary["collided"] is False


def test_a_run_on_hardware_is_evaluated_from_its_first_actuation_on_for_as_long_as_was_asked(reached):
    """A robot is measured before and after its run, too: what it did then is nobody's success or failure."""
    record = read_run(reached)
    applied, first = record.applied, 250
    later = dataclasses.replace(
        applied,
        stamp_s=applied.stamp_s[first:],
        log_s=applied.log_s[first:],
        publish_s=applied.publish_s[first:],
        effort=applied.effort[first:],
    )
    info = {**record.info, "backend": "hardware", "duration_s": 20.0}
    motion = dataclasses.replace(record, info=info, applied=later).motion
    assert motion.stamp_s[0] == pytest.approx(later.stamp_s[0], abs=0.03)
    assert motion.stamp_s[-1] - motion.stamp_s[0] == pytest.approx(20.0, abs=0.03)
    assert len(dataclasses.replace(record, applied=later).motion) == len(record.truth)
