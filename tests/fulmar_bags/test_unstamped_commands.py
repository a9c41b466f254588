"""Robots of others take velocities without stamps: `rerun` compares them with what came after each odometry."""

from __future__ import annotations

import json

import numpy as np
from rosbags.rosbag2.enums import StoragePlugin
from typer.testing import CliRunner

from fulmar_bags.contents import open_bag
from fulmar_bags.control_steps import answers_within, control_steps_of
from fulmar_bags.wire_reader import ABSENT
from fulmar_cli.main import app
from fulmar_evaluation.report.bag_report import write_bag_report
from tests.foreign_bag import write_foreign


def test_the_command_of_a_step_is_the_one_that_follows_its_odometry(tmp_path):
    bag = open_bag(write_foreign(tmp_path / "bag", StoragePlugin.MCAP, commands=True))
    record = control_steps_of(bag, robot="turtlebot2", task="go_to_position", goal=(0.0, 0.0, 0.0))
    np.testing.assert_allclose(record.commands[:, 0], 0.1 * record.sample)
    assert (record.commands[:, 1] == 1.0).all()


def test_rerun_compares_them(tmp_path):
    bag = write_foreign(tmp_path / "bag", StoragePlugin.MCAP, commands=True)
    asked = ("--controller", "policy", "--robot", "turtlebot2", "--task", "go_to_position", "--goal", "0,0,0")
    done = CliRunner().invoke(app, ["bag", "rerun", str(bag), *asked, "--json"])
    found = json.loads(done.stdout[done.stdout.index("{") :])
    assert found["compared"]
    assert {field["field"] for field in found["fields"]} == {"command"}


def test_a_plot_shows_them_under_their_topic(tmp_path):
    bag = open_bag(write_foreign(tmp_path / "bag", StoragePlugin.MCAP, commands=True))
    page = write_bag_report(bag, tmp_path / "plot.html").read_text()
    assert "What the actuators did: /cmd_vel" in page


def test_a_step_without_a_command_before_the_next_one_has_none():
    found = answers_within(np.array([0, 10, 20, 30]), np.array([1, 2, 25]))
    assert found.tolist() == [0, ABSENT, 2, ABSENT]
