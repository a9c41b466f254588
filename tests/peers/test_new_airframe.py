"""`fulmar new airframe` beside a published set of the same wing, and the file that it writes under `fulmar check`."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from fulmar_cli.main import app
from fulmar_evaluation.robot_check import check_robot
from tests.peers.environment import PEERS

GEOMETRY = Path(__file__).with_name("airship_v7_geometry.yaml")
# OpenVSP set of airship_v7, FALCON-S at 51c81ff, per rad; α 0.752°, elevator -0.569° (`facts/flight.md` §1.3).
PUBLISHED = {
    ("CL", "alpha"): 5.656, ("CL", "q"): 11.09, ("CL", "elevator"): 1.0887, ("CD", "alpha"): 0.3374,
    ("Cm", "alpha"): -0.6207, ("Cm", "elevator"): -3.1247, ("Cm", "q"): -30.29,
    ("Cl", "p"): -0.4748, ("Cl", "r"): 0.1762, ("Cn", "r"): -0.1353,
}  # fmt: skip
LIFT = 0.5946  # of the set, where its CD.alpha is taken


@pytest.fixture(scope="module")
def made(pytestconfig, tmp_path_factory):
    """The robot's file, and its terms."""
    python = pytestconfig.rootpath / PEERS / "bin" / "python"
    if not python.is_file():
        pytest.fail(f"{python} is missing, and nothing can be compared. Run: make peers", pytrace=False)
    out = tmp_path_factory.mktemp("new") / "v7_lattice.yaml"
    words = ("new", "airframe", GEOMETRY, "--out", out, "--python", python, "--json")
    answer = CliRunner().invoke(app, [*map(str, words)], catch_exceptions=False)
    assert answer.exit_code == 0
    return out, json.loads(answer.stdout)["terms"]


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_lift_and_roll_damping_are_those_of_openvsp_s_set(made):
    _, terms = made
    ratios = {key: terms[key[0]][key[1]] / value for key, value in PUBLISHED.items()}
    drag = terms["CD"]
    alpha = (LIFT - terms["CL"]["1"]) / terms["CL"]["alpha"]
    ratios["CD", "alpha"] = (drag["alpha"] + 2.0 * drag["alpha^2"] * alpha) / PUBLISHED["CD", "alpha"]
    assert ratios["CL", "alpha"] == pytest.approx(1.0, abs=0.05)
    assert ratios["Cl", "p"] == pytest.approx(1.0, abs=0.02)
    assert ratios["CL", "q"] == pytest.approx(1.0, abs=0.12)
    assert ratios["Cm", "alpha"] == pytest.approx(1.0, abs=0.05), "by where we put the centre of mass"
    # A lattice has no drag of profile that grows with the angle of attack, and our tail is no copy of theirs.
    assert 0.6 < ratios["CD", "alpha"] < 1.0
    assert 0.5 < ratios["Cm", "q"] < 1.0


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_its_induced_drag_is_that_of_lifting_line_theory(made):
    _, terms = made
    aspect = 5.0674**2 / 3.3621
    assert terms["CL"]["alpha"] ** 2 / (math.pi * aspect * terms["CD"]["alpha^2"]) == pytest.approx(
        1.0, abs=0.05
    )


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_the_file_that_it_writes_passes_the_check_of_robots(made):
    found = check_robot(str(made[0]), speed=31.0)
    assert found.passed
    names = {mode["name"] for mode in found.as_json()["trim"][0]["modes"]}
    assert {"short period", "phugoid", "roll", "Dutch roll", "spiral"} <= names


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_every_control_moves_its_own_axis_the_documented_way(made):
    _, terms = made
    assert terms["Cm"]["elevator"] < -0.5, "trailing edge down lowers the nose"
    assert terms["Cl"]["aileron"] > 0.05, "lowers the right wing"
    assert terms["Cn"]["rudder"] < -0.01, "turns the nose to the left"
    assert np.abs(terms["Cn"]["aileron"]) < 0.1 * terms["Cl"]["aileron"]
    assert terms["Cn"]["beta"] > 0.0
    assert terms["Cl"]["beta"] < 0.0
