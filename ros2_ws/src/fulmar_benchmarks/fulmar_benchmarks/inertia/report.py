"""Report of the benchmark of inertia identification: figures like thesis Figs. 6.7, 6.8 and 6.9."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from fulmar_benchmarks.inertia.campaign import METHODS
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.satellite_runs import wheels_of
from fulmar_core.tasks.torque_profiles import PROFILES, gain_of, profile_of
from fulmar_evaluation.report.page import Plot
from fulmar_evaluation.report.style import quiet_grid

_PROFILES = """
Torque that each profile asks of the three wheels of the CubeSat, in shares of what its motors have; what is beyond one
is cut. The last one is our own."""
_STATIC = """
Largest relative error of the three moments after 300 s, by estimator; the further left, the better. The stroke is the
limit that is required of least squares, and the dashed one that of the filter."""
_CHANGING = """
Error of the filter over that of the batch least squares where the inertia changes; below one half is required where
the profile shows the inertia at all. Hollow dots are runs in which most of the time it cannot be observed."""


def plots(document: Mapping[str, Any]) -> list[Plot]:
    """What is drawn of a document."""
    static = [
        Plot(
            f"Static inertia, {level.replace('_', '-')} gyroscope",
            _STATIC,
            draw_static(document, level),
            f"static_{level}",
        )
        for level in document["cells"]
    ]
    return [
        Plot("Excitation", _PROFILES, draw_profiles(), "profiles"),
        *static,
        Plot("Inertia that changes", _CHANGING, draw_changing(document), "changing"),
    ]


def draw_profiles() -> Figure:
    """Torques of every profile over time."""
    wheels = wheels_of(load_robot("cubesat_wheels"))
    figure = Figure(figsize=(7.2, 5.4), layout="constrained")
    panels = figure.subplots(3, 3, sharex=True, sharey=True).ravel()
    times = np.arange(0.0, 300.0, 0.5)
    for axes, name in zip(panels, PROFILES, strict=True):
        profile = profile_of(name, wheels, gain=gain_of("cubesat_wheels", wheels), saturate=True)
        axes.plot(times, profile.torque(times) / wheels.torque, linewidth=0.8)
        axes.set_title(name)
        quiet_grid(axes)
    figure.supxlabel("time [s]")
    figure.supylabel("torque over that of the motor [-]")
    return figure


def draw_static(document: Mapping[str, Any], level: str) -> Figure:
    """Errors of every cell, one panel a satellite."""
    satellites = document["cells"][level]
    figure = Figure(figsize=(7.2, 3.4), layout="constrained")
    panels = figure.subplots(1, len(satellites), sharex=True, sharey=True, squeeze=False)[0]
    for axes, (satellite, profiles) in zip(panels, satellites.items(), strict=True):
        for mark, method in zip(("o", "s", "^"), METHODS, strict=True):
            errors = [max(cell[method]["error_max"], 1e-7) for cell in profiles.values()]
            axes.plot(errors, np.arange(len(profiles)), mark, markersize=4, label=method)
        axes.axvline(0.001 if level == "fine" else 0.01, linewidth=0.8, color="0.5")
        axes.axvline(0.02, linewidth=0.8, color="0.5", linestyle="--")
        axes.set_xscale("log")
        axes.set_title(satellite)
        axes.set_yticks(np.arange(len(profiles)), list(profiles))
        quiet_grid(axes)
    panels[0].invert_yaxis()
    panels[0].legend()
    figure.supxlabel("largest relative error of a moment [-]")
    return figure


def draw_changing(document: Mapping[str, Any]) -> Figure:
    """Ratio of the errors of filter and batch for drift and periodic inertia."""
    figure = Figure(figsize=(7.2, 3.4), layout="constrained")
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    for axes, change in zip(panels, ("drift", "periodic"), strict=True):
        for i, (satellite, profiles) in enumerate(document["dynamic"][change].items()):
            places = np.arange(len(profiles)) + 0.2 * (i - 1)
            for place, cell in zip(places, profiles.values(), strict=True):
                fill = f"C{i}" if cell["observable"] >= 0.5 else "none"
                axes.plot(
                    cell["ekf"] / cell["ls"], place, "o", markersize=4, color=f"C{i}", markerfacecolor=fill
                )
            axes.plot([], [], "o", color=f"C{i}", label=satellite)
            axes.set_yticks(np.arange(len(profiles)), list(profiles))
        axes.axvline(0.5, linewidth=0.8, color="0.5")
        axes.set_xscale("log")
        axes.set_title(change)
        quiet_grid(axes)
    panels[0].invert_yaxis()
    panels[0].legend()
    figure.supxlabel("error of the filter over that of the batch [-]")
    return figure
