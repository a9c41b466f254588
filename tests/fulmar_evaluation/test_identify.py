"""`fulmar identify` on real bags of machines driven in MuJoCo, and the benchmark that evaluates it."""

from __future__ import annotations

import json

import pytest

from fulmar_core.robots.calibration import load_calibration
from fulmar_core.robots.robot_file import load_robot

pytest.importorskip("mujoco")

from tests.benchmarks.identification.campaign import Trial, document_of, run_identification, run_trial
from tests.benchmarks.identification.driving import draw_machine

REQUIRED = ("mass", "yaw_inertia", "thrust")


@pytest.fixture(scope="module")
def evaluated(tmp_path_factory):
    """A platform that drove for half a minute with and without ballast: what the benchmark says, and its bags."""
    home = tmp_path_factory.mktemp("bags")
    return run_trial(
        Trial("floating_platform", 1, seed=2, duration_s=30.0, bags=home)
    ), home / "floating_platform_01"


def test_estimates_from_bags_are_within_three_per_cent_of_a_truth_that_is_far_from_nominal(evaluated):
    nominal = load_robot("floating_platform")
    quantities = evaluated[0]["quantities"]
    assert abs(quantities["thrust"]["truth"] / nominal.actuators.thrust - 1.0) > 0.03
    for name in REQUIRED:
        assert quantities[name]["error_percent"] < 3.0, name
    assert quantities["delay"]["value"] == pytest.approx(quantities["delay"]["truth"], abs=0.004)


def test_the_command_finds_the_same_and_writes_a_calibration(evaluated, fulmar, tmp_path):
    quantities, home = evaluated[0]["quantities"], evaluated[1]
    weight = quantities["ballast_1"]["truth"]
    out = tmp_path / "calibration.yaml"
    code, printed, _ = fulmar(
        "identify", home / "bare", home / "heavy", "--ballast", f"{home / 'heavy'}={weight}+-0.004",
        "--out", out, "--json",
    )  # fmt: skip
    reported = json.loads(printed)
    assert code == 0
    assert (reported["robot"], reported["calibration"]) == ("floating_platform", str(out))
    assert reported["driven_s"] == pytest.approx(60.0, abs=0.1)
    assert set(reported["estimates"]["mass"]) == {"value", "low", "high", "unit"}
    for name in REQUIRED:
        assert reported["estimates"][name]["value"] == pytest.approx(quantities[name]["value"], rel=0.005)
    assert load_calibration(out).thrust.value == pytest.approx(
        reported["estimates"]["thrust"]["value"], rel=1e-6
    )


def test_a_simulation_with_the_calibration_has_the_machine_s_own_numbers(
    evaluated, fulmar, tmp_path, monkeypatch
):
    monkeypatch.setenv("FULMAR_CALIBRATION", "")
    out, home = tmp_path / "c.yaml", evaluated[1]
    truth = evaluated[0]["quantities"]
    fulmar(
        "identify", home / "bare", "--known", f"mass={truth['mass']['truth']}+-0.01", "--out", out, "--json"
    )
    asked = ("evaluate", "floating_platform", "go_to_pose", "--controller", "lqr", "--through", "batch")
    code, printed, _ = fulmar(*asked, "--episodes", "4", "--calibration", out, "--json")
    assert code == 0
    assert json.loads(printed)["episodes"] == 4
    assert load_robot("floating_platform").actuators.thrust == pytest.approx(
        truth["thrust"]["truth"], rel=0.03
    )


def test_without_a_known_mass_it_says_what_its_numbers_rest_on(evaluated, fulmar):
    code, printed, err = fulmar("identify", evaluated[1] / "bare", "--json")
    assert code == 0
    assert "weigh the robot (--known mass=KG+-KG)" in err
    assert json.loads(printed)["scale"].startswith("mass and thrust rest on the mass of the robot's YAML")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--known", "mass"], "--known mass: must be a name, '=', a number greater than 0"),
        (["--known", "mass=-5"], "--known mass=-5: must be a name"),
        (["--known", "weight=5.3"], "unknown quantity 'weight'."),
        (["--ballast", "nowhere=2.0"], "'nowhere' is none of the bags"),
        (["--ballast", "BAG=2.0"], "one run without ballast is needed to compare with"),
    ],
)
def test_a_mistake_gets_one_line(evaluated, fulmar, words, message):
    bag = str(evaluated[1] / "bare")
    code, out, err = fulmar("identify", bag, *(word.replace("BAG", bag) for word in words))
    assert (code, out) == (2, "")
    assert message in err.replace("\n", " ")


def test_a_folder_without_a_bag_gets_one_line(fulmar, tmp_path):
    code, out, err = fulmar("identify", tmp_path)
    assert (code, out, err.count("\n")) == (2, "", 1)


def test_machines_are_drawn_anew_by_number_and_the_same_by_seed():
    nominal = load_robot("floating_platform")
    first, again, other = (draw_machine(nominal, 1, number).truth for number in (0, 0, 1))
    assert first == again
    assert first != other


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["turtlebot2", "kingfisher"])
def test_other_families_are_found_in_mujoco_too(robot):
    quantities = run_trial(Trial(robot, 1, seed=1, duration_s=60.0))["quantities"]
    close = {"turtlebot2": {"wheel_scale": 1.0, "turn_scale": 2.0}, "kingfisher": {"mass": 8.0}}[robot]
    for name, percent in close.items():
        assert quantities[name]["error_percent"] < percent, (name, quantities[name])


@pytest.mark.slow
def test_trials_in_processes_of_their_own_give_one_document():
    (result,) = run_identification([Trial("floating_platform", 3, seed=1, duration_s=40.0)], jobs=1)
    assert document_of([result], seed=1)["asked"] == 3


def test_the_document_says_what_was_asked_and_whether_it_was_met(evaluated):
    result = evaluated[0]
    off = json.loads(json.dumps(result))
    off["quantities"]["thrust"] |= {"error_percent": 4.0, "inside": False}
    good, bad = document_of([result], seed=1), document_of([result, off], seed=1)
    assert [line["quantity"] for line in good["required"]] == list(REQUIRED)
    assert good["asked"] == 3
    thrust = next(line for line in bad["required"] if line["quantity"] == "thrust")
    assert (thrust["worst_error_percent"], thrust["met"]) == (4.0, False)
    assert thrust["coverage"] <= 0.5
    assert bad["met"] < 3
