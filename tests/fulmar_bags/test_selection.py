"""Only some topics of a bag are read where the others are not needed."""

from __future__ import annotations

import pytest
from rosbags.rosbag2.enums import StoragePlugin

from fulmar_bags.contents import open_bag
from fulmar_bags.selection import Selection
from fulmar_core.robots.topics import ODOMETRY
from tests.foreign_bag import write_foreign
from tests.fulmar_cli.bag_commands import POLICY


def only_odometry(_topic: str, kind: str) -> bool:
    return kind == ODOMETRY.type


def test_what_is_not_wanted_is_not_there_and_no_loss_is_reported():
    bag = open_bag(POLICY, selection=Selection(only_odometry))
    assert [topic.type for topic in bag.topics.values()] == [ODOMETRY.type]
    assert len(bag.of(ODOMETRY)) == len(open_bag(POLICY).of(ODOMETRY))
    assert not bag.warnings
    assert bag.robot == open_bag(POLICY).robot


@pytest.mark.parametrize("storage", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_bags_of_every_storage_are_read_in_part(tmp_path, storage):
    folder = write_foreign(tmp_path / "theirs", storage)
    whole, bag = open_bag(folder), open_bag(folder, selection=Selection(only_odometry, checks=False))
    assert len(whole.topics) > 1 and list(bag.topics) == ["/base/odometry"]
    assert list(bag.topics["/base/odometry"].data) == list(whole.topics["/base/odometry"].data)


def test_progress_rises_to_the_end_of_the_last_file():
    shares: list[float] = []
    open_bag(POLICY, selection=Selection(progress=shares.append))
    assert shares == sorted(shares) and 0.0 <= shares[-1] <= 1.0
