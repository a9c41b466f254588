"""Plot of an aircraft's envelope: trim over speed, in free air and near the ground."""

from __future__ import annotations

from pathlib import Path

from fulmar_core.robots.robot import Robot
from fulmar_evaluation.aircraft_check import envelope
from fulmar_evaluation.report.drawing import columns
from fulmar_evaluation.report.style import PAPER, house_style

PANELS = ("angle of attack [°]", "elevator [°]", "throttle")


def write_envelope_plot(robot: Robot, path: Path) -> Path:
    """Draw angle of attack, elevator and throttle of level flight over speed; returns the path."""
    assert robot.airframe is not None  # as of `Robot.flies`
    span = robot.airframe.span
    near = (0.2 * span, 0.5 * span) if robot.airframe.ground_effect is not None else ()
    curves = envelope(robot, (None, *near))
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
        figure.suptitle(f"{robot.name}: level flight up to the stall angle of {robot.airframe.stall_deg:g}°")
        figure.savefig(path)
    return path
