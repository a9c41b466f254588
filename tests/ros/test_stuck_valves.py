"""A valve or fan that is stuck open stops its robot in words: in a node, in a run, and on its report."""

from __future__ import annotations

from pathlib import Path

import pytest

from fulmar_core.estimators.actuator_health.beliefs import Beliefs
from fulmar_ros.actuator_beliefs import ActuatorBeliefs
from fulmar_ros.controller_node import ControllerNode
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of
from tests.ros.neighbour import Stream, until

WORDS = ("valve thruster_3 is stuck open",)


@pytest.mark.real_time
def test_a_node_that_finds_a_valve_stuck_open_closes_the_others_and_ends_with_its_name(
    stream: Stream, controller: ControllerNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    ended: list[int] = []
    monkeypatch.setattr(controller, "_request_exit", ended.append)
    believed = Beliefs((), WORDS, ("thruster_3",), WORDS)
    monkeypatch.setattr(ActuatorBeliefs, "of", lambda *_, **__: believed)
    neighbour = stream.neighbour
    until(lambda: neighbour.said["controller"][1]["mode"] == "fault")
    said = neighbour.said["controller"][1]
    assert said["reason"].startswith("valve thruster_3 is stuck open")
    assert said["believed_open"] == "thruster_3"
    assert WORDS[0] in said["warnings"]
    until(lambda: not neighbour.commands[-1].any())
    assert ended == [1]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("robot", "controller"),
    [
        ("floating_platform", "lqr"),
        ("floating_platform", "policy"),
        ("spacecraft_16", "lqr"),
        ("int_ball2", "policy"),
    ],
)
def test_a_run_names_what_is_stuck_open_in_its_result_and_its_report(
    ros_domain: RosDomain, tmp_path: Path, robot: str, controller: str
) -> None:
    asked = (robot, "--controller", controller, "--scenario", "valve_stuck_open", "--lockstep", "--seed", "3")
    done = fulmar("run", *asked, "--record", "bag", "--json", env=ros_domain.env, cwd=tmp_path)
    summary = json_of(done.stdout)
    (name,) = summary["believed_open"]
    assert summary["believed_dead"] == []
    sentence = f"{'fan' if name.startswith('fan') else 'valve'} {name} is stuck open"
    assert sentence in summary["warnings"]
    assert f"{sentence}. Close its supply." in done.stderr
    assert done.returncode == 1
    fulmar("report", "bag", env=ros_domain.env, cwd=tmp_path)
    assert sentence in next(tmp_path.glob("**/*.html")).read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_run_of_a_policy_names_a_valve_that_stays_closed(ros_domain: RosDomain, tmp_path: Path) -> None:
    asked = ("floating_platform", "--scenario", "valve_stuck_closed", "--lockstep", "--seed", "5")
    done = fulmar("run", *asked, "--duration", "20", "--json", env=ros_domain.env, cwd=tmp_path)
    summary = json_of(done.stdout)
    (name,) = summary["believed_dead"]
    assert summary["believed_open"] == []
    assert f"valve {name} believed dead" in summary["warnings"]
