"""What `fulmar bag rerun` shows besides differences: the answers, and why steps have none."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2.enums import StoragePlugin
from typer.testing import CliRunner

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import messages
from fulmar_bags.figures import controllers_of
from fulmar_bags.message_types import type_store
from fulmar_bags.writer import BagWriter
from fulmar_cli.main import app
from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.topics import ACTION, METADATA, ODOMETRY
from tests.foreign_bag import write_foreign

POLICY = Path(__file__).resolve().parents[1] / "replay" / "bags" / "floating_platform_go_to_pose_policy"
REQUIRED = ("--controller", "policy", "--robot", "turtlebot2", "--task", "go_to_position", "--goal", "0,0,0")


def ask(*words: object):
    return CliRunner().invoke(app, ["bag", *map(str, words)])


def copied(folder: Path, *, info: dict | None = None, said: tuple[str, ...] = (), spoilt: int = 0) -> Path:
    """The reference bag with something else: its info, metadata at its end, poses that are no numbers."""
    source = open_bag(POLICY)
    bag = BagWriter(folder, run_info={**(source.info or {}), **(info or {})})
    for topic in source.topics.values():
        bag.add_topic(topic.name, topic.type, "stream")
    odometry = source.of(ODOMETRY)
    odometry.data = list(odometry.data)
    for index, (_, message) in enumerate(messages(odometry)):
        if index >= len(odometry) - spoilt:
            message.pose.pose.position.x = float("nan")
            odometry.data[index] = bytes(type_store().serialize_cdr(message, odometry.type))
    every = sorted(
        (log, topic.name, i) for topic in source.topics.values() for i, log in enumerate(topic.log_ns)
    )
    for log, name, index in every:
        bag.write(name, source.topics[name].data[index], log_ns=log)
    for text in said:
        message = type_store().types[METADATA.type](data=text)
        data = bytes(type_store().serialize_cdr(message, METADATA.type))
        bag.write(source.topic_name(METADATA), data, log_ns=every[-1][0] + 1)
    bag.close()
    return folder


def test_answers_to_a_bag_of_others_are_written_and_exit_code_1_says_that_nothing_was_compared(tmp_path):
    bag = write_foreign(tmp_path / "bag", StoragePlugin.MCAP)
    done = ask("rerun", bag, *REQUIRED, "--out", tmp_path / "answers.csv")
    assert done.exit_code == 1
    assert "the bag holds no answers to compare with" in done.output
    with (tmp_path / "answers.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert ask("rerun", bag, *REQUIRED, "--out", tmp_path / "answers.npz").exit_code == 1
    arrays = np.load(tmp_path / "answers.npz", allow_pickle=False)
    assert len(rows) == len(arrays["command"]) > 30
    assert [float(row["command.speed"]) for row in rows] == arrays["command"][:, 0].tolist()
    assert arrays["command"].any()
    assert set(arrays["observation_names"]) == {
        name[12:] for name in rows[0] if name.startswith("observation.")
    }


def test_answers_have_a_known_format(tmp_path):
    done = ask("rerun", POLICY, "--out", tmp_path / "answers.xls")
    assert isinstance(done.exception, ConfigError)


def test_why_a_controller_was_not_asked_is_counted(tmp_path):
    bag = copied(tmp_path / "bag", spoilt=9)
    done = ask("rerun", bag, "--from", "odometry", "--json")
    (pause,) = json.loads(done.stdout[done.stdout.index("{") :])["not_asked"]
    assert (pause["steps"], pause["first_step"]) == (9, 91)
    assert "not finite" in pause["reason"] or "nan" in pause["reason"].lower()
    assert "not asked at 9 steps, from step 91" in ask("rerun", bag, "--from", "odometry").output


def test_a_bundle_that_is_gone_is_named_with_the_one_that_is_asked_instead(tmp_path):
    bag = copied(tmp_path / "bag", info={"policy": "/nowhere/bundle"})
    assert "/nowhere/bundle, is gone" in " ".join(ask("rerun", bag).output.split())
    assert "is gone" not in ask("rerun", POLICY).output


def test_the_controller_that_began_is_compared_and_the_others_are_reported(tmp_path):
    bag = copied(tmp_path / "bag", said=(json.dumps({"sha256": "0" * 64, "fallback": True}),))
    done = ask("rerun", bag, "--json")
    found = json.loads(done.stdout[done.stdout.index("{") :])
    assert found["recorded_sha256"] == found["recorded_sha256s"][0]
    assert found["recorded_sha256s"][1:] == ["0" * 64]
    assert len(controllers_of(open_bag(bag))) == 2
    assert "the run used 2 controllers one after another" in ask("rerun", bag).output


@pytest.mark.parametrize("option", [("--goal", "0,0,0"), ("--odometry", "/odom")])
def test_options_without_effect_are_refused(option):
    done = ask("rerun", POLICY, *option)
    assert isinstance(done.exception, ConfigError)
    assert "--from odometry" in str(done.exception)


def test_damage_gives_exit_code_1_whatever_is_asked(tmp_path):
    bag = Path(shutil.copytree(POLICY, tmp_path / "bag"))
    shutil.copy(next(bag.glob("*.mcap")), bag / "bag_1.mcap")
    (bag / "bag_1.mcap").write_bytes(b"not a bag at all")
    assert open_bag(bag).warnings
    assert len(open_bag(bag).of(ACTION)) == 100
    for words in (
        ("info", bag),
        ("rerun", bag),
        ("diff", bag, bag),
        ("export", bag, "--out", tmp_path / "csv"),
        ("plot", bag, "--out", tmp_path / "plot.png"),
    ):
        done = ask(*words)
        assert done.exit_code == 1, (words, done.output)
        assert isinstance(done.exception, SystemExit)


def test_a_warning_that_explains_an_error_stands_before_it(tmp_path, monkeypatch):
    def fails(*_args, **_kwargs):
        raise ConfigError("the controller cannot be loaded.")

    monkeypatch.setattr("fulmar_evaluation.rerun.rerun_bag.answers_of", fails)
    done = ask("rerun", copied(tmp_path / "bag", info={"policy": "/nowhere/bundle"}))
    assert done.exit_code != 0
    assert "/nowhere/bundle, is gone" in " ".join(done.output.split())


def test_unknown_names_are_refused_before_a_bag_is_opened(tmp_path):
    done = ask("rerun", tmp_path / "nowhere", "--from", "observation")
    assert "Did you mean 'observations'" in str(done.exception)
