"""Report of the benchmark of FALCON-S: errors by task and scenario, flights, and ground effect over height."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from fulmar_benchmarks.falcon.campaign import Flights
from fulmar_benchmarks.falcon.cells import SCENARIOS
from fulmar_benchmarks.falcon.flight_plots import draw_flights, name_lines
from fulmar_evaluation.report.page import Plot
from fulmar_evaluation.report.style import quiet_grid

_ERRORS = """
RMSE per axis of each task, median over the flights that survive, by scenario. A cross at the top: none survives. The
stroke is the thesis' controller of the kind (Tables 5.7 and 5.8)."""
_FLIGHTS = """
The first flight of each task, in `calm` where that was flown; black: the reference. A line ends where the craft is
lost. Energy is the mean squared throttle, added up over time."""
_GROUND = """
Left: lift and induced drag near the ground over those in free air at the same angle of attack (Phillips and Hunsaker,
2013), as in thesis Fig. 5.1. Right: mean squared throttle in level flight, and that of thesis Table 5.2, whose motors
had other constants."""


def plots(document: Mapping[str, Any], flights: Flights) -> list[Plot]:
    """What is drawn of a document, and of flights by task and controller."""
    drawn = [Plot("Flights", _FLIGHTS, draw_flights(flights), "flights")] if flights else []
    return [
        Plot("Errors by task", _ERRORS, draw_errors(document), "errors"),
        *drawn,
        Plot("Ground effect", _GROUND, draw_ground(document), "ground_effect"),
    ]


def draw_errors(document: Mapping[str, Any]) -> Figure:
    """RMSE of every task, one panel for each controller."""
    by: dict[str, dict[str, Any]] = {}
    for task, controllers in document["tasks"].items():
        for controller, scenarios in controllers.items():
            by.setdefault(controller, {})[task] = scenarios
    figure = Figure(figsize=(4.4 * max(1, len(by)), 4.0), layout="constrained")
    panels = figure.subplots(1, max(1, len(by)), sharey=True, squeeze=False)[0]
    for axes, (controller, tasks) in zip(panels, by.items(), strict=False):
        for number, scenario in enumerate(SCENARIOS):
            if not any(scenario in each for each in tasks.values()):
                continue
            color, aside = f"C{number}", 0.08 * (number - 0.5 * len(SCENARIOS))
            flown = {
                place + aside: each[scenario].get("rmse_per_axis_m")
                for place, each in enumerate(tasks.values())
                if scenario in each
            }
            alive = {place: rmse for place, rmse in flown.items() if rmse is not None}
            axes.plot(list(alive), list(alive.values()), "o", markersize=4, color=color, label=scenario)
            axes.plot(
                [place for place in flown if place not in alive],
                [0.98] * (len(flown) - len(alive)),
                "x",
                color=color,
                transform=axes.get_xaxis_transform(),
            )
        published = [
            (place, one["thesis"]["rmse_per_axis_m"])
            for place, each in enumerate(tasks.values())
            for one in list(each.values())[:1]
            if one.get("thesis")
        ]
        if published:
            places, levels = np.array(published).T
            axes.hlines(levels, places - 0.4, places + 0.4, color="black", linewidth=1.2, label="thesis")
        axes.set_xticks(range(len(tasks)), list(tasks))
        axes.set_yscale("log")
        axes.set_title(controller)
        quiet_grid(axes)
    panels[0].set_ylabel("RMSE per axis [m]")
    name_lines(figure, panels, ncols=5, fontsize="small")
    return figure


def draw_ground(document: Mapping[str, Any]) -> Figure:
    """Ratios near the ground, and energy over height."""
    ground = document["ground_effect"]
    figure = Figure(figsize=(8.4, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(ground["height_over_span"], ground["lift_ratio"], label="lift")
    left.plot(ground["height_over_span"], ground["induced_drag_ratio"], label="induced drag / lift²")
    left.set_xlabel("height over span")
    left.set_ylabel("ratio to free air")
    right.plot(ground["heights_m"], ground["energy"], marker="o", label="ours")
    right.plot(ground["heights_m"], ground["thesis_energy"], marker="s", label="thesis")
    right.set_xscale("log")
    right.set_xlabel("height [m]")
    right.set_ylabel("mean squared throttle")
    for axes in (left, right):
        axes.legend()
        quiet_grid(axes)
    return figure
