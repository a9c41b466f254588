"""The table of shipped policies: complete, and only what has to be made again is made."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from fulmar_core.loop.policy_bundle import PASSPORT, read_passport
from policy_server.controllers import policies_directory
from policy_server.policy import Policy
from training import policies
from training.jobs import Job, Outcome, run_job
from training.policies import (
    PolicyTable,
    ShippedPolicy,
    expected_s,
    is_made,
    load_policy_table,
    make_policies,
    policy_job,
    recipe,
    set_aside,
)
from training.settings import load_training_settings

FIVE = (
    "go_to_position",
    "go_to_pose",
    "track_velocities",
    "go_through_positions",
    "go_to_position_with_obstacles",
)
ONE = ShippedPolicy("floating_platform", "go_to_pose", seed=3, updates=2, success=0.9)


def test_the_table_names_every_policy_that_shall_ship():
    names = {policy.name for policy in load_policy_table().policies}
    wanted = {
        f"{robot}_{task}" for robot in ("floating_platform", "kingfisher", "turtlebot2") for task in FIVE
    }
    wanted |= {f"{robot}_go_to_position" for robot in ("modular_freeflyer", "jetbot", "leatherback")}
    wanted |= {"floating_platform_drift_go_to_pose", "floating_platform_drift_track_velocities"}
    positions, poses = "go_to_position_3d", "go_to_pose_3d"
    wanted |= {f"int_ball2_{task}" for task in (positions, poses)}
    wanted |= {
        f"spacecraft_16_{task}" for task in (positions, poses, "track_velocities_3d", "go_through_poses_3d")
    }
    wanted |= {
        f"cubesat_8_{task}" for task in (positions, poses, "track_velocities_3d", "follow_pose_3d", "inspect")
    }
    wanted |= {"cubesat_8_dock"}
    wanted |= {"airship_v7_fly_hold", "airship_v7_fly_b", "airship_v7_fly_c", "volantex_ranger_fly_attitude"}
    assert names == wanted


def test_every_shipped_policy_is_up_to_date_with_what_it_is_made_from(tmp_path):
    options = {
        "episodes": 1,
        "command": "",
        "git_revision": "",
        "runs": tmp_path,
        "bundles": policies_directory(),
    }
    assert [one.name for one in load_policy_table().policies if not is_made(policy_job(one, **options))] == []


def test_making_all_of_them_takes_under_ninety_minutes():
    table = load_policy_table()
    jobs = [
        policy_job(
            policy,
            episodes=table.episodes,
            runs=Path("runs"),
            bundles=policies_directory(),
            command="",
            git_revision="",
        )
        for policy in table.policies
    ]
    evaluation = 60.0 * len(jobs) / table.at_once
    assert expected_s(jobs, table.at_once) + evaluation < 90.0 * 60.0


@pytest.mark.slow
def test_how_long_a_policy_takes_is_known_from_its_bundle_and_guessed_without_one(small_job, monkeypatch):
    monkeypatch.setattr(policies, "UPDATES_A_SECOND", 1e-4)  # so slow that no run takes as long as is guessed
    assert expected_s([], 2) == 0.0
    assert expected_s([small_job], 2) == pytest.approx(small_job.updates / 1e-4)
    make_policies(PolicyTable(2, 2, (ONE,)), [small_job], Here(), lambda *_: None)
    took = read_passport(small_job.bundle).training["wall_s"]
    assert expected_s([small_job], 2) == took
    assert expected_s([small_job] * 6, 2) == pytest.approx(3.0 * took)


def test_two_lines_for_one_bundle_are_refused():
    with pytest.raises(ValueError, match="two lines"):
        PolicyTable(2, 256, (ONE, replace(ONE, seed=4)))


@pytest.fixture
def settings(robot, task):
    return load_training_settings(robot, task)


@pytest.mark.parametrize("change", [{"seed": 4}, {"updates": 3}, {"task": "go_to_position"}])
def test_a_policy_of_another_seed_time_or_task_is_made_from_something_else(settings, change):
    assert recipe(replace(ONE, **change), settings) != recipe(ONE, settings)


def test_other_settings_or_another_robot_make_another_policy_but_a_higher_demand_does_not(
    settings, robot, monkeypatch
):
    first = recipe(ONE, settings)
    assert recipe(ONE, replace(settings, worlds=1024)) != first
    assert recipe(replace(ONE, success=1.0), settings) == first
    heavier = replace(robot, body=replace(robot.body, mass=9.0))
    monkeypatch.setattr(policies, "load_robot", lambda _: heavier)
    assert recipe(ONE, settings) != first


class Here:
    """Runs jobs in this process, and counts them."""

    def __init__(self):
        self.names = []

    def run(self, jobs, watch):
        self.names += [job.name for job in jobs]
        return [Outcome(job, run_job(job)) for job in jobs]


@pytest.fixture
def small_job(small_settings, tmp_path) -> Job:
    made_from = recipe(ONE, small_settings)
    return Job(
        ONE.name,
        ONE.robot,
        ONE.task,
        ONE.seed,
        small_settings,
        tmp_path / "run",
        updates=2,
        episodes=2,
        bundle=tmp_path / ONE.name,
        recipe=made_from,
    )


class Copied(Here):
    """Gives each job the shipped bundle with the job's recipe, as if it had been trained."""

    def run(self, jobs, watch):
        self.names += [job.name for job in jobs]
        return [Outcome(job, self.copied(job)) for job in jobs]

    def copied(self, job):
        shutil.copytree(policies_directory() / ONE.name, job.bundle, dirs_exist_ok=True)
        passport = read_passport(job.bundle)
        again = replace(passport, training=passport.training | {"recipe": job.recipe}).sealed()
        (job.bundle / PASSPORT).write_text(json.dumps(again.plain()))
        return again.training


@pytest.mark.parametrize("executor", [Copied(), pytest.param(Here(), marks=pytest.mark.slow)])
def test_a_policy_is_made_once_and_again_only_when_it_is_made_from_something_else_or_damaged(
    small_job, robot, task, tmp_path, executor
):
    table = PolicyTable(2, 2, (ONE,))
    assert not is_made(small_job)
    (first,) = make_policies(table, [small_job], executor, lambda *_: None)
    assert (first["made"], first["needed"]) == (True, 0.9)
    assert first["good"] == (first["success"] >= 0.9)
    Policy(small_job.bundle, robot, task)
    assert read_passport(small_job.bundle).training["recipe"] == small_job.recipe
    (second,) = make_policies(table, [small_job], executor, lambda *_: None)
    assert second == first | {"made": False}
    changed = replace(small_job, recipe="other", out=tmp_path / "other")
    assert not is_made(changed)
    (small_job.bundle / "policy.onnx").write_bytes(b"")
    assert not is_made(small_job)
    (third,) = make_policies(table, [changed], executor, lambda *_: None)
    assert third["made"] is True
    assert executor.names == [ONE.name] * 2


@pytest.mark.slow
def test_a_policy_that_is_set_aside_is_kept_and_made_again_to_the_last_bit(small_job):
    table, executor = PolicyTable(2, 2, (ONE,)), Here()
    assert set_aside(small_job) is None
    folders = []
    for _ in range(2):
        make_policies(table, [small_job], executor, lambda *_: None)
        folders.append(set_aside(small_job))
        assert not is_made(small_job)
    make_policies(table, [small_job], executor, lambda *_: None)
    assert executor.names == [ONE.name] * 3
    bundles = [small_job.bundle, *(folder / "bundle" for folder in folders)]
    assert len({(bundle / "policy.onnx").read_bytes() for bundle in bundles}) == 1
    assert all((folder / "run.json").is_file() for folder in folders)


def test_a_policy_that_could_not_be_made_is_reported(small_job):
    class Broken:
        def run(self, jobs, watch):
            return [Outcome(job, None, "no memory left") for job in jobs]

    (line,) = make_policies(PolicyTable(1, 2, (ONE,)), [small_job], Broken(), lambda *_: None)
    assert (line["good"], line["error"]) == (False, "no memory left")


def test_a_policy_s_run_has_a_folder_of_its_own_for_everything_it_is_made_from(tmp_path, settings):
    job = policy_job(
        ONE,
        episodes=256,
        runs=tmp_path,
        bundles=tmp_path / "bundles",
        command="fulmar policies",
        git_revision="a",
    )
    assert job.out.name == f"floating_platform_go_to_pose_{recipe(ONE, settings)[:8]}"
    assert (job.bundle, job.episodes, job.updates) == (tmp_path / "bundles" / ONE.name, 256, 2)


@pytest.mark.parametrize(("task", "differs"), [("dock", True), ("go_to_pose_3d", False)])
def test_a_policy_that_sees_and_no_other_is_made_anew_for_another_camera(task, differs, monkeypatch):
    robot = policies.load_robot("cubesat_8")
    line = policies.ShippedPolicy("cubesat_8", task, 1, 10, 0.9)
    settings = policies.load_training_settings(robot, policies.load_task(task))
    before = policies.recipe(line, settings)
    sensors = replace(robot.sensors, camera=replace(robot.sensors.camera, field_of_view=60.0))
    monkeypatch.setattr(policies, "load_robot", lambda _name: replace(robot, sensors=sensors))
    assert (policies.recipe(line, settings) != before) == differs
