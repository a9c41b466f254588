"""The pictures of each task, each with words for somebody who has never seen one."""

from __future__ import annotations

from collections.abc import Callable

from matplotlib.figure import Figure

from fulmar_benchmarks.roboran.campaign import CampaignResult
from fulmar_benchmarks.roboran.report.curve_plot import curve_of, draw_curves
from fulmar_benchmarks.roboran.report.headline_plot import draw_headline
from fulmar_benchmarks.roboran.report.map_plot import draw_map
from fulmar_benchmarks.roboran.report.path_plot import draw_paths
from fulmar_benchmarks.roboran.report.scene_plot import draw_courses, draw_scenes_with_obstacles
from fulmar_benchmarks.roboran.report.spread_plot import draw_spreads
from fulmar_benchmarks.roboran.report.time_plot import draw_errors_over_time, draw_goals_over_time
from fulmar_benchmarks.roboran.report.velocity_plot import draw_velocities
from fulmar_benchmarks.roboran.report.view import View, views
from fulmar_core.metrics import counts_targets
from fulmar_evaluation.report.plots import Picture

Add = Callable[[str, str, str, Figure], None]  # name of the file, title, caption


def headline(findings: CampaignResult) -> Picture:
    """All pairs at a glance; call inside `house_style`."""
    caption = """
    The further right, the better. A filled dot is our success in the core's batch, a diamond the same in MuJoCo,
    where nothing was trained; both should lie right of the upright stroke, which is what is required. The grey ring
    is what the thesis reports, with its spread over training seeds. Where waypoints are counted, ours is the share
    of what physics allows; the thesis reports no such share."""
    return Picture("At a glance", _words(caption), draw_headline(findings.document))


def pictures_of(findings: CampaignResult, task: str) -> list[tuple[str, Picture]]:
    """Pictures of one task with the names of their files; call inside `house_style`."""
    runs = views(findings, task)
    if not runs:
        return []
    drawn: list[tuple[str, Picture]] = []

    def add(name: str, title: str, caption: str, figure: Figure) -> None:
        drawn.append((f"{task}_{name}", Picture(title, _words(caption), figure)))

    learned = [run for run in runs if curve_of(run)]
    if learned:
        add(
            "learning",
            "How fast it was learned",
            """
            Success on held-out episodes each time the learner was checked, over the wall-clock of training on two
            cores. Dashed: what is required of the finished policy. A curve that rises steeply and stays up is good.""",
            draw_curves(learned),
        )
    if counts_targets(runs[0].task):
        _with_waypoints(runs, add)
    elif runs[0].task.tolerance.velocity:
        _with_velocities(runs, add)
    elif runs[0].main.obstacles.shape[1]:
        _with_obstacles(runs, add)
    else:
        _to_a_place(runs, add)
    tracks = runs[0].task.tolerance.velocity > 0.0
    shares = "share_of_bound" in runs[0].main.figures
    add(
        "map",
        "Where it is hard",
        """
        The mean share of the bound over how far apart an episode's waypoints are and how sharply its course turns:
        the darker a field, the more is left to gain."""
        if shares
        else f"""
        The share of failed episodes over {"the last wanted velocity" if tracks else "where they begin"}. Pale fields
        have no failures, white ones too few episodes; a dark corner tells what the controller cannot do. The number
        above each panel counts all failures; where it is small, single episodes make the colours.""",
        draw_map(runs),
    )
    add(
        "spread",
        "How the figures are spread",
        """
        For each value on the horizontal axis the share of episodes that stay at or below it. For errors and times a
        curve further left is better, for waypoints further right. Solid is the batch, dashed is MuJoCo: where the two
        lie on one another, the core's dynamics and MuJoCo's agree. A curve that ends below 100 % belongs to episodes
        that never settle. The upright line is the tolerance.""",
        draw_spreads(runs, task),
    )
    return drawn


def _to_a_place(runs: list[View], add: Add) -> None:
    turned = runs[0].task.tolerance.heading_deg > 0.0
    add(
        "paths",
        "The ways, seen from above",
        f"""
        The first {len(runs[0].main.paths)} episodes, moved {"and turned " if turned else ""}so that all goals lie in
        the middle{", with the wanted heading along the arrow" if turned else ""}. Dots are starts, the small circle is
        the tolerance. Red ways do not end well.""",
        draw_paths(runs),
    )
    _errors(runs, add)


def _with_obstacles(runs: list[View], add: Add) -> None:
    add(
        "paths",
        "Around what stands in the way",
        """
        Of each robot two episodes: above one with many obstacles that went well, below one that did not, if there is
        one (red). Grey discs are obstacles; the pale outlines show the robot along its way, the stroke inside where
        it is heading.""",
        draw_scenes_with_obstacles(runs),
    )
    _errors(runs, add)


def _with_velocities(runs: list[View], add: Add) -> None:
    add(
        "paths",
        "Wanted and true velocities",
        """
        The first episode of each robot. Dashed is what is wanted, which changes every few seconds; the coloured band
        around it is the tolerance, the line is what the robot does. Steps cannot be followed at once; what counts is
        that the line is back in the band soon and stays there.""",
        draw_velocities(runs),
    )
    _errors(runs, add)


def _with_waypoints(runs: list[View], add: Add) -> None:
    add(
        "paths",
        "The courses, seen from above",
        """
        Of each robot the episode that is nearest to its own median. Waypoints are visited in the order of their
        numbers, round after round; a circle is as near as counts, coloured if it was reached. The pale outlines show
        the robot along its way.""",
        draw_courses(runs),
    )
    add(
        "time",
        "Waypoints over time",
        """
        The line is the median of all episodes, the dark band holds the middle half of them and the pale band nine in
        ten. Up to the dashed line the share of the bound is judged; the triangle is that bound, the ring what the
        thesis counts in its 1,000 control steps.""",
        draw_goals_over_time(runs),
    )


def _errors(runs: list[View], add: Add) -> None:
    logarithmic = "The scale is logarithmic. " if runs[0].task.tolerance.position else ""
    add(
        "time",
        "How the error falls",
        f"""
        The line is the median of all episodes, the dark band holds the middle half of them and the pale band nine in
        ten. {logarithmic}Dashed is the tolerance, which success demands throughout the shaded window at the end.""",
        draw_errors_over_time(runs),
    )


def _words(text: str) -> str:
    return " ".join(text.split())
