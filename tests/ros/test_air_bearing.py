"""No command before the air bearing is on; learning from what was applied, in lock step too."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from std_msgs.msg import Bool

from fulmar_bags.run_record import read_run
from fulmar_core.robots.topics import SIMULATION_START_NS
from fulmar_core.safety.arbiter import BEARING_OFF
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of
from tests.ros.neighbour import Neighbour, Stream, until


@pytest.mark.real_time
def test_valves_stay_closed_until_the_bearing_is_on_and_close_when_it_goes_off(
    neighbour: Neighbour, stream: Stream
) -> None:
    """The fixture's bearing is on; off, the safe command and the reason; on again, the controller goes on."""

    def reason() -> str:
        return neighbour.said["controller"][1]["reason"]

    for _ in range(2):
        neighbour.bearing.publish(Bool(data=False))
        until(lambda: reason() == BEARING_OFF)
        until(lambda: not neighbour.commands[-1].any())
        sent = len(neighbour.commands)
        until(lambda since=sent: len(neighbour.commands) > since + 25)
        assert not any(command.any() for command in neighbour.commands[sent:])
        neighbour.bearing.publish(Bool(data=True))
        until(lambda: neighbour.commands[-1].any())


@pytest.mark.slow
def test_in_lock_step_a_late_bearing_is_waited_for_and_the_bag_runs_again_the_same(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    asked = (
        "floating_platform",
        "--controller",
        "lqr",
        "--control-hz",
        "5",
        "--lockstep",
        "--duration",
        "15",
    )
    late = ("--scenario", "bearing_late", "--start=0.6,0.3,20", "--goal", "0,0,0")
    done = fulmar("run", *asked, *late, "--record", "bag", "--json", env=ros_domain.env, cwd=tmp_path)
    summary = json_of(done.stdout)
    assert summary["success"], done.stderr
    assert summary["believed_dead"] == []
    record = read_run(tmp_path / "bag")
    for wire in (record.commanded, record.applied):
        opened = wire.stamp_s[np.any(wire.effort > 0.0, axis=1)]
        assert SIMULATION_START_NS / 1e9 + 3.0 <= opened[0] < SIMULATION_START_NS / 1e9 + 3.5
    standing = record.truth.between(0.0, SIMULATION_START_NS / 1e9 + 3.0)
    assert np.ptp(standing.position[:, :2], axis=0).max() < 1e-9
    again = fulmar("bag", "rerun", "bag", "--from", "odometry", "--json", env=ros_domain.env, cwd=tmp_path)
    found = {field["field"]: field["differing"] for field in json_of(again.stdout)["fields"]}
    assert found["decision"] == found["command"] == 0, found


@pytest.mark.slow
def test_a_dead_valve_is_named_by_the_run_and_its_report(ros_domain: RosDomain, tmp_path: Path) -> None:
    asked = (
        "floating_platform",
        "--controller",
        "lqr",
        "--control-hz",
        "5",
        "--lockstep",
        "--duration",
        "20",
    )
    dead = ("--scenario", "drift_one_lost", "--start=1,1,90", "--goal", "0,0,0", "--seed", "3")
    done = fulmar("run", *asked, *dead, "--record", "bag", env=ros_domain.env, cwd=tmp_path)
    assert "believed dead: thruster_" in done.stdout, done.stdout + done.stderr
    (name,) = [
        line.split(": ")[1]
        for line in done.stdout.splitlines()
        if "believed dead: " in line and "(" not in line
    ]
    said = [sample for sample in read_run(tmp_path / "bag").health if sample.name.endswith(": controller")]
    warned = [sample for sample in said if f"valve {name} believed dead (effectiveness 0.0" in sample.message]
    assert warned
    assert {sample.level for sample in warned} == {1}
    fulmar("report", "bag", env=ros_domain.env, cwd=tmp_path)
    assert f"valve {name} believed dead" in next(tmp_path.glob("**/*.html")).read_text(encoding="utf-8")
