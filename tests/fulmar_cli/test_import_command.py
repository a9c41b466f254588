"""`fulmar import`: a stranger's file in, an accepted bundle out, or one line."""

from __future__ import annotations

import json

import pytest

pytest.importorskip("torch")

from tests.fulmar_cli.command_line import complaint
from tests.training import foreign

ASKED = ("--robot", "turtlebot2", "--task", "go_to_position", "--out")


def test_an_imported_checkpoint_is_a_bundle_that_is_accepted(fulmar, tmp_path):
    path = foreign.save_skrl(tmp_path / "agent.pt", foreign.network(8, 2))
    code, out, _ = fulmar("import", path, *ASKED, tmp_path / "out", "--activation", "elu")
    assert code == 0
    assert "turtlebot2 · go_to_position · 10 Hz · skrl" in out
    code, out, _ = fulmar("bundle", "check", tmp_path / "out", "--json")
    assert code == 0
    assert json.loads(out)["accepted"]


def test_an_import_for_a_platform_names_the_nozzles_that_its_actions_open(fulmar, tmp_path):
    path = foreign.save_rl_games(tmp_path / "last.pth", foreign.network(6 + 8, 16), valves=8)
    asked = ("--robot", "floating_platform", "--task", "go_to_position", "--activation", "tanh")
    code, _, err = fulmar("import", path, *asked, "--out", tmp_path / "out")
    assert code == 0
    assert "its actions open thruster_1, thruster_2" in err


@pytest.mark.parametrize(
    ("more", "reported"),
    [
        ((), "Give --activation, one of elu"),
        (("--activation", "elu", "--hz", "7"), "control_hz = 7 must divide the physics rate"),
        (("--activation", "elu", "--format", "rl_game"), "--format rl_game is unknown"),
        (("--activation", "elu", "--format", "rl_games"), "is a checkpoint of skrl, not of rl_games"),
        (("--format", "onnx"), "is no ONNX model"),
    ],
)
def test_a_mistake_of_an_import_gets_one_line_and_no_bundle(fulmar, more, reported, tmp_path):
    path = foreign.save_skrl(tmp_path / "agent.pt", foreign.network(8, 2))
    assert reported in complaint(fulmar("import", path, *ASKED, tmp_path / "out", *more))
    assert not (tmp_path / "out").exists()


def test_a_network_that_gives_no_numbers_is_named_and_leaves_no_bundle(fulmar, tmp_path):
    network = foreign.network(8, 2)
    next(network.parameters()).data[0, 0] = float("nan")
    path = foreign.write_onnx(tmp_path / "policy.onnx", network)
    said = complaint(fulmar("import", path, *ASKED, tmp_path / "out"))
    assert "its output is not a number" in said
    assert not (tmp_path / "out").exists()
