"""A certified set: fitted to episodes, shrunk and tested on others; what is written, read and refused."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fulmar_bringup.envelope_check import envelope_note
from fulmar_cli.diagnosis.installation import check_envelopes
from fulmar_core.config.errors import BundleError, ConfigError
from fulmar_core.config.source_hash import robot_sha256
from fulmar_core.loop.policy_bundle import SIGNATURE, read_passport
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.certified_set import CertifiedSet
from fulmar_core.safety.declared_conditions import certified_body, declared_conditions
from fulmar_core.simulation.episode import draw_episodes
from fulmar_core.tasks import load_task
from fulmar_evaluation.certify.conditions import Conditions, axes_of, scenario_of
from fulmar_evaluation.certify.confidence import alpha_of, lower_bound
from fulmar_evaluation.certify.document import write_into_passport
from fulmar_evaluation.certify.fit import fit_score
from fulmar_evaluation.certify.procedure import Sizes, certify
from fulmar_evaluation.certify.sets import Box, ScoreSet, outer_sample
from tests.fulmar_cli.command_line import SHIPPED

AXES = 3
PAIRS = {
    "floating_platform": "go_to_pose",
    "kingfisher": "go_to_position",
    "spacecraft_16": "go_to_pose_3d",
    "cubesat_wheels": "slew",
    "airship_v7": "fly_hold",
}


LIGHT = {"linear": [1.0, 2.0], "quadratic": [[0.0, 1.0], [0.0, 3.0]]}


def chance(shares: np.ndarray) -> np.ndarray:
    """A known chance of success: falls with the first two axes together, and not with the third."""
    hard = 2.0 * shares[:, 0] + shares[:, 1] + 2.0 * shares[:, 0] * shares[:, 1]
    return np.where(hard < 1.0, 0.99, np.maximum(0.99 - 1.5 * (hard - 1.0), 0.0))


def world(seed: int):
    rng = np.random.default_rng(seed)
    return lambda shares: rng.random(len(shares)) < chance(shares)


def a_document(**changes) -> dict:
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
        "score": {"weights": LIGHT, "threshold": 1.0},
        "lower_bound": 0.96,
        "confidence": 0.95,
    } | changes


SMALL = {  # a set that the platform of the shipped file leaves by its mass
    "box": {"mass": [1.0, 1.05], "delay": [0.0, 0.05]},
    "score": {"weights": LIGHT, "threshold": 0.05},
}


@pytest.mark.parametrize("seed", range(3))
def test_a_known_set_is_found_and_its_bounds_hold_on_fresh_conditions(seed):
    found = certify(world(seed), AXES, Sizes.of(1000, mujoco=0), seed)
    for certified in (found.score, found.box):
        assert certified is not None
        assert certified.lower_bound >= 0.95
        rng = np.random.default_rng(100 + seed)
        assert chance(certified.set.sample(rng, 20_000)).mean() >= certified.lower_bound
        assert chance(outer_sample(certified.set, rng, 5000)).mean() >= 0.90
    assert found.box.set.high[2] > found.box.set.high[0]  # the third axis costs nothing


def test_a_set_that_is_good_nowhere_is_no_certified_set():
    rng = np.random.default_rng(0)
    found = certify(lambda shares: rng.random(len(shares)) < 0.8, AXES, Sizes.of(200, mujoco=0), 1)
    assert found.score is None and found.box is None
    assert "lower bound of 0.95" in found.reason
    never = certify(lambda shares: np.zeros(len(shares), dtype=bool), AXES, Sizes.of(100, mujoco=0), 1)
    assert "none of" in never.reason


def test_the_score_grows_on_every_axis():
    rng = np.random.default_rng(2)
    shares = rng.random((3000, AXES))
    fit = fit_score(shares, rng.random(3000) < chance(shares))
    harder = np.minimum(shares + 0.1, 1.0)
    assert (fit.score(harder) >= fit.score(shares)).all()
    assert fit.linear.min() >= 0.0 and fit.quadratic.min() >= 0.0


def test_the_bound_is_too_high_no_more_often_than_it_says():
    successes = np.random.default_rng(3).binomial(500, 0.95, 4000)
    too_high = np.mean([lower_bound(int(count), 500, 0.05) > 0.95 for count in successes])
    assert too_high <= 0.055
    assert lower_bound(0, 10, 0.05) == 0.0
    assert lower_bound(500, 500, 0.05) == pytest.approx(0.05 ** (1 / 500))


def test_tests_together_spend_no_more_than_the_whole_chance_of_error():
    assert sum(alpha_of(test, 0.05) for test in range(50)) <= 0.05
    assert alpha_of(1, 0.05) < alpha_of(0, 0.05)


def test_points_of_a_score_lie_inside_and_a_shrunk_set_has_its_share_of_the_volume():
    rng = np.random.default_rng(4)
    whole = ScoreSet(np.array([1.0, 0.5]), np.array([[2.0, 1.0], [0.0, 0.0]]), 0.3)
    points = whole.sample(rng, 5000)
    assert whole.contains(points).all()
    assert whole.shrunk(0.8, rng).volume(rng) == pytest.approx(0.8 * whole.volume(rng), rel=0.05)
    assert Box(np.array([0.5, 0.4])).shrunk(0.5, rng).volume == pytest.approx(0.1)


def test_walks_draw_as_evenly_as_rejection_does():
    rng = np.random.default_rng(5)
    thin = ScoreSet(
        np.array([1.0, 0.5, 2.0]), np.array([[2.0, 1.0, 0.0], [0.0, 0.0, 3.0], [0.0, 0.0, 0.0]]), 0.9
    )
    walked = thin._walk(rng, 20_000)
    rejected = rng.random((200_000, 3))
    rejected = rejected[thin.contains(rejected)]
    assert thin.contains(walked).all()
    assert walked.mean(axis=0) == pytest.approx(rejected.mean(axis=0), rel=0.03)
    assert np.quantile(thin.score(walked), 0.5) == pytest.approx(
        np.quantile(thin.score(rejected), 0.5), rel=0.03
    )


@pytest.mark.parametrize(("robot", "task"), PAIRS.items())
def test_the_easiest_conditions_are_the_nominal_body_at_rest(robot, task):
    its, job = load_robot(robot), load_task(task)
    axes = axes_of(its, job)
    easy = Conditions(its, axes, np.zeros((4, len(axes))), 0, 7)
    drawn = draw_episodes(its, job, scenario_of(axes), seed=7, numbers=np.arange(4), alter=easy)
    assert drawn.world.mass == pytest.approx([its.body.mass] * 4)
    assert drawn.world.action_delay == pytest.approx([0.0] * 4)
    if "distance" in {axis.name for axis in axes}:
        assert drawn.start.distance_to(drawn.goal.current) == pytest.approx([0.0] * 4, abs=1e-9)


def test_conditions_are_what_the_shares_say():
    its, job = load_robot("floating_platform"), load_task("go_to_pose")
    axes = axes_of(its, job)
    hard = Conditions(its, axes, np.ones((64, len(axes))), 10, 7)
    drawn = draw_episodes(its, job, scenario_of(axes), seed=7, numbers=10 + np.arange(64), alter=hard)
    high = {axis.name: axis.high for axis in axes}
    start, place = drawn.start, drawn.world
    assert start.distance_to(drawn.goal.current) == pytest.approx([high["distance"]] * 64)
    assert start.speed == pytest.approx([high["speed"]] * 64)
    assert np.abs(start.yaw_rate) == pytest.approx([high["turn_rate"]] * 64)
    assert np.hypot(place.force_x, place.force_y) == pytest.approx([high["force"]] * 64)
    assert np.hypot(place.com_x, place.com_y) == pytest.approx([high["center_of_mass"]] * 64)
    factors = place.mass / its.body.mass
    assert set(np.round(factors, 6)) == {0.5, 2.0}
    assert place.gain == pytest.approx(np.full((8, 64), 1.0 - high["thrust_loss"]))


def test_dead_actuators_are_as_many_as_asked_for_and_not_always_the_same():
    its, job = load_robot("floating_platform"), load_task("go_to_pose")
    axes = axes_of(its, job)
    dead = Conditions(its, axes, np.zeros((64, len(axes))), 0, 7, dead=2)
    alive = draw_episodes(its, job, scenario_of(axes), seed=7, numbers=np.arange(64), alter=dead).world.alive
    assert (alive.sum(axis=0) == 6).all()
    assert (alive.min(axis=1) == 0.0).sum() == 8


def test_a_task_with_waypoints_is_refused():
    with pytest.raises(ConfigError, match="waypoints"):
        axes_of(load_robot("turtlebot2"), load_task("go_through_positions"))


def test_membership_and_box_of_a_document():
    found = CertifiedSet.from_plain(a_document(), "here")
    assert found.shares({"mass": 1.5}) == pytest.approx([0.5, 0.0])
    assert found.inside(found.shares({"mass": 1.5, "delay": 0.02}))
    assert not found.inside(found.shares({"mass": 1.5, "delay": 0.2}))
    assert found.beyond({"mass": 1.6, "delay": 0.05, "drag": 9.0}) == ("mass 1.6 x is beyond 1.5 x",)
    assert (
        found.outside({"mass": 1.6, "drag": 9.0}) == ()
    )  # beyond the box, and yet inside with nothing else hard
    assert found.outside({"mass": 2.4}) == ("mass 2.4 x is beyond 2 x",)
    assert found.outside({"mass": 1.6, "delay": 0.1}) != ()
    with pytest.raises(ConfigError, match=r"out of the axis' range, 0 to 0\.2"):
        found.shares({"delay": 0.3})
    with pytest.raises(ConfigError, match="Did you mean 'mass'"):
        found.shares({"mas": 1.0})


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"format": 9}, "has format 9"),
        ({"box": {"mass": [1.0, 3.0], "delay": [0.0, 0.05]}}, "leaves"),
        ({"score": {"weights": {"linear": [1.0], "quadratic": [[1.0]]}, "threshold": 1.0}}, "2 linear"),
        ({"axes": [{"name": "mass", "low": 2.0, "high": 1.0, "unit": "x"}]}, "low 2 and high 1"),
        ({"box": None}, "no meaning"),
    ],
)
def test_a_document_without_meaning_is_refused_in_one_line(changes, words):
    with pytest.raises(ConfigError, match=words) as caught:
        CertifiedSet.from_plain(a_document(**changes), "here")
    assert "\n" not in str(caught.value)


@pytest.fixture
def bundle(tmp_path) -> Path:
    """The shipped bundle without its certified set."""
    folder = Path(shutil.copytree(SHIPPED, tmp_path / "bundle"))
    values = json.loads((folder / "passport.json").read_text())
    values["sha256"] = values.pop("envelope")["controller"]
    (folder / "passport.json").write_text(json.dumps(values))
    return folder


def test_a_passport_holds_the_set_inside_its_hash_and_loses_its_signature(bundle):
    before = read_passport(bundle)
    (bundle / SIGNATURE).write_text("{}")
    assert "Its signature is gone" in write_into_passport(bundle, a_document())
    after = read_passport(bundle)
    assert not (bundle / SIGNATURE).exists()
    assert after.envelope["box"]["mass"] == [1.0, 1.5]
    assert after.sha256 != before.sha256
    assert replace(after, envelope=None).expected_sha256() == before.sha256
    values = json.loads((bundle / "passport.json").read_text())
    values["envelope"]["lower_bound"] = 0.999
    (bundle / "passport.json").write_text(json.dumps(values))
    with pytest.raises(BundleError, match="was changed after export"):
        read_passport(bundle)


def test_a_robot_outside_of_the_set_is_warned_of_and_refused_where_that_is_asked_for(bundle):
    robot = load_robot("floating_platform")
    assert envelope_note(str(bundle), robot, "go_to_pose", required=False) == ""
    with pytest.raises(BundleError, match="has no certified set"):
        envelope_note(str(bundle), robot, "go_to_pose", required=True)
    write_into_passport(bundle, a_document(**SMALL))
    assert declared_conditions(robot, certified_body(robot))["mass"] > 1.05
    assert "mass" in envelope_note(str(bundle), robot, "go_to_pose", required=False)
    with pytest.raises(BundleError, match="outside of its certified set"):
        envelope_note(str(bundle), robot, "go_to_pose", required=True)
    write_into_passport(bundle, a_document())
    assert envelope_note(str(bundle), robot, "go_to_pose", required=True) == ""


def test_a_set_of_another_robot_or_core_is_named(bundle):
    robot = load_robot("floating_platform")
    write_into_passport(bundle, a_document(robot="kingfisher"))
    with pytest.raises(BundleError, match="is of robot 'kingfisher', not 'floating_platform'"):
        envelope_note(str(bundle), robot, "go_to_pose", required=False)
    write_into_passport(bundle, a_document(hashes={"robot": "0", "core": "0", "backup": ""}))
    line = envelope_note(str(bundle), robot, "go_to_pose", required=False)
    assert "the file of 'floating_platform' was changed since" in line
    write_into_passport(bundle, a_document(hashes={"robot": robot_sha256("floating_platform"), "core": "0"}))
    assert envelope_note(str(bundle), robot, "go_to_pose", required=False) == ""
    with pytest.raises(BundleError, match="another version of Fulmar's core") as caught:
        envelope_note(str(bundle), robot, "go_to_pose", required=True)
    assert "--again --write" in str(caught.value)


def test_the_doctor_names_what_is_outside(bundle, monkeypatch):
    monkeypatch.setattr("policy_server.controllers.shipped_policies", lambda: [bundle])
    assert check_envelopes().found == "none"
    write_into_passport(bundle, a_document())
    assert (check_envelopes().level, check_envelopes().found) == ("ok", "bundle")
    write_into_passport(bundle, a_document(**SMALL))
    assert check_envelopes().level == "advice"
    assert "bundle: mass" in check_envelopes().found


def test_a_bundle_check_says_where_the_robot_lies(bundle, fulmar):
    for document, state in ((None, "none"), (a_document(), "inside")):
        if document is not None:
            write_into_passport(bundle, document)
        code, out, _ = fulmar("bundle", "check", bundle, "--json")
        assert (code, json.loads(out)["envelope"]) == (0, state)
    write_into_passport(bundle, a_document(**SMALL))
    code, out, err = fulmar("bundle", "check", bundle, "--json")
    assert (code, json.loads(out)["envelope"]) == (0, "outside")
    assert "outside of its certified set" in err
    code, _, err = fulmar("bundle", "check", bundle, "--require-envelope")
    assert code == 2 and "outside of its certified set" in err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("lqrr --robot floating_platform --task go_to_pose", "Did you mean 'lqr'"),
        ("lqr --task go_to_pose", "needs --robot"),
        ("lqr --robot floating_platform --task go_to_pose --dead 8", "give 0 to 7"),
        ("lqr --robot floating_platform --task go_to_pose --write", "is a law"),
        ("lqr --robot floating_platform --task go_to_pose --backup no.json", "is not certified"),
        ("excite --robot floating_platform --task go_to_pose", "strives for no goal"),
        (f"{SHIPPED} --robot kingfisher", "was trained for robot"),
    ],
)
def test_bad_input_ends_with_one_line(fulmar, words, said):
    code, _, err = fulmar("certify", *words.split())
    assert code == 2
    assert said in err
    assert len(err.strip().splitlines()) == 1


@pytest.mark.slow
def test_a_short_certification_of_the_platform_has_every_key(fulmar, tmp_path):
    words = "lqr --robot floating_platform --task go_to_pose --episodes 200 --mujoco 10 --json"
    plot, file = tmp_path / "envelope.png", tmp_path / "envelope.json"
    code, out, _ = fulmar("certify", *words.split(), "--plot", plot, "--out", file)
    assert code == 0
    found = json.loads(out)
    assert found["lower_bound"] >= 0.95 and found["edge"]["mean"] >= 0.90
    assert found["mujoco"]["episodes"] == 10
    assert {"robot", "core", "backup"} == found["hashes"].keys()
    assert CertifiedSet.from_plain(json.loads(file.read_text()), "file").controller == "lqr"
    assert plot.stat().st_size > 10_000


@pytest.mark.slow
def test_the_policy_of_the_platform_is_certified_at_full_size(fulmar):
    words = "policy --robot floating_platform --task go_to_pose --json"
    code, out, _ = fulmar("certify", *words.split())
    found = json.loads(out)
    assert code == 0
    assert found["episodes"] == 2000 and found["lower_bound"] >= 0.95
    assert found["mujoco"]["episodes"] == 500 and found["mujoco"]["lower_bound"] >= 0.95
    assert found["edge"]["mean"] >= 0.90
    assert found["cpu_s"] <= 180.0
