"""What a controller believes of the state is published and in the bag."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import odometries
from fulmar_core.robots.topics import BELIEVED, ODOMETRY
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of

CONTROL = """
from dataclasses import replace
import numpy as np

class Shifted:
    def reset(self):
        pass
    def update(self, measured, previous):
        return replace(measured, x=measured.x + 1.0)

class Ahead:
    def __init__(self, robot, task, settings):
        self.observer = Shifted()
    def reset(self):
        pass
    def act(self, inputs):
        command = np.zeros_like(inputs.previous)
        command[:, 0] = np.clip(2.0 - inputs.believed.x, -0.3, 0.3)
        return command
"""


@pytest.mark.slow
def test_the_observer_of_a_users_controller_is_recorded_beside_the_odometry(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    (tmp_path / "my_control.py").write_text(CONTROL)
    asked = (
        "run",
        "turtlebot2",
        "--task",
        "go_to_position",
        "--controller",
        "my_control:Ahead",
        "--lockstep",
    )
    done = fulmar(
        *asked, "--goal", "3,0,0", "--start", "0,0,0", "--duration", "8", "--record", "bag", "--json",
        env=ros_domain.env, cwd=tmp_path,
    )  # fmt: skip
    assert json_of(done.stdout)["failure"] is None, done.stderr
    seen = shifted_by(tmp_path / "bag")
    np.testing.assert_allclose(seen, 1.0, atol=1e-9)
    ahead = odometries(open_bag(tmp_path / "bag").of(ODOMETRY)).pose[-1, 0]
    assert ahead == pytest.approx(1.0, abs=0.05)  # where it believes to be at 2 m


@pytest.mark.slow
def test_the_kalman_observer_of_aircraft_is_in_the_bag(ros_domain: RosDomain, tmp_path: Path) -> None:
    asked = (
        "run",
        "airship_v7",
        "--task",
        "fly_hold",
        "--controller",
        "lqi",
        "--lockstep",
        "--duration",
        "3",
    )
    done = fulmar(*asked, "--record", "bag", "--json", env=ros_domain.env, cwd=tmp_path)
    assert json_of(done.stdout)["failure"] is None, done.stderr
    assert 0.0 < np.abs(shifted_by(tmp_path / "bag")).max() < 0.5


def shifted_by(bag: Path) -> np.ndarray:
    """How far along x each believed place is from the measured one of its time [m]."""
    opened = open_bag(bag)
    measured, believed = (odometries(opened.of(wire)) for wire in (ODOMETRY, BELIEVED))
    assert len(believed) > 20
    places = dict(zip(measured.stamp_ns.tolist(), measured.pose[:, 0], strict=True))
    return np.array(
        [x - places[stamp] for stamp, x in zip(believed.stamp_ns.tolist(), believed.pose[:, 0], strict=True)]
    )
