"""A sensor of the user's own, from a folder outside the checkout: simulated, published, used, recorded, run again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import messages, odometries
from fulmar_core.config.errors import BAD_USAGE
from fulmar_core.config.paths import OWN_FOLDERS
from fulmar_core.robots.topics import ODOMETRY
from tests.conftest import RosDomain
from tests.own_files import write_sentry
from tests.ros.cli import fulmar, json_of

OWN = ("--controller", "my_control:KeepOff")
RUN = (
    "run", "sentry", "--task", "go_to_position", *OWN, "--lockstep", "--record", "bag", "--json",
    "--goal", "3,0,0", "--start", "0,0,0",
)  # fmt: skip
WALL_M, AWAY_M = 1.5, 0.5


@pytest.fixture
def desk(tmp_path: Path, ros_domain: RosDomain) -> dict[str, str]:
    """The files of the page in a folder, as a user writes them; the environment to run in."""
    return ros_domain.env | {OWN_FOLDERS: write_sentry(tmp_path)}


@pytest.mark.slow
def test_the_robot_of_the_page_stops_before_the_wall_that_its_sensor_sees(
    desk: dict[str, str], tmp_path: Path
) -> None:
    done = fulmar(*RUN, "--duration", "15", env=desk, cwd=tmp_path)
    assert json_of(done.stdout)["failure"] is None, done.stderr
    bag = open_bag(tmp_path / "bag")
    ahead = odometries(bag.of(ODOMETRY)).pose[:, 0]
    assert ahead[-1] == pytest.approx(WALL_M - AWAY_M, abs=0.03)
    (topic,) = (topic for topic in bag.topics.values() if topic.name == "/sentry/range/front")
    ranges = np.array([message.range for _, message in messages(topic)])
    assert len(ranges) >= len(ahead) - 2
    assert ranges[-1] == pytest.approx(AWAY_M, abs=0.05)
    with next((tmp_path / "bag").glob("*.mcap")).open("rb") as stream:
        files = {file.name: file.data.decode() for file in make_reader(stream).iter_attachments()}
    assert files["sensor_front.py"] == (tmp_path / "my_sensor.py").read_text()
    done = fulmar("bag", "rerun", "bag", *OWN, "--from", "odometry", env=desk, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    (tmp_path / "my_sensor.py").unlink()
    done = fulmar("bag", "info", "bag", "--json", env=desk, cwd=tmp_path)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            ("sensor_msgs/msg/Range", "sensor_msgs/msg/Ranges"),
            "there is no message type sensor_msgs/msg/Ranges here",
        ),
        (("return float", "return 1.0 / 0.0, float"), "measure raised ZeroDivisionError: "),
    ],
)
def test_a_mistake_that_shows_in_the_nodes_is_one_line(
    change: tuple[str, str], said: str, desk: dict[str, str], tmp_path: Path
) -> None:
    file = tmp_path / "my_sensor.py"
    file.write_text(file.read_text().replace(*change))
    done = fulmar(*RUN, "--duration", "2", env=desk, cwd=tmp_path)
    assert done.returncode in (1, BAD_USAGE)
    assert said in done.stdout + done.stderr
    assert "Traceback" not in done.stderr
