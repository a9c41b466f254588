"""Reports of satellites: attitude and rates by axis, wheels with their limits, inertia, where the rate came from."""

from __future__ import annotations

import dataclasses
import warnings

import numpy as np
import pytest
from matplotlib.figure import Figure

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import odometries
from fulmar_bags.run_record import read_run
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import ODOMETRY
from fulmar_evaluation.rate_sources import RateSource, gyroscope_ended_s, rate_sources
from fulmar_evaluation.report.bag_report import _drawings
from fulmar_evaluation.report.run_report import write_report
from fulmar_evaluation.report.run_view import evaluated, views
from fulmar_evaluation.report.satellite_figures import inertia, table, torques, wheels
from fulmar_evaluation.report.satellite_plot import (
    attitude_errors_deg,
    draw_attitude,
    draw_inertia,
    draw_wheels,
)
from fulmar_evaluation.run_summary import degrees_text, summarise, summary_text
from tests.fulmar_evaluation.test_report import Page
from tests.synthetic_satellite_run import ROBOT, STD, write_satellite_run

DIES_S = 20.0


@pytest.fixture(scope="module")
def turned(tmp_path_factory):
    """A run in which the gyroscope dies and the inertia is estimated."""
    folder = tmp_path_factory.mktemp("runs") / "turned"
    return read_run(write_satellite_run(folder, task="slew", gyroscope_dies_s=DIES_S, estimated=True))


@pytest.fixture(scope="module")
def words(turned, tmp_path_factory):
    """What the page of that run says; no warning of Python on the way."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        out = write_report([turned], tmp_path_factory.mktemp("out") / "report.html")
    return " ".join(Page(out.read_text()).words)


def test_a_page_of_a_satellite_shows_what_turns_it_and_nothing_of_a_place(words):
    for word in (
        "attitude error [°]",
        "turn rate [°/s]",
        "wheel speed [rad/s]",
        "momentum [mN·m·s]",
        "limit ±460 rad/s, ±46 mN·m·s",
        "motor [mN·m]",
        "inertia [kg·m²]",
        "gyroscope silent from 20.0 s",
        "from the gyroscope",
        "from the events",
        "gyroscope, then events from 20.0 s",
        "off in attitude",
        "stays within 0.2°",
    ):
        assert word in words, word
    for word in (
        "from above",
        " [m/s]",
        "– and",
        " 0 cm",
        "0.0°",
        "/ – /",
        "valves or fans",
        "Final position",
    ):
        assert word not in words, word


def test_the_sheet_of_a_satellite_has_no_panel_of_a_place_and_raises_no_warning(turned, tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert write_report([turned], tmp_path / "sheet.png").stat().st_size < 500_000


def test_a_gyroscope_that_dies_is_named_with_its_last_word(turned):
    assert gyroscope_ended_s(turned) == pytest.approx(DIES_S)
    assert rate_sources(turned) == [
        RateSource("gyroscope", 0.0, pytest.approx(DIES_S)),
        RateSource("events", pytest.approx(DIES_S), pytest.approx(30.0)),
    ]


def test_a_gyroscope_that_lives_is_said_nothing_of(tmp_path):
    record = read_run(write_satellite_run(tmp_path / "well", seconds=3.0))
    assert gyroscope_ended_s(record) is None
    assert [source.name for source in rate_sources(record)] == ["gyroscope"]
    assert inertia(views([record])) is None, "nothing was estimated"


def test_errors_about_the_three_axes_are_parts_of_the_whole_one(turned):
    ((run, result),) = evaluated(views([turned]))
    whole = np.linalg.norm(attitude_errors_deg(run, result), axis=1)
    assert whole == pytest.approx(np.rad2deg(result.run.attitude_error[0]), rel=1e-6, abs=1e-6)
    rows = Figure().subplots(2, 1)
    draw_attitude(rows, [run])
    rates = np.stack([line.get_ydata() for line in rows[1].lines[:3]], axis=-1)
    assert rates == pytest.approx(np.rad2deg(turned.truth.angular_velocity_in_body[1:]), abs=1e-9)


def test_momentum_stands_beside_the_speed_of_the_wheels(turned):
    axes = Figure().subplots()
    draw_wheels(axes, views([turned]))
    (momentum,) = axes.child_axes
    robot, figure = load_robot(ROBOT), axes.figure
    figure.draw_without_rendering()
    assert momentum.get_ylim() == pytest.approx(
        1e3 * robot.actuators.spin_inertia * np.array(axes.get_ylim())
    )
    assert [line.get_label() for line in axes.lines[:3]] == ["wheel x", "wheel y", "wheel z"]


def test_a_wheel_near_its_limit_is_drawn_with_it(turned):
    fast = dataclasses.replace(turned.wheels, values=turned.wheels.values + 450.0)
    axes = Figure().subplots()
    draw_wheels(axes, views([dataclasses.replace(turned, wheels=fast)]))
    assert {float(line.get_ydata()[0]) for line in axes.lines[3:]} == {-460.0, 460.0}


def test_the_band_of_an_inertia_holds_95_in_100(turned):
    axes = Figure().subplots()
    draw_inertia(axes, views([turned]))
    low, high = (pick(axes.collections[0].get_paths()[0].vertices[:, 1]) for pick in (np.min, np.max))
    assert high - low == pytest.approx(2 * 1.96 * STD)


def test_two_runs_of_satellites_are_compared(turned, tmp_path):
    other = read_run(write_satellite_run(tmp_path / "other", task="slew", seconds=3.0))
    plots = [draw(views([turned, other])) for draw in (wheels, torques, inertia)]
    assert all(plot is not None for plot in plots)


def test_an_excitation_moved_a_satellite_and_missed_nothing(tmp_path):
    record = read_run(write_satellite_run(tmp_path / "moved", controller="excite", seconds=3.0))
    page = " ".join(Page(write_report([record], tmp_path / "r.html").read_text()).words)
    assert "Moved" in page
    assert "Missed" not in page


def test_a_bag_without_a_task_of_what_stays_at_its_place_shows_how_it_turned(turned):
    bag = open_bag(turned.path)
    titles = [drawing.title for drawing in _drawings(bag, odometries(bag.of(ODOMETRY)))]
    assert titles[0] == "How it turned"
    assert not any("path" in title or "late" in title for title in titles)


def test_small_angles_have_the_digits_that_they_need(turned):
    assert [degrees_text(value) for value in (135.31, 0.58, 0.0194, 1e-5, None)] == [
        "135.3°",
        "0.58°",
        "0.019°",
        "below 0.001°",
        "–",
    ]
    assert "attitude 0.0° off" not in summary_text(summarise(turned))


def test_each_of_many_runs_is_drawn(turned):
    axes = Figure().subplots()
    many = views([dataclasses.replace(turned) for _ in range(6)])
    draw_wheels(axes, many)
    assert len(axes.lines) >= 6 * len(turned.wheels.names)


def test_an_estimate_without_a_spread_is_given_without_one(turned):
    unknown = dataclasses.replace(turned.inertia, std=np.full_like(turned.inertia.std, np.nan))
    (row,) = [
        row for row in table(views([dataclasses.replace(turned, inertia=unknown)])) if "inertia" in row[0]
    ]
    assert "nan" not in row[2][0]
    assert "±" not in row[2][0]
