"""What is drawn of robots of each kind."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import SubFigure

from fulmar_core.robots.robot import Robot
from fulmar_evaluation.report import run_figures as figures
from fulmar_evaluation.report import satellite_figures as satellites
from fulmar_evaluation.report.control_plot import actuators_height, draw_actuators
from fulmar_evaluation.report.envelope_plot import write_envelope_plot
from fulmar_evaluation.report.flight_plot import (
    FLIGHT_MOTION_ROWS,
    FLIGHT_ROWS,
    PATH_ROWS,
    draw_flight,
    draw_flight_motion,
    draw_flight_path,
    draw_surfaces,
    flight_rows,
    flight_table,
)
from fulmar_evaluation.report.motion_plot import MOTION_ROWS, draw_motion
from fulmar_evaluation.report.page import Plot
from fulmar_evaluation.report.run_view import Row, View, belief_rows, evaluated, use_row
from fulmar_evaluation.report.satellite_plot import torque_rows
from fulmar_evaluation.report.space_plot import draw_space
from fulmar_evaluation.report.style import legend
from fulmar_evaluation.report.trajectory_plot import draw_trajectory
from fulmar_evaluation.report.wrench_plot import write_wrench_plot

Figures = tuple[Callable[[Sequence[View]], Plot | None], ...]
Draw = Callable[[SubFigure, Sequence[View]], object]
DrawRows = Callable[[Sequence[Axes], Sequence[View]], None]


def _draw_trajectory(figure: SubFigure, runs: Sequence[View]) -> None:
    path = figure.subplots()
    draw_trajectory(path, runs)
    legend(path, loc="best")


def _draw_space(figure: SubFigure, runs: Sequence[View]) -> None:
    draw_space(figure, runs, stacked=True)


def _draw_flight(figure: SubFigure, runs: Sequence[View]) -> None:
    """Path, height and energy of flights, below one another."""
    count = flight_rows(runs)
    path, flight = figure.subfigures(2, 1, height_ratios=(PATH_ROWS, count))
    rows = path.subplots(PATH_ROWS, 1)
    draw_flight_path(rows, runs)
    legend(rows[0], loc="best", ncols=1 + len(runs))
    draw_flight(flight.subplots(count, 1), runs)


def _draw_actuators(figure: SubFigure, runs: Sequence[View]) -> None:
    for one, run in zip(figure.subplots(len(runs), 1, sharex=True, squeeze=False)[:, 0], runs, strict=True):
        draw_actuators(one, run)
        one.set_xlabel("time [s]")
        one.label_outer()


def _draw_surfaces(figure: SubFigure, runs: Sequence[View]) -> None:
    for pair, run in zip(figure.subplots(2, len(runs), squeeze=False).T, runs, strict=True):
        draw_surfaces(pair, run)


@dataclass(frozen=True)
class Plots:
    """Of one kind.

    Attributes:
        of_check: Writes what a check shows into an image, and returns its path.
        path: Sections of a report about the motion; None from one that has nothing to show.
        use: Same about the actuators.
        rows: What its table of figures has beside what every robot has.
        draw_path: Draws the path on the sheet that has everything.
        draw_use: Draws there what the actuators did.
        use_height: Room for that [inch].
        path_rows: Rows over time that `draw_path` needs at least.
        motion_rows: Rows of the sheet that show how it moved.
        draw_motion: Draws them.
    """

    of_check: Callable[[Robot, Path], Path] = write_wrench_plot
    path: Figures = (figures.space_path, figures.progress, figures.motion)
    use: Figures = (figures.actuators, figures.use)
    rows: Callable[[Sequence[View]], list[Row]] = lambda runs: [use_row(runs), *belief_rows(runs)]
    draw_path: Draw = _draw_space
    draw_use: Draw = _draw_actuators
    use_height: Callable[[Sequence[View]], float] = lambda runs: len(runs) * actuators_height(runs, 1.5) + 0.2
    path_rows: int = 0
    motion_rows: int = MOTION_ROWS
    draw_motion: DrawRows = draw_motion


_IN_PLANE = Plots(path=(figures.trajectory, figures.progress), draw_path=_draw_trajectory, motion_rows=0)
PLOTS = defaultdict(
    Plots,
    planar=_IN_PLANE,
    rolling=replace(_IN_PLANE, rows=lambda runs: []),  # nothing believes anything of wheels
    satellite=Plots(  # it stays where it is
        path=(figures.progress, satellites.attitude, satellites.wheels, satellites.inertia),
        use=(satellites.torques,),
        rows=satellites.table,
        draw_path=satellites.sheet_path,
        draw_use=satellites.sheet_torques,
        use_height=lambda runs: 1.6 * torque_rows(runs) + 0.2,
        path_rows=5,
        motion_rows=0,
    ),
    aircraft=Plots(
        of_check=write_envelope_plot,
        path=(figures.flight_path, figures.progress, figures.flight, figures.flight_motion),
        use=(figures.surfaces,),
        rows=flight_table,
        draw_path=_draw_flight,
        draw_use=_draw_surfaces,
        use_height=lambda _runs: 3.6,
        path_rows=PATH_ROWS + FLIGHT_ROWS,
        motion_rows=FLIGHT_MOTION_ROWS,
        draw_motion=draw_flight_motion,
    ),
)


def plots_of(runs: Sequence[View]) -> Plots:
    """Those of the robots of runs, which do one task; where no run has a result, those in the plane."""
    return next((PLOTS[result.robot.kind.name] for _, result in evaluated(runs)), _IN_PLANE)
