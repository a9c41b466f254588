"""Whole runs: plant, controller and recorder as processes, started and evaluated by `fulmar run`."""

from __future__ import annotations

import struct
from collections import Counter
from pathlib import Path

import pytest
from mcap.reader import make_reader

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import odometries
from fulmar_bags.run_record import read_run
from fulmar_ros.qos import SAFE_REPEATS
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of, run_in_real_time

REQUIRED = {
    "robot",
    "task",
    "controller",
    "backend",
    "steps",
    "duration_s",
    "final_position_error_m",
    "final_heading_error_deg",
    "success",
    "control_rate_hz",
    "latency_ms",
    "overruns",
    "watchdog_trips",
    "bag",
}


def command_bytes(bag: Path) -> list[bytes]:
    """Every command in a bag, as it was on the wire, with its stamp.

    A plant that has no answer for half a second asks again, and a controller then sends the same command again; such
    repeats count once, where the bag has the odometry as often.
    """
    found = open_bag(bag)
    asked = Counter(odometries(found.odometry()).stamp_ns.tolist())
    (file,) = bag.glob("*.mcap")
    with file.open("rb") as stream:
        sent = [
            message.data
            for _, channel, message in make_reader(stream).iter_messages()
            if channel.topic.endswith(("actuators/command", "cmd_vel"))
        ]
    last = sent[-1]  # which a controller that ends publishes several times
    for data, count in Counter(sent).items():
        assert count <= asked[stamp_in(data)] + (SAFE_REPEATS if data == last else 0), (
            "a command that was not asked for again came again"
        )
    return list(dict.fromkeys(sent))


def stamp_in(data: bytes) -> int:
    """Stamp of a message in CDR that begins with its header [ns]."""
    seconds, nanoseconds = struct.unpack_from("<iI", data, 4)
    return int(seconds * 10**9 + nanoseconds)


README = (
    "run",
    "floating_platform",
    "--task",
    "go_to_pose",
    "--lockstep",
    "--seed",
    "7",
    "--control-hz",
    "5",
)


# With that of test_own_parts.py these are the whole runs of `make test` in lock step: a short way.
BRIEF = ("--start", "0.3,0,0", "--goal", "0,0,0", "--duration", "12")


@pytest.mark.parametrize(
    ("controller", "more", "seconds"),
    [
        ("policy", BRIEF, 12.0),
        pytest.param("policy", (), 60.0, marks=pytest.mark.slow),
        pytest.param("lqr", (), 60.0, marks=pytest.mark.slow),
    ],
)
def test_a_lockstep_run_reaches_its_goal_and_says_so_in_json(
    controller: str, more: tuple[str, ...], seconds: float, ros_domain: RosDomain, tmp_path: Path
) -> None:
    """The very command of the README, with the figures that outside checks read."""
    asked = (*README, *more, "--controller", controller, "--record", "bag", "--json")
    done = fulmar(*asked, env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    summary = json_of(done.stdout)
    assert summary.keys() >= REQUIRED
    assert summary["success"]
    assert summary["steps"] == 5 * seconds
    assert summary["duration_s"] == pytest.approx(seconds)
    assert (tmp_path / "bag" / "metadata.yaml").is_file()
    assert len(command_bytes(tmp_path / "bag")) >= 5 * seconds


@pytest.mark.slow
def test_a_policy_commands_the_same_again_byte_for_byte(ros_domain: RosDomain, tmp_path: Path) -> None:
    for bag in ("bag", "again"):
        fulmar(*README, "--controller", "policy", "--record", bag, env=ros_domain.env, cwd=tmp_path)
    commands = command_bytes(tmp_path / "bag")
    assert len(commands) >= 300
    assert commands == command_bytes(tmp_path / "again")


@pytest.mark.slow
def test_the_mock_backend_runs_without_mujoco(ros_domain: RosDomain, tmp_path: Path) -> None:
    """The same nodes on the core's own dynamics."""
    asked = (
        "floating_platform",
        "--controller",
        "lqr",
        "--backend",
        "mock",
        "--lockstep",
        "--control-hz",
        "5",
    )
    done = fulmar("run", *asked, "--record", "bag", "--json", env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("robot", "task", "figure"),
    [
        ("turtlebot2", "go_through_positions", "goals_reached"),
        ("kingfisher", "go_to_position_with_obstacles", "final_position_error_m"),
        ("leatherback", "track_velocities", "velocity_error_m_s"),
        ("modular_freeflyer", "go_through_poses", "goals_reached"),
    ],
)
def test_every_kind_of_goal_and_robot_runs_and_is_evaluated(
    robot: str, task: str, figure: str, ros_domain: RosDomain, tmp_path: Path
) -> None:
    """Paths, obstacles, velocities; wheels, propellers, steering and thrusters that open by degrees."""
    asked = (robot, "--task", task, "--controller", "classical", "--lockstep", "--duration", "26")
    done = fulmar("run", *asked, "--record", "bag", "--json", env=ros_domain.env, cwd=tmp_path)
    summary = json_of(done.stdout)
    assert summary["failure"] is None, done.stderr
    assert summary[figure] is not None
    assert summary["collided"] is False
    record = read_run(tmp_path / "bag")
    assert not record.warnings
    assert len(record.commanded) >= 26 * 5
    assert len(record.goals) == (5 if task == "track_velocities" else 1)
    assert bool(len(record.obstacles)) == task.endswith("obstacles")


@pytest.mark.slow
def test_a_missed_goal_is_exit_code_one_and_no_failure(ros_domain: RosDomain, tmp_path: Path) -> None:
    """Two seconds do not suffice for three metres."""
    asked = ("floating_platform", "--controller", "lqr", "--lockstep", "--duration", "2")
    done = fulmar("run", *asked, "--record", "bag", "--json", env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 1
    summary = json_of(done.stdout)
    assert summary["success"] is False
    assert summary["failure"] is None


@pytest.mark.real_time
def test_a_realtime_run_holds_its_rate_and_records_every_wire(ros_domain: RosDomain, tmp_path: Path) -> None:
    """Rate and figures of a real-time run; how punctual it was is for an idle machine to say."""
    asked = (
        "floating_platform",
        "--controller",
        "policy",
        "--start",
        "0.2,0,0",
        "--goal",
        "0,0,0",
        "--duration",
        "3",
    )
    done = run_in_real_time(*asked, env=ros_domain.env, cwd=tmp_path)
    summary = json_of(done.stdout)
    assert summary["failure"] is None, done.stderr
    assert summary["control_rate_hz"] == pytest.approx(5.0, rel=0.02)
    assert summary["period_error_ms"]["p99"] is not None
    assert summary["watchdog_trips"] == 0
    # The state that comes with the beat is answered; without waiting for it, the one before, a tick of 20 ms older.
    assert summary["latency_ms"]["p50"] < 12.0
    record = read_run(tmp_path / "bag")
    assert not record.warnings
    assert len(record.truth.stamp_s) == pytest.approx(151, abs=2)  # 3 s at 50 Hz and the first
    assert record.controller["sha256"]


@pytest.mark.slow
def test_evaluation_through_ros_agrees_with_mujoco_alone(ros_domain: RosDomain, tmp_path: Path) -> None:
    """The same episodes, the same simulator, the same law: ROS in between must not change the result."""
    asked = (
        "evaluate",
        "floating_platform",
        "go_to_pose",
        "--controller",
        "lqr",
        "--episodes",
        "4",
        "--json",
    )
    through_ros, alone = (
        json_of(fulmar(*asked, "--through", way, env=ros_domain.env, cwd=tmp_path).stdout)
        for way in ("ros", "mujoco")
    )
    assert through_ros["success_rate"] == alone["success_rate"] == 1.0
    assert through_ros["PT5_percent"] == alone["PT5_percent"]
    assert through_ros["AAS"] == alone["AAS"]


@pytest.mark.slow
def test_a_path_is_followed_the_same_way_twice_in_lock_step(ros_domain: RosDomain, tmp_path: Path) -> None:
    """A goal node between odometry and command: the controller waits for what it says to each state."""
    asked = ("turtlebot2", "--controller", "classical", "--goals", "circle", "--lockstep", "--duration", "12")
    summaries = [
        json_of(fulmar("run", *asked, "--record", name, "--json", env=ros_domain.env, cwd=tmp_path).stdout)
        for name in ("one", "two")
    ]
    one, two = command_bytes(tmp_path / "one"), command_bytes(tmp_path / "two")
    assert len(one) >= 120
    assert one == two
    for summary in summaries:
        assert summary["failure"] is None
        assert summary["path_error_m"] < 0.05
        assert summary["velocity_error_m_s"] == summaries[0]["velocity_error_m_s"]
        assert (summary["goals_progress"], summary["success"]) == ("0 of 1 rounds", False)


@pytest.mark.slow
def test_places_of_a_file_are_visited_one_after_another(ros_domain: RosDomain, tmp_path: Path) -> None:
    """The next one comes when the robot has been at one for a while."""
    (tmp_path / "mine.yaml").write_text(
        "kind: positions\ntitle: two places\npositions: [[0.0, 0.0], [0.6, 0.0]]\n"
    )
    asked = ("turtlebot2", "--controller", "classical", "--goals", "mine.yaml", "--start", "-0.6,0,0")
    done = fulmar("run", *asked, "--lockstep", "--record", "bag", "--json", env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    summary = json_of(done.stdout)
    assert (summary["task"], summary["success"]) == ("go_to_position", True)
    assert summary["goals_progress"] == "2 of 2 targets reached"


@pytest.mark.slow
def test_a_ring_without_a_fault_is_a_run_without_a_bag_or_a_result(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    """Nobody recorded whether the goal was met, so nobody says so."""
    asked = (
        "floating_platform",
        "--controller",
        "lqr",
        "--lockstep",
        "--duration",
        "4",
        "--recording",
        "ring",
    )
    done = fulmar("run", *asked, "--record", "bag", "--json", env=ros_domain.env, cwd=tmp_path)
    summary = json_of(done.stdout)
    assert done.returncode == 0, done.stderr
    assert (summary["success"], summary["bag"], summary["failure"]) == (None, None, None)
    assert not (tmp_path / "bag").exists()
