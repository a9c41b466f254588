"""A robot of one's own with a star tracker: named in its YAML outside of the checkout, and nowhere else."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from fulmar_bags.contents import Bag, open_bag
from fulmar_bags.decode import messages, odometries
from fulmar_bags.message_reader import reading_of
from fulmar_core.config.paths import OWN_FOLDERS, config_path
from fulmar_core.robots.sensors.table import SENSORS
from fulmar_core.robots.topics import SENSOR_WIRES, TRUTH
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of

NAME, STD, BORESIGHT_STD, LATE_NS = "starry", 1e-3, 5e-3, 400_000_000
STARS = {
    "std": STD,
    "boresight_std": BORESIGHT_STD,
    "boresight": [1.0, 0.0, 0.0],
    "rate_hz": 1.0,
    "delay_s": 0.4,
}
ATTITUDE = SENSOR_WIRES["star_tracker"]


@pytest.fixture
def env(ros_domain: RosDomain, tmp_path: Path) -> dict[str, str]:
    robot = yaml.safe_load(config_path("robots", "floating_platform").read_text(encoding="utf-8"))
    robot["sensors"]["star_tracker"] = STARS
    path = tmp_path / "mine" / "robots" / f"{NAME}.yaml"
    path.parent.mkdir(parents=True)
    path.write_text(yaml.safe_dump(robot | {"name": NAME}), encoding="utf-8")
    return ros_domain.env | {OWN_FOLDERS: str(tmp_path / "mine")}


def run(env: dict[str, str], cwd: Path, seed: int, bag: str) -> Bag:
    """20 s in lock step, recorded."""
    asked = (
        "--controller",
        "classical",
        "--lockstep",
        "--seed",
        str(seed),
        "--duration",
        "20",
        "--record",
        bag,
    )
    done = fulmar("run", NAME, *asked, "--json", env=env, cwd=cwd)
    assert done.returncode in (0, 1), done.stderr  # whether the goal was met does not matter here
    assert json_of(done.stdout)["failure"] in ("", None), done.stdout
    return open_bag(cwd / bag)


@pytest.mark.slow
def test_its_attitude_is_recorded_at_its_rate_within_its_noise_and_repeats_with_the_seed(
    env: dict[str, str], tmp_path: Path
) -> None:
    bag = run(env, tmp_path, 4, "bag")
    topic = bag.topics[f"/{NAME}/{ATTITUDE.name}"]
    assert topic.type == ATTITUDE.type == "geometry_msgs/msg/QuaternionStamped"
    found = [reading_of(message, SENSORS["star_tracker"]) for _, message in messages(topic)]
    stamps = np.array([reading.stamp_ns for reading in found])
    assert len(found) == 20
    assert (np.diff(stamps) == 1_000_000_000).all()

    truth = odometries(bag.topics[f"/{NAME}/{TRUTH.name}"])
    at = np.searchsorted(truth.stamp_ns, stamps)
    np.testing.assert_array_equal(truth.stamp_ns[at], stamps)  # stamped as measured, though they came later
    true = Rotation.from_quat(truth.pose[at, 3:])
    assert np.ptp(true.as_euler("zyx")[:, 0]) > 0.1  # the robot turns meanwhile
    error = (true.inv() * Rotation.from_quat([reading.value for reading in found])).as_rotvec()
    # Of 20 normal numbers the standard deviation lies within 0.45 and 1.7 of the true one, to 1 in 10,000.
    assert 0.45 < error[:, 0].std() / BORESIGHT_STD < 1.7
    assert 0.45 < error[:, 1:].std() / STD < 1.7

    again = run(env, tmp_path, 4, "again").topics[topic.name]
    assert again.data == topic.data
    other = run(env, tmp_path, 5, "other").topics[topic.name]
    assert other.data != topic.data


@pytest.mark.slow
def test_bag_info_and_export_show_it_as_any_other_wire(env: dict[str, str], tmp_path: Path) -> None:
    run(env, tmp_path, 4, "bag")
    info = fulmar("bag", "info", "bag", env=env, cwd=tmp_path)
    line = next(line for line in info.stdout.splitlines() if f"/{NAME}/{ATTITUDE.name}" in line)
    assert line.split()[1:3] == ["geometry_msgs/QuaternionStamped", "20"]
    assert fulmar("bag", "export", "bag", "--to", "csv", env=env, cwd=tmp_path).returncode == 0
    table = next(tmp_path.rglob(f"{NAME}.{ATTITUDE.name}.csv"))
    rows = list(csv.DictReader(table.open()))
    assert len(rows) == 20
    assert {row["header.frame_id"] for row in rows} == {"inertial"}
    quats = np.array([[float(row[f"quaternion.{axis}"]) for axis in "xyzw"] for row in rows])
    np.testing.assert_allclose(np.linalg.norm(quats, axis=1), 1.0, atol=1e-12)
