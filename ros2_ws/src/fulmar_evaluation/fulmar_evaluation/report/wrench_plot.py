"""Figure of the forces and torques that a robot's actuators can make, in projections."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from fulmar_core.robots.robot import Robot
from fulmar_evaluation.report.drawing import columns
from fulmar_evaluation.report.style import (
    CONTROLLER_COLOURS,
    DASHED,
    FAINT,
    INK,
    OTHER_COLOURS,
    PAPER,
    house_style,
)
from fulmar_evaluation.wrench_limits import AXES, WrenchSet, wrench_set_of

FILL = CONTROLLER_COLOURS["policy"]
UNSHARED = OTHER_COLOURS[0]
NOTHING = 1e-9  # rounding, in either unit
SMALL = 0.1  # torques that stay below are written in mN·m [N·m]


def write_wrench_plot(robot: Robot, file: Path) -> Path:
    """Draw the polytopes of force and torque.

    In each panel two axes change. Filled is what can be made while all others stay zero, dashed what can be made with
    any others, and dotted what could be made purely without the common pressure line.

    Args:
        robot: Whose actuators they are.
        file: Image to write.
    """
    wrenches = wrench_set_of(robot)
    pairs = [(0, 1), (0, 2), (1, 2)]
    if len(wrenches.axes) == 6:
        pairs += [(3, 4), (3, 5), (4, 5)]
    rows = len(pairs) // 3
    with house_style():
        figure, panels = columns(3, 3.4 * rows + 0.9, rows)
        figure.patch.set_facecolor(PAPER)
        for axes, (first, second) in zip(panels.ravel(), pairs, strict=True):
            _panel(axes, wrenches, first, second)
        kind = robot.actuators.kind.replace("_", " ")
        figure.suptitle(f"{robot.name} ({kind}): forces and torques about its origin")
        handles = [
            Patch(facecolor=FILL, alpha=0.35, edgecolor=FILL, label="the other axes zero"),
            Line2D([], [], color=INK, linewidth=1.0, linestyle=DASHED, label="the others of any value"),
        ]
        if wrenches.shared:
            handles.append(
                Line2D(
                    [], [], color=UNSHARED, linestyle=":", linewidth=1.4,
                    label="the others zero, without the shared pressure line",
                )
            )  # fmt: skip
        figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
        figure.savefig(file, dpi=110)
    return file


def _panel(axes: Axes, wrenches: WrenchSet, first: int, second: int) -> None:
    """Two axes of the wrench, the other ones zero or free."""
    units = [_unit(wrenches, i) for i in (first, second)]
    factors = np.array([factor for factor, _ in units])
    drawn = []
    if wrenches.shared:
        alone = wrenches.without_shared_line().outline(first, second, pure=True) * factors
        drawn.append((alone, {"color": UNSHARED, "linestyle": ":", "linewidth": 1.4}))
    pure = wrenches.outline(first, second, pure=True) * factors
    axes.fill(*pure.T, facecolor=FILL, alpha=0.35, edgecolor="none")
    drawn.append((pure, {"color": FILL, "linewidth": 2.2}))
    free = wrenches.outline(first, second, pure=False) * factors
    drawn.append(
        (free, {"color": INK, "linewidth": 1.0, "linestyle": DASHED})
    )  # on top: both are often the same
    for corners, style in drawn:
        axes.plot(*np.vstack((corners, corners[:1])).T, **style)
    axes.axhline(0.0, color=FAINT, linewidth=0.6)
    axes.axvline(0.0, color=FAINT, linewidth=0.6)
    axes.plot(0.0, 0.0, marker="+", color=INK, markersize=7)
    reach = np.abs(np.vstack([corners for corners, _ in drawn])).max(axis=0)
    if units[0][1] == units[1][1] and reach.max() > NOTHING:
        axes.set_aspect("equal", adjustable="datalim")
    else:  # an axis without any force or torque would show its rounding
        for most, limit in zip(reach, (axes.set_xlim, axes.set_ylim), strict=True):
            if most < NOTHING:
                limit(-1.0, 1.0)
    axes.set_xlabel(_label(wrenches, first, units[0][1]))
    axes.set_ylabel(_label(wrenches, second, units[1][1]), labelpad=1.0)
    axes.grid(True)


def _unit(wrenches: WrenchSet, axis: int) -> tuple[float, str]:
    """Factor and unit in which an axis is drawn."""
    kind = wrenches.axes[axis].partition("_")[0]
    sizes = [
        np.abs(wrenches.columns[i]).sum() for i, name in enumerate(wrenches.axes) if name.startswith(kind)
    ]
    small = NOTHING < max(sizes) < SMALL
    if kind == "torque":
        return (1e3, "mN·m") if small else (1.0, "N·m")
    return (1e3, "mN") if small else (1.0, "N")


def _label(wrenches: WrenchSet, axis: int, unit: str) -> str:
    name = wrenches.axes[axis]
    assert name in AXES
    kind, _, letter = name.partition("_")
    return f"{kind} {'along' if kind == 'force' else 'about'} {letter} [{unit}]"
