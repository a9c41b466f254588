"""`fulmar twin`: mistakes get one line, before anything is written."""

from __future__ import annotations

import pytest

from policy_server.controllers import shipped_policy
from tests.fulmar_cli.bag_commands import BAGS, LQR, POLICY
from tests.fulmar_cli.command_line import SHIPPED, complaint

pytest.importorskip("mujoco")
pytest.importorskip("torch")
BOAT = BAGS / "kingfisher_go_to_position_policy"


@pytest.fixture
def out(tmp_path):
    return tmp_path / "twin"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((POLICY, BOAT), "the bags are of several robots"),
        ((POLICY, "--policy", shipped_policy("kingfisher", "go_to_position")), "is for 'kingfisher'"),
        ((POLICY, "--accept"), "say where, with --bundle DIR"),
        ((POLICY, "--bundle", "there"), "nothing is written there without --accept"),
        ((POLICY, "--accept", "--bundle", SHIPPED), "no bundle is overwritten"),
        ((POLICY, "--task", "go_to_poze"), "go_to_pose"),
        ((POLICY, "--task", "circle"), "circle"),
        ((BAGS / "missing",), "missing"),
        ((POLICY, "--known", "mass=heavy"), "--known mass=heavy"),
    ],
)
def test_a_mistake_gets_one_line_and_writes_no_calibration(fulmar, out, words, said):
    code, printed, errors = fulmar("twin", *words, "--out", out)
    assert (code, printed) == (2, "")
    lines = [line for line in errors.splitlines() if line.startswith("fulmar: ")]
    assert len(lines) == 1
    assert said in lines[0]
    assert "Traceback" not in errors
    assert not (out / "calibration.yaml").exists()


def test_a_folder_of_something_else_is_left_alone(fulmar, out):
    out.mkdir()
    (out / "mine.txt").write_text("mine")
    assert "is not empty" in complaint(fulmar("twin", LQR, "--out", out))
