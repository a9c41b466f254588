"""The table of nodes: every node that a system may have, in the order of its start.

A node is a module `<name>_row.py` with a `ROW`, and one line here. Nothing heavy is imported before the rows are asked
for: the command line reads the options of the table each time it starts.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING

from fulmar_bringup.node_spec import PARTS

if TYPE_CHECKING:
    from fulmar_bringup.node_row import NodeRow

# By names of modules. With a help text people switch the node by an option of this name.
TABLE = {
    "recorder": "",
    "emulator": "",
    "plant": "",
    "estop": "",
    "event_camera": "",
    "camera": "Draw what the robot's camera sees, on `camera/image_raw` and others. See docs/cameras.md.",
    "estimator": "",
    "controller": "",
    "adapter": "",
    "goals": "",
    "actions": "Serve Nav2's actions, such as `navigate_to_pose`, to action clients. See docs/actions.md.",
    "simulation_interfaces": "Serve ROS's standard services for simulators: reset, pause, step, states. "
    "See docs/simulation_interfaces.md.",
    "broadcast": "Publish observation and action as ros2_control's broadcasters do. See docs/broadcast.md.",
    "own": "",
    "markers": "Draw goal, limits and thrust for RViz and Foxglove, on the topic `markers`. See `fulmar layout`.",
}
OPTIONS = {name: text for name, text in TABLE.items() if text}
USUALLY_ON = (
    "markers",
)  # of these, what standing systems have unless it is switched off; all else is asked for
IN_LOCKSTEP = (
    "camera",
    "simulation_interfaces",
    "broadcast",
)  # of these, what leaves the steps of lock step as they are


@cache
def node_rows() -> tuple[NodeRow, ...]:
    """Every row of the table."""
    modules = (import_module(f"fulmar_bringup.{name}_row") for name in TABLE)
    return tuple(module.ROW for module in modules)


def status_names(*, silent: bool = True) -> tuple[str, ...]:
    """Names of nodes that `fulmar status` shows, plant and controller first; also of those that report nothing."""
    rows = [row for row in node_rows() if row.shown and (row.reports or silent)]
    names = [name for row in rows for name in row.names]
    return tuple(sorted(names, key=(*PARTS, *names).index))


def row_of(name: str) -> NodeRow | None:
    """The row of a node, by its name in ROS; None for a node of a system's own."""
    return next((row for row in node_rows() if name in row.names), None)
