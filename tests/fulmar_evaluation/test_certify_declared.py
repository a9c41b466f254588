"""Whether a robot lies inside the certified set that its bundle came with: as shipped, and as identified."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fulmar_bringup.core_probe import alike, ends_of
from fulmar_bringup.envelope_check import envelope_note, envelope_problems, other_core
from fulmar_cli.diagnosis.installation import check_envelopes
from fulmar_core.config.source_hash import core_sha256, robot_sha256
from fulmar_core.loop.policy_bundle import read_passport
from fulmar_core.robots.calibration import Calibration, Measured, calibrated
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.certified_set import CertifiedSet, set_of_bundle
from fulmar_core.safety.declared_conditions import certified_body, declared_conditions
from fulmar_core.tasks import load_task
from fulmar_evaluation.certify import again
from fulmar_evaluation.certify.conditions import axes_of
from fulmar_evaluation.certify.document import plain_axes, write_into_passport
from fulmar_evaluation.certify.procedure import Run, Sizes
from policy_server.controllers import Choice, load_controller, shipped_policies, shipped_policy

PAIRS = {
    "floating_platform": "go_to_pose",
    "spacecraft_16": "go_to_pose_3d",
    "kingfisher": "go_to_position",
    "airship_v7": "fly_hold",
}
CERTIFIED = [folder for folder in shipped_policies() if read_passport(folder).envelope is not None]
BOX = {"mass": [1.0, 1.5], "inertia": [1.0, 2.0], "delay": [0.0, 0.05]}
HALF = {"linear": [0.2, 0.5, 2.0], "quadratic": [[0.0] * 3] * 3}


@pytest.fixture
def certified(tmp_path) -> Path:
    """A copy of the bundle of the platform with a set of today's core, whose box ends before its inertia."""
    robot, folder = load_robot("floating_platform"), tmp_path / "certified"
    shutil.copytree(shipped_policy(robot.name, "go_to_pose"), folder)
    axes = [axis for axis in plain_axes(axes_of(robot, load_task("go_to_pose"))) if axis["name"] in BOX]
    document = {
        "format": 1,
        "robot": robot.name,
        "task": "go_to_pose",
        "controller": "policy",
        "body": certified_body(robot),
        "axes": axes,
        "box": BOX,
        "score": {"weights": HALF, "threshold": 1.0},
        "lower_bound": 0.96,
        "confidence": 0.95,
        "hashes": {"robot": robot_sha256(robot.name), "core": core_sha256(), "backup": ""},
    }
    write_into_passport(folder, document)
    return folder


def measured(value: float) -> Measured:
    return Measured(value, 0.99 * value, 1.01 * value)


def test_a_robot_as_identified_is_compared_with_the_body_that_was_certified():
    robot = load_robot("floating_platform")
    weak = Calibration(robot.name, thrust=measured(0.75), mass=measured(1.3 * 5.32), delay=measured(0.14))
    found = declared_conditions(calibrated(robot, weak), certified_body(robot))
    assert found["mass"] == pytest.approx(1.3 * 1.01)
    assert found["thrust_loss"] == pytest.approx(0.25)
    assert found["delay"] == pytest.approx(0.14)


def test_a_boat_as_identified_has_the_drag_that_was_measured():
    robot = load_robot("kingfisher")
    quadratic = robot.hydrodynamics.quadratic_damping
    drags = Calibration(robot.name, surge_quadratic_drag=measured(2.0 * quadratic[0]))
    assert declared_conditions(robot, certified_body(robot))["drag"] == pytest.approx(1.0 / 0.9)
    assert declared_conditions(calibrated(robot, drags), certified_body(robot))["drag"] > 1.2


@pytest.mark.parametrize("folder", CERTIFIED, ids=lambda folder: folder.name)
def test_shipped_bundles_with_a_set_hold_their_robots(folder):
    passport = read_passport(folder)
    robot = load_robot(passport.robot)
    found = set_of_bundle(passport.envelope, robot, passport.task, str(folder))
    assert envelope_problems(folder, robot, passport.task) == ()
    assert found.lower_bound >= 0.95 and found.plain["edge"]["mean"] >= 0.90
    assert found.plain["episodes"] >= 2000
    assert (folder / "passport.json").stat().st_size < 16_000


def test_a_robot_inside_is_so_for_every_command_that_asks(certified, fulmar, monkeypatch):
    code, out, err = fulmar("bundle", "check", certified, "--require-envelope", "--json")
    said = json.loads(out)
    assert (code, said["envelope"], err) == (0, "inside", "")
    assert said["beyond_box"] == ["inertia 3.41 x is beyond 2 x"]
    assert envelope_note(str(certified), load_robot("floating_platform"), "go_to_pose", required=True) == ""
    monkeypatch.setattr("policy_server.controllers.shipped_policies", lambda: [certified])
    assert (check_envelopes().level, check_envelopes().found) == ("ok", "certified")


def test_a_set_of_another_core_is_named_and_refused_only_where_a_set_is_required(
    certified, fulmar, monkeypatch
):
    folder = certified
    monkeypatch.setattr("fulmar_bringup.envelope_check.core_sha256", lambda: "other")
    monkeypatch.setattr("policy_server.controllers.shipped_policies", lambda: [folder])
    code, out, err = fulmar("bundle", "check", folder, "--json")
    assert (code, json.loads(out)["envelope"]) == (0, "inside")
    assert "another version of Fulmar's core" in err
    code, _, err = fulmar("bundle", "check", folder, "--require-envelope")
    assert code == 2 and "--again --write" in err
    assert check_envelopes().level == "advice" and "another version" in check_envelopes().found


def test_other_sources_that_move_the_robot_alike_leave_a_set_valid(certified, monkeypatch):
    envelope = read_passport(certified).envelope
    envelope["hashes"]["core"] = "of other sources"
    robot, task = load_robot("floating_platform"), load_task("go_to_pose")
    policy = load_controller(
        "policy", robot, task, Choice(read_passport(certified).control_hz, str(certified))
    )
    write_into_passport(certified, envelope | {"probe": ends_of(policy, robot, task)})
    assert other_core(certified) == ""
    heavier = replace(robot, body=replace(robot.body, mass=1.05 * robot.body.mass))
    write_into_passport(certified, envelope | {"probe": ends_of(policy, heavier, task)})
    assert "moves the robot otherwise" in other_core(certified)


@pytest.mark.parametrize("record", [None, "text", [[0.0, 0.0]], [["a", 0.0, 0.0]] * 8])
def test_a_record_that_is_none_is_of_no_core(record):
    assert not alike(record, [[0.0, 0.0, 0.0]] * 8)


def test_one_episode_in_which_a_rounding_opened_a_valve_later_does_not_count():
    before = [[0.0, 0.0, 0.0]] * 8
    assert alike(before, [[0.01, 0.0, 0.0], *before[1:]])
    assert not alike(before, [[0.01, 0.0, 0.0]] * 2 + before[2:])


def test_a_platform_with_a_payload_is_outside(certified):
    robot, folder = load_robot("floating_platform"), certified
    late = calibrated(robot, Calibration(robot.name, delay=measured(0.14), mass=measured(1.9 * 5.32)))
    problems = "; ".join(envelope_problems(folder, late, "go_to_pose"))
    assert "delay" in problems and "mass" in problems


@pytest.mark.parametrize(("robot", "task"), PAIRS.items())
def test_axes_reach_as_far_as_the_robots_file_declares(robot, task):
    its = load_robot(robot)
    ends = {axis.name: axis.high for axis in axes_of(its, load_task(task))}
    for name, value in declared_conditions(its, certified_body(its)).items():
        assert value <= ends.get(name, value) + 1e-9, name


def test_only_a_bundle_with_a_set_is_tested_again(fulmar, tmp_path):
    code, _, err = fulmar("certify", "lqr", "--robot", "floating_platform", "--task", "go_to_pose", "--again")
    assert code == 2 and "give --out" in err
    bare = tmp_path / "bare"
    shutil.copytree(shipped_policy("floating_platform", "go_to_position"), bare)
    code, _, err = fulmar("certify", bare, "--again", "--mujoco", 0)
    assert code == 2 and "has no certified set" in err


def a_set() -> dict:
    return {
        "format": 1,
        "robot": "floating_platform",
        "task": "go_to_pose",
        "controller": "lqr",
        "axes": [
            {"name": "mass", "low": 1.0, "high": 2.0, "unit": "x"},
            {"name": "delay", "low": 0.0, "high": 0.2, "unit": "s"},
        ],
        "box": {"mass": [1.0, 1.5], "delay": [0.0, 0.05]},
        "score": {"weights": {"linear": [1.0, 2.0], "quadratic": [[0.0, 1.0], [0.0, 3.0]]}, "threshold": 1.0},
        "lower_bound": 0.96,
        "confidence": 0.95,
    }


def test_a_known_set_is_tested_and_kept_only_where_its_bounds_hold():
    rng, known = np.random.default_rng(1), CertifiedSet.from_plain(a_set(), "here")

    def run(chance: float) -> Run:
        return lambda shares: rng.random(len(shares)) < chance

    sizes = Sizes.of(1000, mujoco=0)
    held = again.tested_again(known, run(0.99), sizes, 1)
    assert held.score is not None and held.score.lower_bound >= 0.95 and held.box is not None
    assert held.score.set.threshold == known.threshold and held.box.set.high == pytest.approx([0.5, 0.25])
    fallen = again.tested_again(known, run(0.95), sizes, 1)
    assert fallen.score is None and "no longer meets its bounds" in fallen.reason


@pytest.mark.slow
def test_a_law_tested_again_keeps_its_set_and_the_hash_of_its_backup(fulmar, tmp_path):
    robot, file = load_robot("floating_platform"), tmp_path / "envelope.json"
    axes = plain_axes(axes_of(robot, load_task("go_to_pose")))
    weights = {"linear": [1.0] * len(axes), "quadratic": [[0.0] * len(axes)] * len(axes)}
    known = a_set() | {"controller": "lqr", "axes": axes, "score": {"weights": weights, "threshold": 0.3}}
    known["box"] = {axis["name"]: [axis["low"], axis["low"]] for axis in axes}
    known["hashes"] = {"robot": "0", "core": "0", "backup": "of another law"}
    file.write_text(json.dumps(known))
    words = "lqr --robot floating_platform --task go_to_pose --again --episodes 200 --mujoco 0 --json --out"
    code, _, _ = fulmar("certify", *words.split(), file)
    found = json.loads(file.read_text())
    assert code == 0 and found["score"] == known["score"]
    assert found["hashes"] == {
        "robot": robot_sha256(robot.name),
        "core": core_sha256(),
        "backup": "of another law",
    }


@pytest.mark.slow
@pytest.mark.parametrize("folder", CERTIFIED, ids=lambda folder: folder.name)
def test_shipped_sets_still_hold_in_the_batch(folder, fulmar, tmp_path):
    mine = Path(shutil.copytree(folder, tmp_path / "bundle"))
    before = read_passport(mine).envelope
    code, out, _ = fulmar("certify", mine, "--again", "--write", "--mujoco", 0, "--json")
    found = json.loads(out)
    assert code == 0 and found["lower_bound"] >= 0.95 and found["edge"]["mean"] >= 0.90
    assert (found["score"], found["box"]) == (before["score"], before["box"])
    assert other_core(mine) == ""
