"""`fulmar faults --system`: a fault of one robot of a fleet through the command, with the others on their way."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of

FILE = """\
title: two platforms
control_hz: 10.0
robots:
  - {name: alpha, robot: floating_platform, task: go_to_pose, controller: lqr, start: [0.0, 0.0, 0.0],
     goal: [-2.0, 0.5, 90.0]}
  - {name: beta, robot: floating_platform, task: go_to_pose, controller: lqr, start: [3.0, 0.0, 0.0],
     goal: [3.0, 1.0, 0.0]}
"""


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.timeout(300)
def test_a_killed_controller_and_the_e_stop_of_all_are_survived_and_the_report_has_the_other_robot(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    folder = tmp_path / "configs" / "systems"
    folder.mkdir(parents=True)
    (folder / "pair.yaml").write_text(FILE)
    env = {**ros_domain.env, "FULMAR_CONFIGS": str(tmp_path / "configs")}
    asked = ("faults", "--system", "pair", "--only", "controller_killed,fleet_estop", "--json")
    done = fulmar(*asked, env=env, cwd=tmp_path, timeout_s=280.0)
    report = json_of(done.stdout)
    assert (report["fleet"], report["robot"]) == ("pair", "alpha")
    killed, pressed = report["faults"]
    assert killed["passed"] and killed["others"] == {"beta": "arrived"}, killed
    assert killed["detected_by"] == "plant" and killed["time_to_safe_s"] <= killed["limit_s"]
    assert pressed["passed"] and pressed["others"] == {"beta": "safe"}, pressed
    assert done.returncode == 0
