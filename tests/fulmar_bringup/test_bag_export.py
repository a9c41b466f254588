"""`fulmar bag export`: what a table cannot hold is named, and nothing is written of nothing."""

from __future__ import annotations

import numpy as np
import pytest
from typer.testing import CliRunner

from fulmar_bringup.cli import app
from fulmar_core.errors import BagError
from tests.fulmar_bringup.test_bag_diff import SCAN, bag_of, scan


def export(bag, *words):
    return CliRunner().invoke(app, ["bag", "export", str(bag), *map(str, words)])


@pytest.mark.parametrize("form", ["csv", "npz"])
def test_a_bag_without_messages_is_not_exported(tmp_path, form):
    bag = bag_of(tmp_path / "bag", SCAN)
    done = export(bag, "--to", form, "--out", tmp_path / "out")
    assert isinstance(done.exception, BagError)
    assert not (tmp_path / "out").exists()
    assert not (tmp_path / "out.npz").exists()


def test_a_long_array_is_named_where_a_table_leaves_it_out_and_is_kept_in_numpy(tmp_path):
    ranges = np.linspace(1.0, 2.0, 360)
    bag = bag_of(tmp_path / "bag", SCAN, scan(ranges), scan(ranges + 1.0))
    table = export(bag, "--to", "csv", "--out", tmp_path / "csv")
    assert "left out: /floating_platform/it: ranges" in table.output
    assert "ranges" not in (tmp_path / "csv" / "floating_platform.it.csv").read_text().splitlines()[0]
    arrays = export(bag, "--to", "npz", "--out", tmp_path / "bag.npz")
    assert "left out" not in arrays.output
    kept = np.load(tmp_path / "bag.npz")["floating_platform/it/ranges"]
    np.testing.assert_array_equal(kept, np.stack([ranges, ranges + 1.0]).astype(np.float32))


def test_an_array_whose_length_changes_is_named(tmp_path):
    bag = bag_of(tmp_path / "bag", SCAN, scan(np.zeros(100)), scan(np.zeros(101)))
    assert "its length changes" in export(bag, "--to", "npz", "--out", tmp_path / "bag.npz").output


def test_messages_that_cannot_be_read_are_counted(tmp_path):
    bag = bag_of(tmp_path / "bag", SCAN, scan(np.zeros(3)), scan(np.zeros(3))[:20])
    done = export(bag, "--out", tmp_path / "csv")
    assert "1 messages cannot be read as sensor_msgs/msg/LaserScan" in done.output
