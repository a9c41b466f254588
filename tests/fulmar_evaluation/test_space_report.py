"""Reports of runs in space: both views at one scale, attitude, motion, all sixteen valves; nothing of the plane."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import same_color
from matplotlib.figure import Figure
from typer.testing import CliRunner

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import odometries
from fulmar_bags.run_record import read_run
from fulmar_cli.main import app
from fulmar_core.robots.calibration import load_calibration
from fulmar_core.robots.topics import ODOMETRY
from fulmar_core.states.attitude import angle_between
from fulmar_core.states.rotation import rotate
from fulmar_core.states.spatial import SpatialState, quat_of
from fulmar_evaluation.report.bag_report import _drawings
from fulmar_evaluation.report.control_plot import actuators_height, draw_actuators, open_spans
from fulmar_evaluation.report.error_plot import draw_progress, strips
from fulmar_evaluation.report.motion_plot import draw_motion
from fulmar_evaluation.report.run_report import _overview, write_report
from fulmar_evaluation.report.run_view import DISPLAY_NAMES, views
from fulmar_evaluation.report.space_plot import draw_space
from fulmar_evaluation.report.style import BODY_AXES, CONTROLLER_COLOURS, colours, house_style
from fulmar_evaluation.report.trajectory_plot import draw_near, given_targets
from fulmar_evaluation.run_summary import summarise
from tests.fulmar_cli.bag_commands import POLICY, answer
from tests.fulmar_evaluation.test_report import Page
from tests.synthetic_space_run import SpacePlan, write_space_run


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A run in space that reached its goal."""
    return write_space_run(tmp_path_factory.mktemp("runs") / "flown", SpacePlan())


@pytest.fixture(scope="module")
def page(flown, tmp_path_factory):
    out = write_report([read_run(flown)], tmp_path_factory.mktemp("out") / "report.html")
    return out, " ".join(Page(out.read_text()).words)


def drawn(flown):
    """The figure of both views, laid out."""
    figure = Figure(figsize=(6.2, 6.0), layout="constrained")
    with house_style():
        assert draw_space(figure, views([read_run(flown)]))
        figure.draw_without_rendering()
    return figure


def test_a_run_in_space_keeps_all_three_turn_rates(flown):
    motion = read_run(flown).motion
    assert motion.angular_velocity_in_body.shape == (len(motion), 3)
    assert (np.ptp(motion.angular_velocity_in_body, axis=0) > 0.01).all()


def test_the_figures_of_a_run_in_space_are_those_of_its_last_state(flown):
    record = read_run(flown)
    summary, state = summarise(record), SpatialState.from_rigid(record.truth.states)[-1]
    target = record.goals[-1].targets[0]
    assert summary["success"]
    assert summary["final_position_error_m"] == pytest.approx(float(state.distance_to(target)), rel=1e-5)
    away = np.rad2deg(float(angle_between(state.quat, quat_of(target))))
    assert summary["final_attitude_error_deg"] == pytest.approx(away, rel=1e-4)
    assert summary["final_heading_error_deg"] is None


def test_a_page_of_space_has_its_plots_and_figures_and_nothing_of_the_plane(page):
    out, words = page
    assert out.read_text().count("<svg") == 6
    for word in (
        "from above and from the side",
        "from above (x, y)",
        "from the side (x, z)",
        "z [m]",
        "attitude error",
        "speed [m/s]",
        "turn rate [°/s]",
        "Which valves",
        "Final attitude error",
        "within 5 cm and 5° of the goal",
        "Go to pose in space",
    ):
        assert word in words
    assert "eading" not in words


def test_a_page_and_a_plot_of_space_are_small(page, flown, tmp_path):
    assert page[0].stat().st_size < 2_000_000
    assert write_report([read_run(flown)], tmp_path / "r.png").stat().st_size < 500_000


def test_both_views_have_one_scale_and_hold_the_whole_way(flown):
    above, side = drawn(flown).axes[:2]
    assert above.get_xlim() == side.get_xlim()
    assert np.ptp(above.get_ylim()) == pytest.approx(np.ptp(side.get_ylim()))
    scales = [axes.get_window_extent().height / np.ptp(axes.get_ylim()) for axes in (above, side)]
    assert scales[0] == pytest.approx(scales[1])
    assert above.get_window_extent().width / np.ptp(above.get_xlim()) == pytest.approx(scales[0])
    place = read_run(flown).motion.position
    for axes, up in ((above, 1), (side, 2)):
        (low, high), (left, right) = axes.get_ylim(), axes.get_xlim()
        assert low < place[:, up].min() < place[:, up].max() < high
        assert left < place[:, 0].min() < place[:, 0].max() < right
        assert {"start", "goal"} <= {text.get_text() for text in axes.texts}


def test_axes_of_the_body_are_drawn_as_they_look_from_each_side(flown):
    motion = read_run(flown).motion
    for axes, columns in zip(drawn(flown).axes[:2], ([0, 1], [0, 2]), strict=True):
        for axis, colour in zip(np.eye(3), BODY_AXES, strict=True):
            stroke = next(line for line in axes.lines if same_color(line.get_color(), colour))
            begin, end = np.array(stroke.get_xydata())
            seen = rotate(motion.quat_xyzw[1], axis)[columns]  # the first step ends there
            assert begin == pytest.approx(motion.position[1, columns])
            assert (end - begin) / 0.434 == pytest.approx(seen, abs=1e-6), "1.4 radii of 0.31 m"


def test_motion_is_drawn_with_the_length_of_the_turn_rate(flown):
    record, rows = read_run(flown), Figure().subplots(2, 1)
    draw_motion(rows, views([record]))
    rates = np.linalg.norm(record.truth.angular_velocity_in_body, axis=1)
    assert rows[1].lines[0].get_ydata() == pytest.approx(np.rad2deg(rates[1:]), rel=1e-4, abs=1e-4)


def test_sixteen_valves_have_rows_that_can_be_read(flown):
    runs = views([read_run(flown)])
    height = actuators_height(runs, 1.75)
    assert height / 16 > 0.15, "inches: the type of a tick is 0.13 high"
    axes = Figure().subplots()
    draw_actuators(axes, runs[0])
    assert list(axes.get_yticks()) == list(range(1, 17))
    assert len(axes.collections) == 16
    open_s = sum(end - begin for begin, end in open_spans(runs[0].record, 1))
    applied = runs[0].record.applied.effort[:, 1]
    assert open_s == pytest.approx(0.04 * np.count_nonzero(applied), abs=0.05)


def test_rows_of_robots_with_few_actuators_are_as_high_as_before(reached):
    assert actuators_height(views([read_run(reached)]), 1.75) == 1.75


@pytest.mark.parametrize(
    ("task", "words"),
    [
        pytest.param(
            "go_to_position_3d", ("distance", "1 cm", "within 5 cm of the goal"), marks=pytest.mark.slow
        ),
        pytest.param(
            "track_velocities_3d",
            ("velocity error", "turn rate error", "°/s, on average", "within 0.1 m/s"),
            marks=pytest.mark.slow,
        ),
        ("go_through_poses_3d", ("make a success", "Numbered circles", "attitude error")),
        pytest.param(
            "go_through_positions_3d", ("make a success", "Numbered circles"), marks=pytest.mark.slow
        ),
    ],
)
def test_every_task_in_space_gets_a_page_and_a_plot(task, words, tmp_path):
    plan = SpacePlan(task=task, duration_s=15.0, start=None, goal=None)
    record = read_run(write_space_run(tmp_path / "bag", plan))
    reported = " ".join(Page(write_report([record], tmp_path / "r.html").read_text()).words)
    for word in (*words, "from the side (x, z)"):
        assert word in reported
    assert "eading" not in reported
    assert write_report([record], tmp_path / "r.png").exists()


def test_two_runs_in_space_share_a_page(flown, tmp_path):
    record = read_run(flown)
    other = dataclasses.replace(record, info={**record.info, "controller": "policy"})
    words = " ".join(Page(write_report([record, other], tmp_path / "r.html").read_text()).words)
    assert words.count("Reached") == 2


@pytest.mark.slow
def test_bag_commands_work_on_a_run_in_space(flown, tmp_path):
    topics = {topic["name"] for topic in answer("info", flown)["topics"]}
    assert "/spacecraft_16/odom" in topics
    assert answer("diff", flown, flown)["same"]
    (file,) = answer("plot", flown, "--out", tmp_path / "run.html")["files"]
    assert "from the side" in Path(file).read_text()


def test_a_bag_without_a_task_shows_space_where_the_body_leaves_the_plane(tmp_path):
    plan = SpacePlan(task="track_velocities_3d", named=False, duration_s=10.0, start=None, goal=None)
    bag = open_bag(write_space_run(tmp_path / "bag", plan))
    drawings = {drawing.title: drawing for drawing in _drawings(bag, odometries(bag.of(ODOMETRY)))}
    spans = []
    for title in ("The path, seen from above (x, y)", "The path, seen from the side (x, z)"):
        axes = Figure(figsize=(6.2, 4.0)).subplots()
        drawings[title].draw(axes)
        spans.append(np.ptp(axes.get_ylim()))
    assert spans[0] == pytest.approx(spans[1])
    flat = open_bag(POLICY)
    titles = [drawing.title for drawing in _drawings(flat, odometries(flat.of(ODOMETRY)))]
    assert not any("side" in title for title in titles)
    assert titles[0] == "The path, seen from above"


def progress(view):
    """The strips of errors of one run as they stand in a report."""
    figure = Figure(figsize=(7.4, 0.5 + 1.7 * len(strips([view]))), layout="constrained")
    rows = figure.subplots(len(strips([view])), 1, sharex=True)
    with house_style():
        draw_progress(rows, [view])
        figure.draw_without_rendering()
    return rows


def test_no_label_of_an_error_is_taller_than_its_axis_and_no_unit_stands_twice(flown):
    with house_style():
        sheet = _overview(views([read_run(flown)]), "title")
        sheet.draw_without_rendering()
    errors = {axes.get_ylabel(): axes for axes in sheet.axes if axes.get_yscale() == "log"}
    assert list(errors) == ["distance", "attitude error"]
    for axes in errors.values():
        assert axes.yaxis.label.get_window_extent().height < axes.get_window_extent().height
    assert "1 cm" in [tick.get_text() for tick in errors["distance"].get_yticklabels()]


@pytest.mark.filterwarnings("error")  # also where nothing lies on the scale
@pytest.mark.parametrize(("least", "lowest"), [(0.05, 2e-3), (5e-4, 4e-4), (1e-12, 1e-4), (0.0, 2e-3)])
def test_the_scale_of_distances_goes_as_low_as_they_do(flown, least, lowest):
    (view,) = views([read_run(flown)])
    run = view.result.run
    flat = dataclasses.replace(run, position_error=np.full_like(run.position_error, least))
    near = dataclasses.replace(view, result=dataclasses.replace(view.result, run=flat))
    assert progress(near)[0].get_ylim()[0] == pytest.approx(lowest)


@pytest.mark.slow
def test_a_body_in_space_is_identified_from_its_bag(flown, tmp_path):
    out = tmp_path / "calibration.yaml"
    done = CliRunner().invoke(
        app, ["identify", str(flown), "--known", "mass=5.32+-0.01", "--out", str(out), "--json"]
    )
    assert done.exit_code == 0, done.exception
    found = json.loads(done.stdout[done.stdout.index("{") :])
    assert found["estimates"]["pitch_inertia"]["value"] == pytest.approx(0.2045, rel=0.05)
    assert found["estimates"]["thrust"]["value"] == pytest.approx(1.0, rel=0.02)
    assert {"x_m", "y_m", "z_m", "quaternion_w_rad"} <= set(found["residuals"])
    assert load_calibration(out).pitch_inertia is not None


def test_laws_in_space_have_names_and_colours_of_their_own():
    names = ("policy", "lqr", "pd", "classical", "excite")
    found = colours(names)
    assert len(set(found)) == len(names)
    assert found == [CONTROLLER_COLOURS[name] for name in names]
    assert not set(found) & set(BODY_AXES)
    assert (DISPLAY_NAMES["lqr"], DISPLAY_NAMES["pd"]) == ("LQR", "PD")


def test_a_goal_that_moves_is_drawn_as_its_path_and_its_end(flown):
    """Not as hundreds of goals; the close look shows the way as seen from the goal."""
    (view,) = views([read_run(flown)])
    assert view.result is not None
    way = view.record.motion.position[view.result.samples]
    aims = view.result.aims.copy()
    aims[:, :3] = way + 0.01
    moved = dataclasses.replace(view.result, aims=aims, targets=aims[-1:], path=way[::20])
    moving = dataclasses.replace(view, result=moved)
    assert moving.result.target_moves
    assert not view.result.target_moves
    assert given_targets(moving.result).shape == (1, 7)
    figure = Figure()
    draw_near(figure.subplots(), [moving], (0, 1))
    line = figure.axes[0].lines[0]
    np.testing.assert_allclose(line.get_xydata(), -1.0)  # cm
    figure = Figure()
    assert draw_space(figure, [moving])
    seen = figure.axes[0]
    tolerance = moving.result.task.tolerance.position
    assert sum(getattr(patch, "radius", 0.0) == tolerance for patch in seen.patches) == 1
    assert any(np.array_equal(each.get_xydata(), moving.result.path[:, :2]) for each in seen.lines)
    start, goal = sorted((text.get_position() for text in seen.texts), key=lambda place: place[1])
    assert goal[1] - start[1] > 0.2
