"""A run that is driven to identify the robot by, over ROS, and what its bag states."""

from __future__ import annotations

from pathlib import Path

import pytest

from fulmar_bags.run_record import read_run
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of


@pytest.mark.slow
def test_an_excited_run_succeeds_without_a_goal_and_its_bag_states_thrust_and_inertia(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    asked = ("floating_platform", "--controller", "excite", "--lockstep", "--duration", "60", "--seed", "4")
    done = fulmar("run", *asked, "--record", "bag", "--json", env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    reported = fulmar(
        "identify", "bag", "--known", "mass=5.32+-0.005", "--json", env=ros_domain.env, cwd=tmp_path
    )
    assert reported.returncode == 0, reported.stderr
    estimates = json_of(reported.stdout)["estimates"]
    assert estimates["thrust"]["value"] == pytest.approx(1.0, rel=0.03)
    assert estimates["yaw_inertia"]["value"] == pytest.approx(0.2045, rel=0.03)


@pytest.mark.slow
def test_a_spacecraft_is_excited_and_its_bag_states_mass_thrust_inertia_and_centre_of_mass(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    """Of a body that is not the nominal one, under a constant push: what the seed drew is found again."""
    craft, task = load_robot("spacecraft_16"), load_task("go_to_pose_3d")
    world = draw_episode(craft, task, load_scenario("uncertain"), seed=2, number=0).world
    asked = (
        "--controller",
        "excite",
        "--scenario",
        "uncertain",
        "--lockstep",
        "--duration",
        "120",
        "--seed",
        "2",
    )
    places = ("--start", "0,0,0", "--goal", "0,0,0,0,0,0")
    env, weighed = ros_domain.env, f"mass={float(world.mass):.3f}+-0.01"
    done = fulmar("run", craft.name, *asked, *places, "--record", "bag", "--json", env=env, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    reported = fulmar(
        "identify", "bag", "--known", weighed, "--out", "c.yaml", "--json", env=env, cwd=tmp_path
    )
    assert reported.returncode == 0, reported.stderr
    estimates = json_of(reported.stdout)["estimates"]
    true = {"mass": world.mass, "thrust": craft.actuators.thrust}
    true |= dict(zip(("roll_inertia", "pitch_inertia", "yaw_inertia"), world.inertia, strict=False))
    for name, value in true.items():
        assert estimates[name]["value"] == pytest.approx(float(value), rel=0.01), name
    for axis, value in zip("xyz", world.com, strict=True):
        assert estimates[f"center_of_mass_{axis}"]["value"] == pytest.approx(float(value), abs=0.001)
    again = ("--calibration", "c.yaml", "--controller", "lqr", "--lockstep", "--duration", "2", "--json")
    done = fulmar("run", craft.name, *again, "--record", "next", env=env, cwd=tmp_path)
    assert "run failed" not in done.stderr
    assert read_run(tmp_path / "next").info["calibration"] == str(tmp_path / "c.yaml")


@pytest.mark.slow
def test_a_calibrated_run_says_so_in_its_bag_and_needs_a_file_for_its_own_robot(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    (tmp_path / "c.yaml").write_text("robot: floating_platform\nmass: {value: 6.0, low: 5.9, high: 6.1}\n")
    asked = (
        "--controller",
        "lqr",
        "--lockstep",
        "--duration",
        "2",
        "--calibration",
        "c.yaml",
        "--record",
        "bag",
    )
    done = fulmar("run", "floating_platform", *asked, "--json", env=ros_domain.env, cwd=tmp_path)
    assert "run failed" not in done.stderr
    assert read_run(tmp_path / "bag").info["calibration"] == str(tmp_path / "c.yaml")
    wrong = fulmar("run", "modular_freeflyer", "--calibration", "c.yaml", env=ros_domain.env, cwd=tmp_path)
    assert wrong.returncode == 2
    assert "is for 'floating_platform', not for 'modular_freeflyer'" in wrong.stderr
