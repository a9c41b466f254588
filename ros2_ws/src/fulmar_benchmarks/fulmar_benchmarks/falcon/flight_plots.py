"""One flight of each task by each controller, drawn: height and place over time, surfaces, energy."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fulmar_core.simulation.flight_figures import reference
from fulmar_evaluation.report.style import quiet_grid

COLUMNS = ("height [m]", "to the left [m]", "elevator [deg]", "aileron, rudder (dashed) [deg]", "energy [s]")


def draw_flights(flights: dict[str, dict[str, dict[str, Any]]]) -> Figure:
    """A row of panels for each task, a colour for each controller; `flights` by task and controller."""
    figure = Figure(figsize=(15.0, 2.1 * len(flights) + 0.8), layout="constrained")
    panels = figure.subplots(len(flights), len(COLUMNS), sharex=True, squeeze=False)
    colors = {
        by: f"C{i}" for i, by in enumerate(dict.fromkeys(by for each in flights.values() for by in each))
    }
    for row, (task, each) in zip(panels, flights.items(), strict=True):
        times = np.linspace(0.0, 60.0, 301)
        for axes, profile in zip(row, reversed(reference(task)), strict=False):
            axes.plot(times, profile(times), color="black", linewidth=0.8, label="reference")
        for by, flight in each.items():
            _draw_one(row, flight, by, colors[by])
        row[0].set_ylabel(task, rotation=0, labelpad=14)
    for axes, title in zip(panels[0], COLUMNS, strict=True):
        axes.set_title(title)
    for axes in panels.flat:
        quiet_grid(axes)
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    name_lines(figure, panels[:, 0], ncols=6)
    return figure


def name_lines(figure: Figure, panels: np.ndarray, **how: Any) -> None:
    """One legend under a figure with every label of some panels once; `how` as in matplotlib's `legend`."""
    handles: dict[str, Any] = {}
    for axes in panels:
        drawn, names = axes.get_legend_handles_labels()
        handles |= dict(zip(names, drawn, strict=True))
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", **how)


def _draw_one(row: np.ndarray, flight: dict[str, Any], by: str, color: str) -> None:
    times, surfaces = flight["time_s"], flight["surfaces_deg"]
    height, left, elevator, lateral, energy = row

    def draw(axes: Axes, values: np.ndarray | None, line: str = "-") -> None:
        if values is not None:
            axes.plot(times, values, line, color=color, linewidth=0.8, label=f"{by}, {flight['scenario']}")

    draw(height, flight["height_m"])
    draw(left, flight["left_m"])
    draw(elevator, surfaces.get("elevator"))
    draw(lateral, surfaces.get("aileron"))
    draw(lateral, surfaces.get("rudder"), "--")
    draw(energy, flight["energy_s"])
