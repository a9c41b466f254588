"""Plot of an aircraft's envelope: trim over speed, in free air and near the ground."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.dynamics.flight_trim import find_trim
from fulmar_core.robots.airframe.airframe import Airframe
from fulmar_core.robots.robot import Robot
from fulmar_evaluation.report.drawing import columns
from fulmar_evaluation.report.style import PAPER, house_style

PANELS = ("angle of attack [°]", "elevator [°]", "throttle")


def write_envelope_plot(robot: Robot, path: Path) -> Path:
    """Draw angle of attack, elevator and throttle of level flight over speed; returns the path."""
    frame = robot.airframe
    assert frame is not None  # of every aircraft
    near = (0.2 * frame.span, 0.5 * frame.span) if frame.ground_effect is not None else ()
    curves = _envelope(robot, frame, (None, *near))
    with house_style():
        figure, panels = columns(3, 3.6)
        figure.patch.set_facecolor(PAPER)
        for column, (panel, label) in enumerate(zip(panels[0], PANELS, strict=True), start=1):
            for height, rows in curves.items():
                where = "free air" if height is None else f"{height:.3g} m above the ground"
                panel.plot(rows[:, 0], rows[:, column], label=where)
            panel.set_title(label)
            panel.set_xlabel("speed [m/s]")
        panels[0, 0].legend()
        figure.suptitle(f"{robot.name}: level flight up to the stall angle of {frame.stall_deg:g}°")
        figure.savefig(path)
    return path


def _envelope(
    robot: Robot, frame: Airframe, heights: Sequence[float | None]
) -> dict[float | None, np.ndarray]:
    """Trims over speed at some heights, columns speed, α [deg], elevator [deg] and throttle; where there are any."""
    found = {}
    for height in heights:
        rows = []
        for speed in np.linspace(0.5, 1.8, 40) * frame.speed:
            try:
                trim = find_trim(robot, float(speed), height)
            except ConfigError:
                continue
            if abs(math.degrees(trim.alpha)) <= frame.stall_deg:
                rows.append([speed, math.degrees(trim.alpha), math.degrees(trim.elevator), trim.throttle])
        found[height] = np.array(rows).reshape(-1, 4)
    return found
