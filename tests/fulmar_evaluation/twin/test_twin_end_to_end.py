"""`fulmar twin` on the bag of a platform that drove in MuJoCo with less thrust, more mass and a delay."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from fulmar_core.loop.policy_bundle import read_passport
from fulmar_core.robots.calibration import load_calibration
from fulmar_core.robots.robot_file import load_robot

pytest.importorskip("mujoco")
pytest.importorskip("stable_baselines3")

from tests.benchmarks.identification.driving import Leg, Machine, drive

pytestmark = pytest.mark.slow

TRUTH = {"thrust": 0.75, "mass": 1.3 * 5.32, "yaw_inertia": 1.3 * 0.2045}
DELAY_S = 0.16  # with which the shipped policy fails


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """Half a minute of random commands."""
    nominal = load_robot("floating_platform")
    machine = Machine(
        robot=replace(nominal, actuators=replace(nominal.actuators, thrust=TRUTH["thrust"])),
        legs=(Leg("bare", TRUTH["mass"], TRUTH["yaw_inertia"], (0.0, 0.0)),),
        truth=TRUTH,
        delay_s=DELAY_S,
        gain=(1.0,) * 8,
    )
    folder = tmp_path_factory.mktemp("driven") / "bag"
    return drive(machine, machine.legs[0], nominal, folder, seed=4, duration_s=30.0)


def test_from_a_bag_to_a_bundle_and_again_without_doing_anything(fulmar, bag, tmp_path):
    out = tmp_path / "twin"
    words = ("twin", bag, "--task", "go_to_pose", "--known", "mass=6.916+-0.01", "--out", out, "--json")
    words += ("--updates", 2, "--episodes", 4, "--retrain-below", 1.0)
    code, printed, _ = fulmar(*words)
    report = json.loads(printed)
    assert code == int(not report["better"])
    for name, truth in TRUTH.items():
        assert report["estimates"][name]["value"] == pytest.approx(truth, rel=0.03), name
    assert report["estimates"]["delay"]["value"] == pytest.approx(DELAY_S, abs=0.015)
    assert load_calibration(out / "calibration.yaml").thrust.value == pytest.approx(0.75, rel=0.03)
    assert report["training"]["updates"] == 2
    assert read_passport(out / "bundles" / "floating_platform_go_to_pose").sha256 == report["new"]["sha256"]
    assert "holds no" in report["reruns"][0]["skipped"]  # the bag has poses and valves, and no goal
    code, printed, lines = fulmar(*words)
    assert lines.count("nothing has changed") == 6
    assert json.loads(printed) == report


def test_a_bag_too_short_to_identify_is_rejected_in_one_line(fulmar, tmp_path, bag):
    nominal = load_robot("floating_platform")
    machine = Machine(nominal, (Leg("bare", 5.32, 0.2045, (0.0, 0.0)),), {}, 0.0, (1.0,) * 8)
    short = drive(machine, machine.legs[0], nominal, tmp_path / "short", seed=1, duration_s=1.0)
    code, printed, errors = fulmar("twin", short, "--task", "go_to_pose", "--out", tmp_path / "twin")
    assert (code, printed) == (2, "")
    said = [line for line in errors.splitlines() if line.startswith("fulmar: ")]
    assert len(said) == 1
    assert "the longest of 1 runs has 1.0 s" in said[0]
