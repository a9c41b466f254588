"""Report of the benchmark of event-based rates: figures like thesis Figs. 6.11, 6.13 and 6.14."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from fulmar_benchmarks.events.campaign import NAMES
from fulmar_core.dynamics.sky.event_sensor import EventSensor
from fulmar_core.estimators.event_rate.contrast import fit_rate
from fulmar_core.estimators.event_rate.star_tracks import find_tracks
from fulmar_core.robots.sensors.catalogue import load_stars
from fulmar_core.robots.sensors.event_camera import EventSensorSpec
from fulmar_core.robots.sensors.star_camera import StarCamera
from fulmar_evaluation.report.page import Plot
from fulmar_evaluation.report.style import quiet_grid

_CARRIED = """
Left, the events of a window of 0.2 s, brighter and darker ones, among the noise; right, the same events of stars,
carried to the middle of the window along the motion field of the rate that was found: each star is a point again."""
_ERRORS = """
Each dot is the error of one random window about one axis of the first camera: p and q across its boresight, r about
it. With one camera r is known far worse; a second one, turned by 90°, sees it as well as the others."""
_FIELDS = """
How much worse the rate about the boresight is known than that across it. The line is √3 / (√2 tan(FOV / 2)), which
stars that are spread evenly over a square would give."""


def plots(document: Mapping[str, Any]) -> list[Plot]:
    """What is drawn of a document."""
    parts = []
    if "single" in document:
        parts.append(Plot("Contrast", _CARRIED, draw_carried(), "carried"))
        parts.append(Plot("Errors", _ERRORS, draw_errors(document), "errors"))
    if "fov_ratio" in document:
        parts.append(Plot("Field of view", _FIELDS, draw_fields(document), "fields"))
    return parts


def draw_carried() -> Figure:
    """Events of a window before and after they are carried along the motion field."""
    camera, rate = StarCamera(width=512, height=512, fov_deg=8.5), np.radians([0.9, -0.6, 0.5])
    sensor = EventSensor(camera, EventSensorSpec(), load_stars())
    quat = np.array([0.5, -0.5, 0.5, 0.5])
    sensor.expose(quat, rate, 0, 200_000_000)
    events = sensor.expose(quat, rate, 0, 200_000_000)
    tracks = find_tracks(events, 0, 200_000_000)
    fit = fit_rate([tracks], [camera])
    figure = Figure(figsize=(7.2, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    for value, colour in ((0, "#d6336c"), (1, "#1c7ed6")):
        some = events.p == value
        left.plot(events.x[some], events.y[some], ",", color=colour, alpha=0.6, rasterized=True)
    if fit is not None:
        velocity = camera.motion_field(tracks.places) @ (camera.to_body.T @ fit.rate)
        carried = tracks.places - velocity * tracks.times_s[:, None]
        for value, colour in ((0, "#d6336c"), (1, "#1c7ed6")):
            some = tracks.group % 2 == value
            right.plot(*carried[some].T, ",", color=colour, alpha=0.6, rasterized=True)
    for axes, title in ((left, "as they came"), (right, "carried")):
        axes.set_title(title)
        axes.set_aspect("equal")
        axes.set_xlim(0, camera.width)
        axes.set_ylim(camera.height, 0)
        axes.set_xlabel("column [px]")
    left.set_ylabel("row [px]")
    return figure


def draw_errors(document: Mapping[str, Any]) -> Figure:
    """Errors of every window, of one camera and of two."""
    figure = Figure(figsize=(7.2, 3.2), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, name in zip(panels, ("single", "dual"), strict=True):
        errors = np.array(document["errors"][name])
        for i, label in enumerate("pqr"):
            axes.plot(np.arange(len(errors)), errors[:, i], ".", markersize=3, label=label)
        axes.set_title(NAMES[name])
        axes.set_xlabel("window")
        axes.set_yscale("symlog", linthresh=1e-3)
        quiet_grid(axes)
    panels[0].set_ylabel("error [°/s]")
    panels[1].legend(loc="lower right", ncols=3)
    return figure


def draw_fields(document: Mapping[str, Any]) -> Figure:
    """Ratio of the errors over the field of view."""
    figure = Figure(figsize=(5.0, 3.2), layout="constrained")
    axes = figure.subplots()
    fields = np.linspace(7.0, 42.0, 100)
    axes.plot(fields, math.sqrt(1.5) / np.tan(np.radians(0.5 * fields)), label="√3 / (√2 tan(FOV/2))")
    axes.plot(
        [row["fov_deg"] for row in document["fov_ratio"]],
        [row["ratio"] for row in document["fov_ratio"]],
        "o",
        label="measured",
    )
    axes.set_xlabel("field of view [°]")
    axes.set_ylabel("boresight / cross-axis [-]")
    axes.legend()
    quiet_grid(axes)
    return figure
