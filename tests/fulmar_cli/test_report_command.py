"""`fulmar report` on foreign bags, and what it does not overwrite."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from rosbags.rosbag2 import Writer
from rosbags.rosbag2.enums import StoragePlugin

from fulmar_bags.bag_reading import BagReading
from fulmar_bags.contents import open_bag
from fulmar_bags.message_types import type_store
from fulmar_bags.run_record import read_any_run
from fulmar_core.config.errors import BagError
from fulmar_evaluation.report.writer import check_overwrite, default_report, source_mark
from fulmar_evaluation.run_evaluation import evaluate_run
from tests.foreign_bag import write_foreign
from tests.fulmar_cli.bag_commands import LQR, POLICY
from tests.fulmar_cli.command_line import complaint


@pytest.fixture
def hand_started(tmp_path):
    """The messages of a run without what only Fulmar's recorder and controllers say of it."""

    def write(*left_out: str, space: str = "floating_platform", truth: bool = False) -> Path:
        topics = dict(open_bag(POLICY).topics)
        if truth:
            topics["/floating_platform/ground_truth/odom"] = topics["/floating_platform/odom"]
        with Writer(tmp_path / "foreign", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
            for name, topic in topics.items():
                if name.endswith(("controller/metadata", *left_out)):
                    continue
                own = name.replace("floating_platform", space)
                connection = writer.add_connection(own, topic.type, typestore=type_store())
                for log_ns, data in zip(topic.log_ns, topic.data, strict=True):
                    writer.write(connection, log_ns, data)
        return tmp_path / "foreign"

    return write


def test_a_report_is_made_again_but_replaces_nothing_else_without_force(fulmar, copy):
    page = copy / "report.html"
    page.write_text("my notes")
    line = complaint(fulmar("report", copy))
    assert f"{page} exists already and is not known to be a report of these bags" in line
    assert "--force" in line
    assert page.read_text() == "my notes"
    assert fulmar("report", copy, "--force")[0] == 0
    check_overwrite(page, source_mark([copy]))
    assert f"{page} exists already and is a report of other bags" in complaint(
        fulmar("report", copy, LQR, "--out", page)
    )


def test_a_comparison_has_a_name_of_its_own():
    assert default_report([POLICY]) == POLICY / "report.html"
    assert default_report([POLICY, LQR]) == POLICY / "comparison.html"


def test_a_mark_follows_the_bag_and_neither_its_folder_nor_a_bag_of_its_name(tmp_path):
    mark = source_mark([POLICY])
    assert source_mark([Path(shutil.copytree(POLICY, tmp_path / "moved" / POLICY.name))]) == mark
    assert source_mark([Path(shutil.copytree(LQR, tmp_path / POLICY.name))]) != mark
    assert source_mark([POLICY, LQR]) != source_mark([LQR, POLICY])


def test_a_bag_without_a_task_is_shown_as_far_as_it_goes_and_evaluated_with_task(fulmar, hand_started):
    bag = hand_started()
    code, out, err = fulmar("report", bag)
    page = Path(out.strip()).read_text()
    assert code == 0
    assert "names no task" in err
    assert "--task" in err
    for shown in ("No result", "names no task", "The path, seen from above", "actuators/command", "Rates"):
        assert shown in page
    assert ">5.00<" in page  # commands a second
    code, _, err = fulmar("report", bag, "--task", "go_to_pose")
    assert (code, err) == (0, "")
    assert "How far from the goal" in (bag / "report.html").read_text()


def test_a_robot_under_another_name_needs_robot(hand_started):
    bag = hand_started(space="platform_3")
    with pytest.raises(BagError, match=r"names no robot.*--robot"):
        evaluate_run(read_any_run(bag, BagReading(task="go_to_pose")))
    assert evaluate_run(read_any_run(bag, BagReading("floating_platform", "go_to_pose"))).success


def test_a_bag_without_a_goal_says_so(hand_started):
    record = read_any_run(hand_started("goal_pose"), BagReading(task="go_to_pose"))
    with pytest.raises(BagError, match="holds no goal on goal_pose"):
        evaluate_run(record)


def test_several_bags_without_a_task_are_not_compared(fulmar, hand_started):
    bag = hand_started()
    assert "names no task" in complaint(fulmar("report", bag, bag))


def test_measured_odometry_is_drawn_unless_another_is_chosen(hand_started):
    bag = open_bag(hand_started(truth=True))
    assert bag.odometry().name == "/floating_platform/odom"
    assert bag.odometry("/floating_platform/ground_truth/odom").name.endswith("ground_truth/odom")


def test_true_odometry_is_drawn_where_none_was_measured(hand_started):
    bag = open_bag(hand_started("platform/odom", truth=True))
    assert bag.odometry().name == "/floating_platform/ground_truth/odom"


def test_odometry_of_any_name_is_taken_where_there_is_one(tmp_path):
    record = read_any_run(write_foreign(tmp_path / "circle", StoragePlugin.MCAP))
    assert len(record.motion) == 200
