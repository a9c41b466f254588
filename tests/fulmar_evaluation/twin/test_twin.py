"""The steps of a twin in their order, with stubs in place of training and of episodes in MuJoCo."""

from __future__ import annotations

import json
import os
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from fulmar_bags.bag_reading import AS_IT_IS
from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.calibration import Calibration, Measured, calibration_in_use
from fulmar_core.robots.robot_file import load_robot
from fulmar_evaluation.certify.document import write_into_passport
from fulmar_evaluation.identification.fit import Estimate, Fit
from fulmar_evaluation.identification.identify import Identified
from fulmar_evaluation.identified_bags import IdentifiedRobot
from fulmar_evaluation.twin import twin
from fulmar_evaluation.twin.report import page_of
from fulmar_evaluation.twin.request import TwinRequest
from policy_server.controllers import shipped_policy

ROBOT, TASK = "floating_platform", "go_to_pose"
OLD = shipped_policy(ROBOT, TASK)
NEW = shipped_policy(ROBOT, "go_to_position")  # stands for what is trained: another intact bundle


def found(thrust=0.75, undetermined=()):
    estimates = {
        "thrust": Estimate("thrust", thrust, thrust - 0.01, thrust + 0.01, "N"),
        "mass": Estimate("mass", 6.9, 6.8, 7.0, "kg"),
    }
    identified = Identified(
        Fit(estimates, (0.001, 0.001, 0.002), 12, 6000), "mass and thrust rest on a known mass", True,
        ("x_m", "y_m", "heading_rad"), undetermined, {"thrust": 1.0, "mass": 5.32},
    )  # fmt: skip
    calibration = Calibration(ROBOT, thrust=Measured(thrust, thrust - 0.01, thrust + 0.01))
    return IdentifiedRobot(load_robot(ROBOT), ("driven",), 120.0, identified, calibration, ())


class Stubs:
    """What the long steps would do, and a record of what was asked of them."""

    def __init__(self, monkeypatch, request):
        self.asked, self.rates, self.found, self.updates = [], {"old": 0.5, "new": 0.99}, found(), 3
        monkeypatch.setattr(twin, "identify_bags", self.identify)
        monkeypatch.setattr(twin, "plan_trial", lambda **given: given)
        monkeypatch.setattr(twin, "trial_figures", self.figures)
        monkeypatch.setattr(twin, "training_job", self.job)
        monkeypatch.setattr(twin, "train_bundle", self.train)
        monkeypatch.setattr(twin, "bag_answers", self.answers)
        self.request, self.lines = request, []

    def identify(self, *bags, **more):
        self.asked.append("identify")
        return self.found

    def figures(self, trial):
        which = "old" if trial["policy"] == self.request.policy else "new"
        self.asked.append((which, calibration_in_use().thrust.value, load_robot(ROBOT).actuators.thrust))
        error = {"mean": 0.05 if which == "old" else 0.01}
        rate = self.rates[which]
        return {"success_rate": rate, "episodes": trial["episodes"], "final_position_error_m": error}

    def job(self, robot, task, *, updates, runs, bundles, command):
        self.bundle = bundles / f"{robot}_{task}"
        return type("Job", (), {"recipe": "abc", "updates": updates or self.updates, "seed": 1})()

    def train(self, job):
        self.asked.append("train")
        shutil.copytree(NEW, self.bundle, dirs_exist_ok=True)
        return {"run": "run", "updates": job.updates, "steps": 1000, "wall_s": 1.0}

    def answers(self, bags, old, new, **more):
        self.asked.append("answers")
        return [{"bag": str(bags[0]), "steps": 10, "asked": 10, "differing": 0.25}]

    def run(self, **changes):
        self.asked.clear()
        return twin.run_twin(replace(self.request, **changes), self.lines.append)


@pytest.fixture
def stubs(monkeypatch, tmp_path):
    monkeypatch.setenv("FULMAR_CALIBRATION", "")
    bag = tmp_path / "driven"
    bag.mkdir()
    (bag / "driven.mcap").write_bytes(b"a bag")
    request = TwinRequest(
        (bag,),
        tmp_path / "twin",
        OLD,
        ROBOT,
        TASK,
        ("mass=6.9",),
        (),
        AS_IT_IS,
        0.9,
        None,
        256,
        None,
        "fulmar",
    )
    return Stubs(monkeypatch, request)


def test_a_bundle_that_has_fallen_is_trained_again_on_the_robot_as_identified(stubs):
    report = stubs.run()
    assert stubs.asked == ["identify", ("old", 0.75, 0.75), "train", ("new", 0.75, 0.75), "answers"]
    assert os.environ["FULMAR_CALIBRATION"] == ""
    assert report["better"]
    assert report["gain"]["value"] == pytest.approx(0.49)
    assert report["gain"]["low"] > 0.4
    assert report["estimates"]["thrust"]["ratio"] == pytest.approx(0.75)
    assert report["noise"]["x_m"]["low"] < 0.001 < report["noise"]["x_m"]["high"]
    assert report["figures"] == {"final_position_error_m": {"old": 0.05, "new": 0.01}}
    assert "better by 0.490" in report["result"]


def test_the_report_says_whether_the_robot_lies_in_the_certified_set_of_each_bundle(
    stubs, monkeypatch, tmp_path
):
    old = Path(shutil.copytree(OLD, tmp_path / "old"))
    write_into_passport(old, {"robot": ROBOT})
    stubs.request = replace(stubs.request, policy=old)
    monkeypatch.setattr(twin, "envelope_problems", lambda folder, robot, task: ("delay",))
    report = stubs.run()
    assert report["old"]["envelope"] == {"inside": False, "problems": ["delay"]}
    assert report["new"]["envelope"] is None
    assert "outside: delay" in page_of(report) and "it has none" in page_of(report)


def test_what_is_done_is_not_done_again(stubs):
    first = stubs.run()
    assert stubs.run() == first
    assert stubs.asked == []
    assert len(list(stubs.request.out.glob("*.json"))) == len(twin.STEPS)


def test_after_an_interrupt_only_the_missing_steps_are_done(stubs, monkeypatch):
    def stop(job):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(twin, "train_bundle", stop)
        with pytest.raises(KeyboardInterrupt):
            stubs.run()
    stubs.run()
    assert stubs.asked == ["train", ("new", 0.75, 0.75), "answers"]


def test_another_bag_begins_from_its_start_and_other_updates_from_the_training(stubs):
    stubs.run()
    stubs.run(updates=5)
    assert stubs.asked == ["train"]  # and the same bundle came of it
    (stubs.request.bags[0] / "driven.mcap").write_bytes(b"another bag")
    stubs.found = found(thrust=0.7)
    stubs.run(updates=5)
    assert stubs.asked == ["identify", ("old", 0.7, 0.7), "train", ("new", 0.7, 0.7), "answers"]


def test_a_bundle_that_still_succeeds_stays(stubs):
    stubs.rates["old"] = 0.95
    report = stubs.run()
    assert stubs.asked == ["identify", ("old", 0.75, 0.75)]
    assert report["new"] is None
    assert not report["better"]
    assert "it stays" in report["result"]
    assert "No training" in (stubs.request.out / "report.md").read_text()
    assert stubs.run(retrain_below=0.97)["better"]


def test_a_new_bundle_within_chance_of_the_old_one_is_not_better(stubs):
    stubs.rates = {"old": 0.80, "new": 0.82}
    report = stubs.run()
    assert not report["better"]
    assert "is not better" in report["result"]
    assert not twin.accept(replace(stubs.request, bundle=stubs.request.out / "accepted"), report)


def test_an_accepted_bundle_is_the_trained_one(stubs, tmp_path):
    report, place = stubs.run(), tmp_path / "accepted"
    assert twin.accept(replace(stubs.request, bundle=place), report)
    assert {file.name: file.read_bytes() for file in place.iterdir()} == {
        file.name: file.read_bytes() for file in NEW.iterdir()
    }


def test_bags_that_do_not_show_what_matters_are_rejected_in_one_line(stubs):
    stubs.found = found(undetermined=("delay", "center_of_mass_x"))
    with pytest.raises(ConfigError, match=r"the bags do not show delay of 'floating_platform': 120\.0 s"):
        stubs.run()
    assert not (stubs.request.out / "calibration.yaml").exists()


def test_the_page_has_every_estimate_both_rates_and_the_bags(stubs):
    report = stubs.run()
    page = page_of(report)
    for text in ("| thrust | 0.75 |", "0.500", "0.990", "25.0 %", "better by 0.490"):
        assert text in page
    assert Path(stubs.request.out / "report.md").read_text() == page
    assert json.loads((stubs.request.out / "report.json").read_text())["result"] == report
