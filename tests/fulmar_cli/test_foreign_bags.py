"""Every command on a bag takes those of other programs, with one set of options, or says what is missing in them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2.enums import StoragePlugin
from typer.testing import CliRunner

from fulmar_bags.bag_reading import BagReading
from fulmar_bags.contents import open_bag
from fulmar_bags.run_record import read_any_run
from fulmar_cli.main import app
from fulmar_core.config.errors import BagError, ConfigError
from tests.foreign_bag import write_foreign

ROBOT = ("--robot", "turtlebot2")
TASK = ("--task", "go_to_position")
THEIRS = "odom=/base/odometry,cmd_vel=/base/velocity"
COMMANDS = {
    "info": ("bag", "info"),
    "plot": ("bag", "plot"),
    "export": ("bag", "export", "--to", "npz"),
    "rerun": (
        "bag",
        "rerun",
        *ROBOT,
        *TASK,
        "--goal",
        "0,0,0",
        "--controller",
        "classical",
        "--tolerance",
        "1e9",
    ),
    "report": ("report", *ROBOT, *TASK),
    "identify": ("identify", *ROBOT),
}


def asked(*words: object):
    return CliRunner().invoke(app, [*map(str, words)])


@pytest.fixture(scope="module")
def theirs(tmp_path_factory) -> Path:
    """Odometry and commands under names of another program, and a second odometry beside them."""
    folder = tmp_path_factory.mktemp("theirs")
    return write_foreign(
        folder / "bag",
        StoragePlugin.SQLITE3,
        count=400,
        commands=True,
        velocity="/base/velocity",
        more=("/ekf/odom2",),
    )


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_takes_the_topics_of_others(theirs, command):
    done = asked(*COMMANDS[command], theirs, "--topics", THEIRS)
    assert done.exit_code in (0, 1), done.exception
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(
    ("topics", "words"),
    [
        ("odom=/base/odometri", "Did you mean '/base/odometry'?"),
        ("odm=/base/odometry", "Did you mean 'odom'?"),
        ("odom", "must be OURS=THEIRS"),
        ("odom=/words", "is std_msgs/msg/String, 'odom' is nav_msgs/msg/Odometry"),
        ("odom=/a,odom=/b", "'odom' is given twice"),
    ],
)
def test_topics_that_are_not_there_are_named(theirs, command, topics, words):
    done = asked(*COMMANDS[command], theirs, "--topics", topics)
    assert isinstance(done.exception, ConfigError)
    assert words in str(done.exception)


def test_commands_without_a_stamp_are_put_on_the_clock_of_the_odometry(theirs):
    """The recorder's clock is years off: only differences of its times count."""
    record = read_any_run(
        theirs, BagReading("turtlebot2", topics={"odom": "/base/odometry", "cmd_vel": "/base/velocity"})
    )
    assert record.commanded.names == ("speed", "yaw_rate")
    assert np.abs(record.commanded.stamp_s - record.odom.stamp_s - 0.005).max() < 0.0005


def test_identify_finds_what_wheels_of_another_program_did(theirs):
    done = asked("identify", theirs, *ROBOT, "--topics", THEIRS, "--json")
    found = json.loads(done.stdout[done.stdout.index("{") :])
    assert found["robot"] == "turtlebot2"
    assert set(found["estimates"]) | set(found["untold"])
    assert found["driven_s"] == pytest.approx(399 * 0.02)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "does not say its robot. Give --robot."),
        ((*ROBOT,), "holds no poses (odom of nav_msgs/msg/Odometry) and no commands (cmd_vel of"),
        (
            (*ROBOT, "--topics", "odom=/base/odometry"),
            "holds no commands (cmd_vel of geometry_msgs/msg/TwistStamped",
        ),
        (("--robot", "turtlebot3", "--topics", THEIRS), "turtlebot2"),
        ((*ROBOT, "--task", "point_inertial", "--topics", THEIRS), "point_inertial"),
    ],
)
def test_identify_says_in_one_line_what_is_missing(theirs, words, said):
    done = asked("identify", theirs, *words)
    assert isinstance(done.exception, ConfigError | BagError), done.exception
    assert said in str(done.exception)
    assert "\n" not in str(done.exception)


def test_a_satellite_of_another_program_is_asked_for_its_readings(theirs):
    done = asked("identify", theirs, "--robot", "cubesat_wheels")
    assert (
        "no message on 'imu/data', which shows the inertia. If it has another name there, give --topics"
        in str(done.exception)
    )


def test_odometry_that_is_chosen_by_its_name_is_that_of_every_reader(theirs):
    reading = BagReading(topics={"odom": "/base/odometry"})
    assert open_bag(theirs, reading).odometry().name == "/base/odometry"
    with pytest.raises(BagError, match=r"several odometries .* Choose one: --topics odom=TOPIC"):
        open_bag(theirs).odometry()


def test_a_bag_of_sqlite3_that_is_to_be_recovered_is_referred_to_sqlite3(theirs):
    done = asked("bag", "recover", theirs)
    assert isinstance(done.exception, BagError)
    assert "only .mcap files are recovered" in str(done.exception)
    assert ".recover" in str(done.exception)
