"""A report stands alone, says how the runs went, and shows what really happened."""

from __future__ import annotations

import dataclasses
import re
import shutil
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from fulmar_bags.run_record import read_run
from fulmar_bags.writer import BagWriter
from fulmar_core.config.errors import ConfigError
from fulmar_evaluation.report.control_plot import open_spans, watchdog_spans
from fulmar_evaluation.report.run_report import write_report
from fulmar_evaluation.report.style import colours
from tests.synthetic_run import DRAWN, Plan, write_run


class Page(HTMLParser):
    """Counts elements and collects what a browser would fetch."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.fetched: list[str] = []
        self.words: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        given = dict(attrs)
        self.fetched += [given[name] for name in ("src", "href", "data") if given.get(name)]
        self.fetched += [given["xlink:href"]] if "xlink:href" in given else []

    def handle_data(self, data):
        self.words.append(data)


@pytest.fixture(scope="module")
def compared(reached, calm, tmp_path_factory):
    out = write_report(
        [read_run(calm), read_run(reached)], tmp_path_factory.mktemp("out") / "new" / "report.html"
    )
    return out, Page(out.read_text())


def test_a_page_needs_nothing_from_the_network(compared):
    out, page = compared
    assert all(address.startswith("#") for address in page.fetched)
    assert not re.search(r"@import|url\((?!#)", out.read_text())
    assert out.stat().st_size < 2_000_000


def test_a_page_fits_a_phone_and_a_dark_screen(compared):
    text = compared[0].read_text()
    assert 'name="viewport"' in text
    assert "prefers-color-scheme: dark" in text
    assert "var(--ink)" in text[text.index("<svg") :]


def test_a_page_begins_with_a_result_on_each_run(compared):
    words = " ".join(compared[1].words)
    assert words.index("Reached") < words.index("In figures")
    assert words.count("Reached") == 2
    assert "within 10 cm and 10° of the goal for all of the last 4 s" in words


def test_a_page_shows_every_plot_with_words(compared):
    _, page = compared
    assert page.tags.count("svg") == 5
    words = " ".join(page.words)
    for title in ("seen from above", "How far", "Which valves", "Gas used", "How fast"):
        assert title in words
    for label in (
        "x [m]",
        "time [s]",
        "from measurement sent to command sent [ms]",
        "commands [%]",
        "open-valve time [s]",
    ):
        assert label in page.words


def test_a_page_shows_the_robot_s_rate_apart_from_the_wall_clock_s(reached, tmp_path):
    record = read_run(reached)
    fast = dataclasses.replace(record, info={**record.info, "rate": 4.0})
    words = " ".join(Page(write_report([fast], tmp_path / "r.html").read_text()).words)
    assert "Control rate in the robot's own time 1.25 Hz" in words
    assert "Command rate wall-clock 5.00 Hz" in words


def test_two_reports_of_one_run_are_the_same_bytes(reached, tmp_path):
    first, second = (write_report([read_run(reached)], tmp_path / name) for name in ("a.html", "b.html"))
    assert first.read_bytes() == second.read_bytes()


def test_a_plot_is_small_and_a_plot(reached, calm, tmp_path):
    out = write_report([read_run(calm), read_run(reached)], tmp_path / "overview.png")
    assert out.read_bytes().startswith(b"\x89PNG")
    assert out.stat().st_size < 500_000


def test_a_silent_controller_is_visible(silenced, tmp_path):
    record = read_run(silenced)
    ((begin, end),) = watchdog_spans(record)
    assert begin == pytest.approx(8.2, abs=0.05), "the last command at 7.8 s and 0.4 s of patience"
    assert end == pytest.approx(15.0, abs=0.05)
    words = " ".join(Page(write_report([record], tmp_path / "r.html").read_text()).words)
    assert "closed by the watchdog" in words
    assert "Missed" in words


def test_a_healthy_run_shows_no_watchdog(reached):
    assert watchdog_spans(read_run(reached)) == []


def test_bars_of_a_valve_add_up_to_its_open_time(reached):
    record = read_run(reached)
    for valve in range(8):
        drawn = sum(end - begin for begin, end in open_spans(record, valve))
        assert drawn == pytest.approx(0.02 * np.count_nonzero(record.applied.effort[:, valve]), abs=0.03)


def test_runs_of_one_controller_differ(reached, silenced, tmp_path):
    words = Page(write_report([read_run(reached), read_run(silenced)], tmp_path / "r.html").read_text()).words
    assert "LQR (reached)" in words
    assert "LQR (silenced)" in words
    assert len(set(colours(["lqr", "lqr", "policy", "mine", "yours"]))) == 5


def test_names_of_bags_are_no_formulas(reached, tmp_path):
    odd = [Path(shutil.copytree(reached, tmp_path / name)) for name in ("a$\\frac{$", "b$")]
    out = write_report([read_run(path) for path in odd], tmp_path / "both.png")
    assert out.stat().st_size > 10_000


def test_an_empty_run_still_gets_a_page_and_a_plot(tmp_path):
    BagWriter(tmp_path / "bag", run_info={"robot": "floating_platform", "task": "go_to_pose"}).close()
    record = read_run(tmp_path / "bag")
    assert "No result" in write_report([record], tmp_path / "r.html").read_text()
    assert write_report([record], tmp_path / "r.png").exists()


def test_text_of_a_run_cannot_become_markup(reached, tmp_path):
    record = read_run(reached)
    evil = dataclasses.replace(record, info={**record.info, "command": "<script>alert(1)</script>"})
    assert "<script>" not in write_report([evil], tmp_path / "r.html").read_text()


def test_another_kind_of_file_is_refused(reached, tmp_path):
    with pytest.raises(ConfigError, match=r"'\.pdf' cannot be drawn"):
        write_report([read_run(reached)], tmp_path / "report.pdf")
    with pytest.raises(ConfigError, match="at least one bag"):
        write_report([], tmp_path / "report.html")


def test_runs_of_two_tasks_are_not_compared(reached, tmp_path):
    record = read_run(reached)
    other = dataclasses.replace(record, path=Path("other"), info={**record.info, "task": "go_to_position"})
    with pytest.raises(
        ConfigError, match=r"^other is of task 'go_to_position', .* of 'go_to_pose'\..*one task"
    ):
        write_report([record, other], tmp_path / "report.html")
    assert not (tmp_path / "report.html").exists()


@pytest.mark.parametrize(
    ("robot", "task", "words"),
    [
        pytest.param(
            "turtlebot2",
            "go_through_poses",
            ("make a success", "targets reached", "Effort spent"),
            marks=pytest.mark.slow,
        ),
        ("turtlebot2", "track_velocities", ("velocity error", "turn rate error", "m/s off")),
        ("kingfisher", "go_to_position_with_obstacles", ("Grey discs are obstacles", "distance")),
        pytest.param(
            "leatherback",
            "race_waypoints",
            ("Numbered circles", "What the actuators did"),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_every_kind_of_task_and_robot_gets_a_page_and_a_plot(robot, task, words, tmp_path):
    plan = Plan(robot=robot, task=task, controller="classical", control_hz=10.0, duration_s=20.0, **DRAWN)
    record = read_run(write_run(tmp_path / "bag", plan))
    reported = " ".join(Page(write_report([record], tmp_path / "r.html").read_text()).words)
    for word in words:
        assert word in reported
    assert write_report([record], tmp_path / "r.png").exists()
