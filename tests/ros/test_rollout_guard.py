"""The envelope guard by rollouts through nodes: trips are recorded and the same to the bit in a re-run."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of

HOSTILE = """
import numpy as np
class Out:
    def __init__(self, robot, task, settings): pass
    def reset(self): pass
    def act(self, inputs):
        return np.ones_like(inputs.previous)
"""
RUN = (
    "run", "kingfisher", "--controller", "hostile:Out", "--guard", "envelope", "--area=-8,8,-4,4", "--start", "3,0,0",
    "--goal", "4,0", "--record", "bag", "--json",
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    "pace", [("--lockstep", "--duration", "15"), ("--duration", "12")], ids=["lockstep", "real"]
)
def test_trips_of_a_boat_through_nodes_are_in_the_bag_and_the_same_to_the_bit_in_a_rerun(
    pace: tuple[str, ...], ros_domain: RosDomain, tmp_path: Path
) -> None:
    (tmp_path / "hostile.py").write_text(HOSTILE)
    done = fulmar(*RUN, *pace, env=ros_domain.env, cwd=tmp_path)
    guard = json_of(done.stdout)["guard"]
    assert guard["trips"], done.stderr
    assert "it could not stop before x_max" in guard["trips"][0]["cause"] and guard["trips"][0]["room"] < 0.0
    assert 0.0 < guard["backup_share"] < 1.0
    assert "the envelope guard takes over" in done.stderr
    own = ("--controller", "hostile:Out", "--json")
    done = fulmar("bag", "rerun", "bag", *own, env=ros_domain.env, cwd=tmp_path)
    trips = json_of(done.stdout)["trips"]
    assert trips["same"] and trips["recorded"] == trips["found"] >= len(guard["trips"])
