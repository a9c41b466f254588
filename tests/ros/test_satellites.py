"""Satellites through the nodes: estimators in a chain, a gyroscope that dies, an inertia that a controller uses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fulmar_bags.contents import open_bag
from fulmar_bags.wire_reader import WireReader
from fulmar_core.config.paths import OWN_FOLDERS
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import INERTIA, INERTIA_STATUS, RATE, TRUTH, Wire
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of
from tests.ros.wires import wires_of

pytestmark = pytest.mark.real_time  # up to six processes at full speed leave other tests no processor
CUBESAT = "cubesat_wheels"
DIES_S = 3.0
GYRO_DIES = ("run", CUBESAT, "--scenario", "soon", "--lockstep", "--seed", "3", "--duration", "7", "--json")
SOON = f"""title: a gyroscope that dies soon
sensor_noise: true
body: nominal
orbit_rate: 0.00104720
sensing: {{gyroscope_dies_s: {DIES_S}}}
"""


def received(bag: Path, wire: Wire) -> list[Any]:
    return [message for _, message in WireReader(open_bag(bag)).messages(wire)]


def last_values(bag: Path, wire: Wire) -> tuple[str, dict[str, str]]:
    """Newest words and values of a status."""
    status = received(bag, wire)[-1].status[0]
    return status.message, {pair.key: pair.value for pair in status.values}


@pytest.fixture
def env(ros_domain: RosDomain, tmp_path: Path) -> dict[str, str]:
    """With a scenario of our own."""
    (tmp_path / "mine" / "scenarios").mkdir(parents=True)
    (tmp_path / "mine" / "scenarios" / "soon.yaml").write_text(SOON)
    return {**ros_domain.env, OWN_FOLDERS: str(tmp_path / "mine")}


@pytest.mark.slow
def test_two_runs_of_one_seed_go_on_alike_by_the_stars(env, tmp_path: Path) -> None:
    for bag in ("one", "two"):
        done = fulmar(*GYRO_DIES, "--record", bag, env=env, cwd=tmp_path)
        assert json_of(done.stdout)["failure"] is None, done.stderr
    one, two = wires_of(tmp_path / "one"), wires_of(tmp_path / "two")
    assert {topic for topic in one if one[topic] != two.get(topic)} == set()


@pytest.mark.slow
def test_the_gyroscope_dies_and_the_attitude_goes_on_by_the_stars(env, tmp_path: Path) -> None:
    done = fulmar(*GYRO_DIES, "--record", "one", env=env, cwd=tmp_path)
    assert json_of(done.stdout)["failure"] is None, done.stderr
    one = wires_of(tmp_path / "one")
    counts = {topic.removeprefix(f"/{CUBESAT}/"): len(data) for topic, data in one.items()}
    assert counts["odom"] == counts["controller/action"] == 69  # on and on, although the gyroscope has died
    assert counts["imu/data"] == 20 * DIES_S + 1
    rates = received(tmp_path / "one", RATE)
    truth = {_stamp(each): each.twist.twist.angular for each in received(tmp_path / "one", TRUTH)}
    errors = [
        np.degrees([w.x - v.x, w.y - v.y, w.z - v.z])
        for each in rates
        if (v := truth.get(_stamp(each))) is not None
        for w in [each.twist.twist.angular]
    ]
    assert len(errors) > 22
    assert float(np.sqrt(np.mean(np.square(errors)))) < 0.0275  # °/s: thesis Table 6.2, two cameras


def _stamp(message: Any) -> int:
    return int(message.header.stamp.sec * 10**9 + message.header.stamp.nanosec)


@pytest.mark.slow
def test_the_inertia_is_published_once_the_motion_shows_it_and_the_status_says_what_it_does_not(
    env, tmp_path: Path
) -> None:
    chain = ("--estimator", "attitude,inertia", "--lockstep", "--json", "--record")
    excited = ("run", CUBESAT, "--controller", "excite", "--goals", "excite_persistent", "--duration", "60")
    done = fulmar(*excited, *chain, "excited", env=env, cwd=tmp_path)
    assert json_of(done.stdout)["failure"] is None, done.stderr
    inertia = received(tmp_path / "excited", INERTIA)[-1].inertia
    np.testing.assert_allclose(
        [inertia.ixx, inertia.iyy, inertia.izz], np.diag(load_robot(CUBESAT).body.inertia_matrix), rtol=0.02
    )
    identified = fulmar("identify", "excited", "--json", env=env, cwd=tmp_path)
    for method, found in json_of(identified.stdout)["estimates"].items():
        assert found["xx"]["value"] == pytest.approx(inertia.ixx, rel=0.02), method
    refused = fulmar("identify", "excited", "--known", "mass=5.32", env=env, cwd=tmp_path)
    assert "not for 'cubesat_wheels'" in refused.stderr
    still = ("run", CUBESAT, "--task", "point_inertial", "--duration", "20")
    done = fulmar(*still, *chain, "still", env=env, cwd=tmp_path)
    assert json_of(done.stdout)["failure"] is None, done.stderr
    words, values = last_values(tmp_path / "still", INERTIA_STATUS)
    assert "cannot be observed: too little excitation" in words
    assert "cannot be observed" in values["i_zz"]
    assert not received(tmp_path / "still", INERTIA)


@pytest.mark.slow
def test_the_adaptive_law_slews_with_the_inertia_that_the_estimator_publishes(env, tmp_path: Path) -> None:
    asked = ("run", CUBESAT, "--task", "slew", "--controller", "adaptive", "--seed", "2", "--lockstep")
    asked = (*asked, "--estimator", "attitude,inertia", "--record", "bag", "--json")
    done = fulmar(*asked, env=env, cwd=tmp_path)
    summary = json_of(done.stdout)
    assert summary["failure"] is None, done.stderr
    assert summary["success"], summary
    assert received(tmp_path / "bag", INERTIA)
