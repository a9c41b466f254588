"""`fulmar bag plot`: a run with its goal and what its actuators did, as a page or as a plot."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import odometries
from fulmar_bags.run_record import read_run
from fulmar_core.robots.topics import ODOMETRY
from fulmar_evaluation.report.bag_report import _drawings
from fulmar_evaluation.report.control_plot import open_spans
from fulmar_evaluation.run_evaluation import evaluate_run
from tests.fulmar_cli.bag_commands import BAGS, POLICY, answer, ask


def test_a_plot_of_another_kind_is_refused_as_what_it_is(tmp_path):
    refused = str(ask("plot", POLICY, "--out", tmp_path / "run.pdf").exception)
    assert "'.pdf' cannot be drawn" in refused
    assert "report" not in refused.split(": ", 1)[1]


def test_a_run_is_plotted_with_its_goal(tmp_path):
    (file,) = answer("plot", POLICY, "--out", tmp_path / "run.html")["files"]
    assert "How far from the goal" in Path(file).read_text()


@pytest.mark.parametrize("name", ["floating_platform_go_to_pose_policy", "turtlebot2_go_to_position_policy"])
def test_a_bag_without_what_was_applied_is_plotted_with_what_was_commanded(name):
    record = read_run(BAGS / name)
    assert not len(record.applied)
    np.testing.assert_array_equal(record.actuation.effort, record.commanded.effort)
    assert evaluate_run(record).run.shares.any()
    assert any(open_spans(record, row) for row in range(len(record.actuation.names)))


def test_panels_of_commands_differ_by_their_topics(tmp_path):
    bag = open_bag(POLICY)
    drawings = _drawings(bag, odometries(bag.of(ODOMETRY)))
    titles = [drawing.title for drawing in drawings if "actuators" in drawing.title]
    assert len(titles) == len(set(titles)) > 1
