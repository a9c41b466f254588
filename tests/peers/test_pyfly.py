"""Our Skywalker X8 beside PyFly's, after the same steps of its commands."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from fulmar_core.dynamics.batch_dynamics import Steps
from fulmar_core.dynamics.by_kind import actuation_of
from fulmar_core.dynamics.flight_dynamics import FlightDynamics
from fulmar_core.dynamics.flight_trim import find_trim, still_air
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.attitude import euler_of, turn_back
from tests.peers.environment import run_peer

SCRIPT = Path(__file__).with_name("drive_x8.py")
STEPS, SECONDS = 200, 2.0
X8 = load_robot("skywalker_x8")


def ours(trim, after: np.ndarray) -> np.ndarray:
    """Turn rates after each 0.01 s, x ahead, y right, z down, shape (steps, 3) [rad/s]."""
    dynamics, world = FlightDynamics(X8, turbulent=False), still_air(X8, 1, altitude=-100.0)
    state = trim.state.mapped(lambda part: np.asarray(part, dtype=float).reshape(1))
    actuation = actuation_of(X8, trim.command[:, None])
    found = []
    for _ in range(STEPS):
        actuation.begin(after[:, None], world, None)
        state = dynamics.move(state, actuation, world, (np.zeros(1),) * 3, Steps(1))
        found.append([state.wx[0], -state.wy[0], -state.wz[0]])
    return np.array(found)


@pytest.mark.slow
@pytest.mark.timeout(300)
@pytest.mark.parametrize("step", [(0.03, 0.0, 0.0), (0.0, 0.02, 0.0), (0.0, 0.0, 0.2), (-0.02, 0.01, 0.1)])
def test_rates_after_a_step_are_those_of_pyfly_for_two_seconds(pytestconfig, tmp_path, step):
    trim = find_trim(X8, 18.0, height=100.0, altitude=-100.0)  # in the air of sea level, as theirs
    after = trim.command + np.array(step)
    roll, pitch, yaw = (float(part) for part in euler_of(trim.state.quat))
    ahead, left, up = (float(part) for part in turn_back(trim.state.quat, trim.state.velocity))
    asked = {
        "speed": 18.0, "roll": roll, "pitch": -pitch, "velocity": [ahead, -left, -up], "steps": STEPS,
        "before": trim.command.tolist(), "after": after.tolist(),
    }  # fmt: skip
    assert abs(yaw) < 0.02  # PyFly begins with a heading of 0
    (tmp_path / "asked.json").write_text(json.dumps(asked), encoding="utf-8")
    printed = run_peer(pytestconfig.rootpath, SCRIPT, tmp_path / "asked.json", home=tmp_path)
    theirs = np.array(json.loads(printed.strip().splitlines()[-1])["rates"])
    rates = ours(trim, after)
    peak = np.abs(theirs).max(axis=0)
    assert peak.max() > 0.02  # it was steered
    assert np.all(np.abs(rates - theirs).max(axis=0) <= np.maximum(0.02 * peak, 1e-3)), (
        np.abs(rates - theirs).max(axis=0) / peak
    )
