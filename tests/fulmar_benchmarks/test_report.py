"""The report of a benchmark stands alone, shows every pair, and says what to see."""

from __future__ import annotations

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from fulmar_benchmarks.campaign import provenance
from fulmar_benchmarks.catalogue import choice
from fulmar_benchmarks.page import write_page
from fulmar_benchmarks.pairs import Pair
from fulmar_benchmarks.results import QUANTILES, PairResult
from fulmar_benchmarks.roboran.campaign import Findings, Roboran, document_of
from fulmar_benchmarks.roboran.document import pair_entry
from fulmar_benchmarks.roboran.targets import ROBOTS, TASKS
from fulmar_benchmarks.unit import KEPT
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episodes
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario

pytestmark = pytest.mark.slow  # every pair is drawn
EPISODES = 300
CURVE = [{"wall_s": 10.0 * i, "steps": 1000 * i, "success_rate": 1.0 - 0.8**i} for i in range(6)]
EVERYWHERE = ("control_deviation", "collided")
FIGURES = {
    "track_velocities": ("velocity_error_m_s", "yaw_rate_error_deg_s", "settling_time_s"),
    "go_through_positions": (
        "goals_reached", "goals_bound", "share_of_bound", "goals_in_1000_steps", "goals_in_100_s",
    ),
}  # fmt: skip
PLACE = ("final_position_error_m", "time_to_target_s", "final_heading_error_deg")


class Page(HTMLParser):
    """Counts elements and collects what a browser would fetch."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.fetched: list[str] = []
        self.words: list[str] = []
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        given = dict(attrs)
        self.fetched += [given[name] for name in ("src", "href", "data", "xlink:href") if given.get(name)]

    def handle_data(self, data):
        self.words.append(data)


def outcome(robot, task, way, rng) -> PairResult:
    """Numbers at random, of the right shapes."""
    the_robot, the_task = load_robot(robot), load_task(task)
    steps, dt = 60, 1.0
    drawn = draw_episodes(the_robot, the_task, load_scenario("nominal"), seed=1, numbers=np.arange(KEPT))
    start = np.stack((drawn.start.x, drawn.start.y, drawn.start.yaw), axis=-1)
    walk = np.cumsum(rng.normal(size=(KEPT, steps, 3)) * 0.1, axis=1)
    names = (*FIGURES.get(task, PLACE), *EVERYWHERE)
    figures = {name: rng.uniform(0.1, 1.0, EPISODES) for name in names}
    if "goals_bound" in figures:
        figures["goals_bound"] = np.full(EPISODES, 12)
    about = {
        "control_dt": dt, "control_hz": 1.0, "episode_s": 60.0, "wall_s": 1.0, "control_steps": 1, "seed": 1,
        "scenario": "nominal", "same_at_64_worlds": True, "thousand_steps_s": 1000.0, "bound": "a bound",
    }  # fmt: skip
    return PairResult(
        about=about if task == "go_through_positions" else {k: v for k, v in about.items() if k != "bound"},
        succeeded=rng.uniform(size=EPISODES) < 0.97,
        figures=figures,
        map_xy=rng.uniform(size=(EPISODES, 2)),
        over_time=np.sort(rng.uniform(0.01, 2.0, (len(QUANTILES), steps)), axis=0),
        paths=start[:, None] + walk,
        starts=start,
        targets=np.asarray(drawn.goal.targets),
        goals=np.cumsum(rng.uniform(size=(KEPT, steps)) < 0.05, axis=1)
        % np.asarray(drawn.goal.targets).shape[1],
        obstacles=np.asarray(drawn.goal.obstacles),
    )


@pytest.fixture(scope="module")
def findings():
    rng = np.random.default_rng(1)
    outcomes = {}
    for task in TASKS:
        for robot in ROBOTS:
            passport = {"wall_s": 120.0, "curve": CURVE}
            pair = Pair(robot, task, "policy", "policy", sha256="a", passport=passport)
            outcomes[pair] = {way: outcome(robot, task, way, rng) for way in ("batch", "mujoco")}
    nobody = Pair("turtlebot2", "go_to_pose", "classical", reason="nobody <drives> it")
    outcomes[nobody] = {}
    entries = [pair_entry(pair, ways) for pair, ways in outcomes.items()]
    document = document_of(
        entries,
        episodes={"batch": 300, "mujoco": 300},
        seed=1,
        scenario="nominal",
    )
    return Findings(provenance("roboran", "fulmar x") | document, list(outcomes), outcomes)


def write_report(findings, out):
    from fulmar_benchmarks.roboran.report.sections import plots

    return write_page(Roboran(choice("roboran", out=out)), findings.document, lambda: plots(findings))


@pytest.fixture(scope="module")
def written(findings, tmp_path_factory):
    return write_report(findings, tmp_path_factory.mktemp("out") / "new")


def test_the_page_needs_nothing_from_the_network(written):
    text = written.read_text()
    assert all(address.startswith(("#", "data:")) for address in Page(text).fetched)
    assert not re.search(r"@import|url\((?!#)", text)
    assert written.stat().st_size < 8_000_000


def test_the_page_shows_every_pair_and_every_task(written):
    words = " ".join(Page(written.read_text()).words)
    for title in ("Go to position", "Go to pose", "Track velocities", "Go through positions", "obstacles"):
        assert title in words
    assert words.count("floating platform") >= len(TASKS)
    assert "nobody <drives> it" in words, "what is missing is reported, not left out"
    assert "✓" in words


def test_every_plot_has_a_caption_and_a_file_below_half_a_megabyte(written):
    text = written.read_text()
    page = Page(text)
    plots = sorted((written.parent / "pictures").glob("*.png"))  # word: folder of reports
    assert len(plots) == page.tags.count("svg") == 1 + 5 * len(TASKS)
    assert text.count('</figure><p class="faint">') == len(plots)
    for plot in plots:
        assert plot.read_bytes().startswith(b"\x89PNG")
        assert plot.stat().st_size < 500_000


def test_a_page_says_what_every_figure_means(written):
    words = " ".join(Page(written.read_text()).words)
    for meaning in ("Distance from the goal at the last step.", "Goals reached over the bound"):
        assert meaning in words


def test_a_task_that_nobody_did_has_no_plots(findings, tmp_path):
    pair = Pair("turtlebot2", "go_to_pose", "policy", reason="no policy is shipped")
    entries = [pair_entry(pair, {})]
    document = document_of(entries, episodes={"batch": 1}, seed=1, scenario="nominal")
    page = write_report(Findings(provenance("roboran", "") | document, [pair], {pair: {}}), tmp_path)
    assert "no policy is shipped" in page.read_text()
    assert len(list((tmp_path / "pictures").iterdir())) == 1  # word: folder of reports


@pytest.mark.parametrize("plot", ["draw_waypoint_paths", "draw_scenes_with_obstacles"])
def test_ways_are_seen_whole_unless_they_lead_far_away(findings, plot):
    from fulmar_benchmarks.roboran.report import path_plots
    from fulmar_benchmarks.roboran.report.view import views

    task = "go_through_positions" if plot == "draw_waypoint_paths" else "go_to_position_with_obstacles"
    runs = views(findings, task)
    near, far = (
        replace(run.main, paths=run.main.paths + shift)
        for run, shift in zip(runs[:2], (2.5, 60.0), strict=True)
    )
    runs = [replace(run, outcomes={"batch": main}) for run, main in zip(runs[:2], (near, far), strict=True)]
    axes = getattr(path_plots, plot)(runs).axes
    for one in axes:
        (left, right), (low, high) = one.get_xlim(), one.get_ylim()
        ways = np.concatenate([line.get_xydata() for line in one.lines])
        whole = np.all((ways > (left, low)) & (ways < (right, high)))
        assert whole == (ways.max() < 30.0)
        assert right - left < 25.0


@pytest.mark.parametrize("low", [0.2, 0.5, 0.81, 0.9])
def test_the_overview_marks_its_scale_where_its_numbers_say(findings, low):
    from fulmar_benchmarks.roboran.report.glance_plot import draw_glance

    entries = [entry | {"judged": {"batch": low}} for entry in findings.document["pairs"][:1]]
    figure = draw_glance(dict(findings.document) | {"pairs": entries})
    figure.canvas.draw()
    (axes,) = figure.axes
    for at, label in zip(axes.get_xticks(), axes.get_xticklabels(), strict=True):
        assert float(label.get_text().removesuffix(" %")) == pytest.approx(100.0 * at)
