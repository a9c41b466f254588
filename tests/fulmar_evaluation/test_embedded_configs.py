"""A bag of a robot that nobody knows here can be used: it carries along what it needs."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import pytest

from fulmar_bags.contents import open_bag
from fulmar_bags.writer import BagWriter
from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.config.paths import OWN_FOLDERS, config_names, config_path
from fulmar_core.controllers.classical import gains_of, gains_path
from fulmar_core.robots.robot_file import load_robot
from fulmar_evaluation.rerun.embedded_configs import knowing_what_it_carries, knowing_what_they_carry

TURTLEBOT = config_path("robots", "turtlebot2").read_text()


def bag_of(
    folder: Path, robot: str, carried: str, *, gains: bytes = b"", controller: str = "classical"
) -> Path:
    files = {"robot.yaml": carried.encode()} | ({"controller.yaml": gains} if gains else {})
    info = {"robot": robot, "task": "go_to_pose", "controller": controller}
    BagWriter(folder, run_info=info, attachments=files).close()
    return folder


def test_within_it_the_robot_is_known_and_afterwards_it_is_not(tmp_path, monkeypatch):
    monkeypatch.delenv(OWN_FOLDERS, raising=False)
    carried = TURTLEBOT.replace("name: turtlebot2", "name: mybot").replace("mass: 6.5", "mass: 6.4")
    bag = bag_of(tmp_path / "bag", "mybot", carried)
    for knowing in (
        knowing_what_it_carries(open_bag(bag)),
        knowing_what_they_carry({bag: {"robot": "mybot"}}),
    ):
        with knowing:
            assert load_robot("mybot").body.mass == 6.4
            folder = os.environ[OWN_FOLDERS]
        assert not Path(folder).exists()
        assert not os.environ.get(OWN_FOLDERS)
        with pytest.raises(UnknownNameError):
            load_robot("mybot")


def test_a_law_drives_an_unknown_robot_with_the_gains_that_its_bag_carries(tmp_path):
    carried = TURTLEBOT.replace("name: turtlebot2", "name: mybot")
    gains = config_path("controllers", "turtlebot2_polar").read_bytes().replace(b"turn: 4.0", b"turn: 3.9")
    with knowing_what_it_carries(open_bag(bag_of(tmp_path / "with", "mybot", carried, gains=gains))):
        assert gains_of(load_robot("mybot")).turn == 3.9
    with knowing_what_it_carries(open_bag(bag_of(tmp_path / "without", "mybot", carried))):
        assert gains_path(load_robot("mybot")) is None
    bag = bag_of(tmp_path / "planner", "mybot", carried, gains=gains, controller="planner")
    with knowing_what_it_carries(open_bag(bag)):  # what a planner carries are no gains of a law
        assert gains_path(load_robot("mybot")) is None


def test_a_carried_robot_that_does_not_load_is_refused_when_it_is_asked_for(tmp_path):
    bag = bag_of(tmp_path / "bag", "mybot", "name: [", gains=b"turn: 4.0\n")
    with knowing_what_it_carries(open_bag(bag)), pytest.raises(ConfigError, match="not valid YAML"):
        load_robot("mybot")


def test_folders_of_one_s_own_stay_in_front(tmp_path, monkeypatch):
    (tmp_path / "mine" / "robots").mkdir(parents=True)
    (tmp_path / "mine" / "robots" / "other.yaml").write_text(
        TURTLEBOT.replace("name: turtlebot2", "name: other")
    )
    monkeypatch.setenv(OWN_FOLDERS, str(tmp_path / "mine"))
    bag = bag_of(tmp_path / "bag", "mybot", TURTLEBOT.replace("name: turtlebot2", "name: mybot"))
    with knowing_what_it_carries(open_bag(bag)):
        assert {"mybot", "other"} <= set(config_names("robots"))
    assert "mybot" not in config_names("robots")


def test_a_robot_that_is_known_here_is_the_one_that_is_known_here(tmp_path):
    bag = bag_of(tmp_path / "bag", "turtlebot2", TURTLEBOT.replace("mass: 6.5", "mass: 6.4"))
    with knowing_what_it_carries(open_bag(bag)):
        assert load_robot("turtlebot2").body.mass == 6.5


@pytest.mark.parametrize("name", ["../../evil", "/evil", "..", "a/b", ""])
def test_a_name_in_a_bag_is_never_a_path(tmp_path, monkeypatch, name):
    (temporary := tmp_path / "some" / "folder").mkdir(parents=True)  # two folders up is still in `tmp_path`
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    bag = bag_of(tmp_path / "bag", name, "name: evil\n")
    with knowing_what_it_carries(open_bag(bag)):
        assert not list(tmp_path.rglob("evil*"))
    assert not Path("/evil.yaml").exists()
