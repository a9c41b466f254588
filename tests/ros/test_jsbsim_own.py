"""JSBSim's own L17 flown by the nodes that fly every robot, from the command line to the bag."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import odometries
from fulmar_core.config.paths import OWN_FOLDERS, config_path
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of

pytestmark = [pytest.mark.slow, pytest.mark.timeout(180)]


def test_lqi_holds_the_height_of_the_l17_in_lock_step_and_a_seed_repeats_its_flight(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    """Task `fly_hold` at 20 m, since at one metre the hull of a Navion touches the water."""
    (tmp_path / "own" / "tasks").mkdir(parents=True)
    task = yaml.safe_load(config_path("tasks", "fly_hold").read_text()) | {
        "name": "fly_high",
        "height": [20.0, 20.0],
    }
    (tmp_path / "own" / "tasks" / "fly_high.yaml").write_text(yaml.safe_dump(task))
    env = {**ros_domain.env, OWN_FOLDERS: "own"}
    asked = ("navion", "--backend", "jsbsim:L17", "--task", "fly_high", "--lockstep", "--seed", "3")
    paths = []
    for bag in ("bag", "again"):
        done = fulmar("run", *asked, "--duration", "12", "--record", bag, "--json", env=env, cwd=tmp_path)
        summary = json_of(done.stdout)
        assert summary["failure"] is None, done.stderr
        assert (summary["success"], summary["backend"]) == (True, "jsbsim:L17")
        assert summary["final_position_error_m"] < 0.1
        paths.append(odometries(open_bag(tmp_path / bag).odometry()).pose)
    assert len(paths[0]) >= 1200
    assert np.array_equal(*paths)
    rerun = fulmar("bag", "rerun", "bag", env=env, cwd=tmp_path)
    assert rerun.returncode == 0, rerun.stderr
    assert rerun.stdout.rstrip().endswith("same")


def test_a_model_that_does_not_stand_for_a_robot_is_one_line(ros_domain: RosDomain, tmp_path: Path) -> None:
    asked = ("navion", "--backend", "jsbsim:L71", "--task", "fly_airspeed")
    done = fulmar("run", *asked, env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.splitlines() == [
        "fulmar: jsbsim:L71: JSBSim's 'L71' does not stand for 'navion'. Did you mean 'L17'?"
    ]
