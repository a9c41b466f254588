"""`fulmar certify --replay`: what the envelope guard would have done in runs that are long over."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

BAGS = Path(__file__).resolve().parents[1] / "replay" / "bags"
PLATFORM, GUARDED, SPACECRAFT, BOAT = (
    BAGS / name
    for name in (
        "floating_platform_go_to_pose_policy",
        "floating_platform_go_to_pose_lqr_guarded",
        "spacecraft_16_go_to_pose_3d_policy",
        "kingfisher_go_to_position_policy",
    )
)


def test_a_run_that_came_near_a_side_is_counted_with_time_cause_and_room(fulmar):
    code, out, _ = fulmar("certify", "--replay", PLATFORM, GUARDED, "--area=-1.5,1.5,-2.05,2", "--json")
    found = json.loads(out)
    assert code == 0 and found["runs_with_trip"] == 2 and found["trips"] >= 2
    first = found["bags"][0]
    assert first["robot"] == "floating_platform" and first["steps"] == 100
    assert first["area"] == [-1.5, 1.5, -2.05, 2.0] and first["beyond_m"] > 0.0
    trip = first["trips"][0]
    assert trip["room"] < 0.0 and trip["side"] in trip["cause"] and 0.0 <= trip["t_s"] < 20.0
    assert 0.0 < first["backup_share"] <= 1.0


def test_a_run_with_room_is_left_to_its_controller_and_says_so(fulmar):
    code, out, _ = fulmar("certify", "--replay", SPACECRAFT)
    assert code == 0
    assert "100 steps; the envelope guard would have left its controller alone" in out
    assert "0 of 1 run with a trip, 0 in all" in out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--replay", PLATFORM, SPACECRAFT), "Replay the bags of one robot at a time"),
        (("--replay", PLATFORM, "--area=-1,1,-1,1,-1,1"), "area"),
        (("--replay", "no/bag"), "no/bag"),
        (("lqr", "policy"), "one controller is certified at a time"),
        (("lqr", "--area=-1,1,-1,1"), "--area belongs to recorded runs"),
    ],
)
def test_bad_input_ends_with_one_line(fulmar, words, said):
    code, _, err = fulmar("certify", *words)
    assert code == 2
    assert said in err and "Traceback" not in err
