"""The envelope guard through nodes: trips are published, recorded, reported, and the same to the bit in a re-run."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of

HOSTILE = """
import numpy as np
from fulmar_core.states.rotation import rotate_inverse
class Out:
    def __init__(self, robot, task, settings): self.each = robot.actuators.wrench_per_newton
    def reset(self): pass
    def act(self, inputs):
        rigid = inputs.state.to_rigid()
        along = rotate_inverse(rigid.quat_xyzw, rigid.position_in_world + 1e-3) @ self.each[:, :3].T
        return np.eye(len(self.each))[along.argmax(axis=1)]
"""
RUN = (
    "run", "floating_platform", "--controller", "hostile:Out", "--guard", "envelope", "--area=-2,2,-2,2",
    "--start", "0.5,0,0", "--goal", "1,0,0", "--record", "bag", "--json",
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    "pace", [("--lockstep", "--duration", "12"), ("--duration", "12")], ids=["lockstep", "real"]
)
def test_trips_through_nodes_are_in_the_bag_and_the_same_to_the_bit_in_a_rerun(
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
