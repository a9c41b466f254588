"""From a request to a checked plan, with nothing started."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import pytest

from fulmar_bringup.plant_row import plant_spec
from fulmar_bringup.run_executor import execute
from fulmar_core.config.errors import BundleError, ConfigError, DeviceError, UnknownNameError
from fulmar_core.config.paths import config_directory
from fulmar_core.config.recording import Recording
from fulmar_core.loop.bundle_signature import make_keys, sign_bundle
from hardware_drivers.hardware import hardware_path
from policy_server.controllers import shipped_policy

NAN = float("nan")


def test_what_was_not_said_comes_from_files_and_the_seed(plan):
    request = plan()
    assert request.control_hz == 50.0  # configs/systems/mujoco_lqr.yaml
    assert request.duration_s == 60.0  # configs/tasks/go_to_pose.yaml
    distance = math.dist(request.goal[:2], request.start[:2])
    assert 0.5 <= distance <= 5.0
    assert request.policy == ""


def test_a_policy_runs_at_the_rate_that_it_was_trained_at(plan):
    craft = {"robot": "airship_v7", "task": "fly_hold", "backend": "mujoco"}
    assert plan(**craft, controller="policy").control_hz == 25.0
    assert plan(**craft, controller="lqi").control_hz == 100.0


def test_one_seed_gives_one_plan_and_another_seed_another(plan):
    assert plan(seed=7) == plan(seed=7)
    assert plan(seed=7).goal != plan(seed=8).goal


def test_what_was_said_is_kept(plan, tmp_path):
    request = plan(
        goal=(1.0, 2.0, 90.0), start=(0.0, 0.0, -30.0), duration_s=3.0, lockstep=True, control_hz=10.0
    )
    assert (request.goal, request.start) == ((1.0, 2.0, 90.0), (0.0, 0.0, -30.0))
    assert (request.duration_s, request.lockstep, request.control_hz) == (3.0, True, 10.0)
    assert request.record == str(tmp_path / "bag")


def test_a_goal_alone_moves_the_start_along(plan):
    drawn, moved = plan(seed=3), plan(seed=3, goal=(10.0, -10.0, 0.0))
    drawn_offset = [s - g for s, g in zip(drawn.start, drawn.goal, strict=True)][:2]
    moved_offset = [s - g for s, g in zip(moved.start, moved.goal, strict=True)][:2]
    assert moved_offset == pytest.approx(drawn_offset)


def test_the_policy_s_folder_is_written_in_full(plan):
    request = plan(controller="policy")
    assert Path(request.policy) == shipped_policy("floating_platform", "go_to_pose")
    assert Path(request.policy).is_absolute()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"robot": "floting_platform"},
            "unknown robot 'floting_platform'. Did you mean 'floating_platform'?",
        ),
        ({"task": "go_to_poes"}, "unknown task 'go_to_poes'. Did you mean 'go_to_pose'?"),
        ({"controller": "lqg"}, "unknown controller 'lqg'. Did you mean 'lqr'?"),
        ({"backend": "mujoko"}, "unknown backend 'mujoko'. Did you mean 'mujoco'?"),
        ({"scenario": "nomnal"}, "unknown scenario 'nomnal'. Did you mean 'nominal'?"),
    ],
)
def test_an_unknown_name_gets_the_nearest_one(plan, change, words):
    with pytest.raises(UnknownNameError) as caught:
        plan(**change)
    assert str(caught.value) == words


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"backend": "hardware"}, "a real robot goes nowhere by chance"),
        ({"goal": (NAN, 0.0, 0.0)}, "goal = (nan, 0.0, 0.0) must be finite"),
        ({"start": (0.0, 0.0, NAN)}, "start = (0.0, 0.0, nan) must be finite"),
        ({"duration_s": NAN}, "duration = nan must be finite"),
        ({"duration_s": math.inf}, "duration = inf must be finite"),
        ({"rate": NAN}, "rate = nan must be finite"),
        (
            {"goal": (0.0, 0.0, 0.0), "start": (9.0, 0.0, 0.0)},
            "9.0 m apart, the geofence of 'floating_platform' is 8 m",
        ),
        ({"control_hz": 7.0}, "robot 'floating_platform': control_hz = 7 must divide the physics rate"),
        ({"control_hz": NAN}, "robot 'floating_platform': control_hz = nan must be greater than 0"),
    ],
)
def test_what_cannot_work_is_refused(plan, change, words):
    with pytest.raises(ConfigError) as caught:
        plan(**change)
    assert words in str(caught.value)


def test_a_folder_that_this_user_may_not_write_is_refused_before_anything_starts(plan, monkeypatch):
    monkeypatch.setattr("fulmar_bringup.plan_checks.os.access", lambda *_: False)  # root may write everywhere
    with pytest.raises(ConfigError, match="Permission denied"):
        plan()


def test_a_folder_that_exists_is_never_recorded_into(plan, tmp_path):
    (tmp_path / "bag").mkdir()
    with pytest.raises(ConfigError, match="exists already; nothing recorded is overwritten"):
        plan()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"task": "go_to_position", "policy": str(shipped_policy("floating_platform", "go_to_pose"))},
            "was trained for task",
        ),
        ({"control_hz": 50.0}, "was trained at 5 Hz, but would run at 50 Hz"),
        ({"policy": "/nowhere"}, "policy '/nowhere': the folder does not exist"),
    ],
)
def test_a_policy_that_does_not_fit_is_refused_before_anything_starts(plan, change, words):
    with pytest.raises(BundleError) as caught:
        plan(controller="policy", **change)
    assert words in str(caught.value)


def test_a_damaged_policy_is_refused_before_anything_starts(plan, tmp_path):
    folder = shutil.copytree(shipped_policy("floating_platform", "go_to_pose"), tmp_path / "copy")
    (folder / "policy.onnx").write_bytes(b"other")
    with pytest.raises(BundleError, match="SHA-256"):
        plan(controller="policy", policy=str(folder))


def test_a_policy_for_a_controller_that_runs_none_is_refused(plan):
    with pytest.raises(ConfigError, match="controller 'lqr' runs no policy bundle"):
        plan(policy=str(shipped_policy("floating_platform", "go_to_pose")))


@pytest.mark.parametrize(("control_hz", "rate"), [(1.0, 1.0), (2.0, 1.0), (1.0, 0.1), (0.5, 3.0)])
def test_commands_rarer_than_the_watchdog_allows_are_refused_in_real_time_alone(plan, control_hz, rate):
    with pytest.raises(ConfigError, match=r"the watchdog closes the actuators after \d+ ms"):
        plan(control_hz=control_hz, rate=rate)
    assert plan(control_hz=control_hz, lockstep=True).control_hz == control_hz


@pytest.mark.parametrize(("control_hz", "rate"), [(2.5, 1.0), (5.0, 0.1), (1.0, 3.0)])
def test_commands_that_the_watchdog_allows_are_planned(plan, control_hz, rate):
    assert plan(control_hz=control_hz, rate=rate).rate == rate


def test_a_real_robot_begins_where_it_stands(plan):
    request = plan(backend="hardware", goal=(2.0, 1.0, 90.0))
    assert request.start == (0.0, 0.0, 0.0)
    assert request.hardware.endswith("configs/hardware/zero_g_lab.yaml")
    assert Path(request.hardware).is_absolute()
    assert not request.emulated


def test_a_run_without_its_device_starts_nothing_and_says_what_is_missing(plan, tmp_path, monkeypatch):
    """Exit code 1, at once; with an emulator the port need not exist yet."""
    path = tmp_path / "mine.yaml"
    path.write_text("title: t\nrobot: turtlebot2\ndriver: {kind: kobuki, port: /dev/ttyNONE}\n")
    more = dict(
        robot="turtlebot2",
        controller="classical",
        task="go_to_position",
        backend="hardware",
        hardware=str(path),
    )
    monkeypatch.setattr(
        "fulmar_bringup.run_executor.ProcessGroup", lambda: pytest.fail("a process is started")
    )
    with pytest.raises(DeviceError, match="/dev/ttyNONE: there is no such serial port"):
        execute(plan(**more, goal=(1.0, 0.0, 0.0)))


def test_a_boat_is_armed_by_its_file_or_by_the_command_line(plan, tmp_path):
    boat = dict(
        robot="kingfisher", controller="classical", task="go_to_position", backend="hardware", emulated=True
    )
    asked = plan(**boat, hardware="kingfisher_ardupilot", arm=True)
    assert plant_spec(asked).parameters["arm"] is True
    armed = tmp_path / "armed.yaml"
    armed.write_text(hardware_path("kingfisher_ardupilot").read_text().replace("arm: false", "arm: true"))
    assert "arm" not in plant_spec(plan(**boat, hardware=str(armed))).parameters


def test_an_emulated_one_begins_where_the_seed_says(plan):
    assert plan(backend="hardware", emulated=True).start == plan().start


def test_an_estimator_runs_in_lock_step_and_takes_poses_at_a_rate_of_their_own(plan):
    asked = plan(guards=dict(estimator="mocap_imu"), lockstep=True, mocap_hz=100.0)
    assert (asked.guards.estimator, asked.mocap_hz) == ("mocap_imu", 100.0)


def test_a_bundle_for_something_else_stops_a_run_unless_a_fallback_is_named(plan):
    other = str(shipped_policy("floating_platform", "go_to_position"))
    with pytest.raises(BundleError):
        plan(controller="policy", policy=other, control_hz=5.0)
    request = plan(controller="policy", policy=other, control_hz=5.0, guards=dict(fallback="lqr"))
    assert request.policy == other


def test_a_fallback_that_has_nothing_for_the_robot_is_refused(plan):
    with pytest.raises(
        ConfigError, match="is for robots that are pushed over a floor or water with thrusters"
    ):
        plan(robot="turtlebot2", controller="classical", guards=dict(fallback="lqr"))


@pytest.mark.parametrize(
    ("robot", "goals", "reported"),
    [
        (
            "kingfisher",
            "velocities: [{velocity: [0.2, 0.5, 0.0], hold_s: 3.0}]",
            "0.5 m/s sideways; 'kingfisher'",
        ),
        (
            "kingfisher",
            "velocities: [{velocity: [3.0, 0.0, 0.0], hold_s: 3.0}]",
            "'kingfisher' goes at most 1.5 m/s",
        ),
        (
            "turtlebot2",
            "path: {kind: circle, radius: 2.0}\nspeed: 50.0\nlook_ahead: 0.5",
            "ask for 50 m/s; 'turtle",
        ),
    ],
)
def test_velocities_that_no_controller_can_keep_are_refused(plan, tmp_path, robot, goals, reported):
    path = tmp_path / "mine.yaml"
    path.write_text(f"kind: {'path' if 'path' in goals else 'velocities'}\ntitle: too much\n{goals}\n")
    asked = {"robot": robot, "task": "track_velocities", "controller": "classical", "control_hz": 10.0}
    with pytest.raises(ConfigError, match=reported):
        plan(**asked, goals=str(path))


def test_a_platform_may_be_asked_to_go_sideways(plan, tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(
        "kind: velocities\ntitle: sideways\nvelocities: [{velocity: [0.0, 0.1, 0.0], hold_s: 3.0}]\n"
    )
    assert plan(task="track_velocities", controller="classical", goals=str(path)).duration_s > 3.0


def test_a_bundle_that_nobody_trusted_has_signed_is_refused_before_anything_starts(plan, tmp_path):
    """And so are keys that are none; with a fallback the robot says it itself and goes on without the policy."""
    make_keys(tmp_path / "private.pem", tmp_path / "public.pem")
    asked = {"controller": "policy", "guards": {"trusted_keys": str(tmp_path / "public.pem")}}
    with pytest.raises(BundleError, match="is not signed"):
        plan(**asked)
    nowhere = {"trusted_keys": str(tmp_path / "nope")}
    for guards in (nowhere, {**nowhere, "fallback": "lqr"}):
        with pytest.raises(ConfigError, match="nope: cannot be read"):
            plan(controller="policy", guards=guards)
    assert plan(controller="policy", guards={**asked["guards"], "fallback": "lqr"}).policy
    signed = shutil.copytree(shipped_policy("floating_platform", "go_to_pose"), tmp_path / "signed")
    sign_bundle(signed, tmp_path / "private.pem")
    assert plan(**asked, policy=str(signed)).policy == str(signed)


def test_the_recorder_keeps_everything_unless_asked_otherwise(plan):
    assert plan().recording.mode == "whole"
    assert plan(recording_mode="ring").recording.mode == "ring"


def test_an_unknown_way_to_record_is_refused_with_the_nearest(plan):
    with pytest.raises(UnknownNameError, match="Did you mean 'ring'"):
        plan(recording_mode="rign")
    with pytest.raises(ConfigError, match="a run has one bag"):
        plan(recording_mode="goals")


def test_the_system_file_says_how_to_record(plan, tmp_path, monkeypatch):
    shutil.copytree(config_directory(), tmp_path / "configs")
    with (tmp_path / "configs" / "systems" / "mujoco_lqr.yaml").open("a") as file:
        file.write("recorder:\n  mode: ring\n  before_fault_s: 10.0\n")
    monkeypatch.setenv("FULMAR_CONFIGS", str(tmp_path / "configs"))
    assert plan().recording == Recording(mode="ring", before_fault_s=10.0)
    assert plan(recording_mode="whole").recording == Recording(before_fault_s=10.0)


def test_a_simulated_motion_capture_needs_time_that_goes_on_and_no_real_one(plan):
    assert plan(mocap_hz=200.0).mocap_hz == 200.0
    with pytest.raises(ConfigError, match="for an estimator only"):
        plan(mocap_hz=200.0, lockstep=True)
    with pytest.raises(ConfigError, match="a real robot has its own"):
        plan(mocap_hz=200.0, backend="hardware", controller="lqr", goal=(0.0, 0.0, 0.0))
