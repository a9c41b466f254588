"""A formation through its nodes: the shape holds, and followers that lose their leader stop and say why."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from fulmar_bags.contents import open_bag
from fulmar_bags.run_record import RunRecord, read_run
from fulmar_ros.runtime import ros_node
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, start_fulmar
from tests.ros.test_fleet import Watcher, controller_of

FOLLOWERS = ("left", "right")


def run(env: dict[str, str], cwd: Path, record: str, *more: str) -> dict[str, Any]:
    asked = ("run", "--system", "formation", "--record", record, "--duration", "20", "--json", *more)
    done = fulmar(*asked, env=env, cwd=cwd, timeout_s=150.0)
    assert done.stdout.startswith("{"), done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


@pytest.mark.slow
@pytest.mark.timeout(400)
def test_a_formation_in_lock_step_holds_its_shape_and_gives_the_same_bytes_twice(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    for record in ("one", "two"):
        result = run(ros_domain.env, tmp_path, record, "--lockstep")
        for name in FOLLOWERS:
            own = result["robots"][name]
            assert own["success"] and own["shape_error_rms_m"] < 0.1, own
        assert result["least_distance_m"] > 0.3
    for name in FOLLOWERS:
        bags = [open_bag(tmp_path / record).of_robot(name) for record in ("one", "two")]
        for wire in ("odom", "ground_truth/odom", "controller/observation", "controller/action"):
            one, two = (b"".join(bytes(data) for data in bag.topics[f"/{name}/{wire}"].data) for bag in bags)
            assert one and one == two, f"{name}: {wire}"
    again = fulmar(
        "bag", "rerun", "one", "--robot", "left", "--json", env=ros_domain.env, cwd=tmp_path, timeout_s=60.0
    )
    assert json.loads(again.stdout)["same"], again.stdout


def words_of(record: RunRecord) -> set[str]:
    """What the controller of a robot said about its formation."""
    return {str(each.values.get("formation") or "") for each in record.health} - {""}


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.timeout(300)
def test_the_followers_of_a_leader_whose_controller_is_killed_stop_and_say_why(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    asked = ("run", "--system", "formation", "--duration", "20", "--record", "bag", "--json")
    process = start_fulmar(*asked, env=ros_domain.env, cwd=tmp_path)
    with ros_node("watcher", lambda error: pytest.fail(repr(error))) as node:
        watcher = Watcher(node)
        watcher.wait_s(8.0)
        controller_of("leader", process).kill()
        output, errors = process.communicate(timeout=120.0)
    assert output.startswith("{"), errors
    result = json.loads(output)
    assert "controller was killed" in result["robots"]["leader"]["failure"]
    for name in FOLLOWERS:
        record = read_run(tmp_path / "bag", name)
        assert words_of(record) == {"holds its place: nothing drives its leader 'leader'"}
        end = record.motion.position[-20:, :2]
        assert abs(end - end[-1]).max() < 0.05
        assert not result["robots"][name]["failure"]
