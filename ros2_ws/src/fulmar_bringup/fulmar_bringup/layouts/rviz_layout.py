"""A configuration of RViz 2: YAML for `rviz2 -d`."""

from __future__ import annotations

from typing import Any

import yaml

from fulmar_bringup.layouts.viewed_robot import ViewedRobot
from fulmar_core.robots.topics import (
    DESCRIPTION,
    GOAL_PATH,
    GOAL_POINT,
    GOAL_POSE,
    MARKERS,
    OBSTACLES,
    ODOMETRY,
    TRUTH,
    Wire,
)

PLUGINS = "rviz_default_plugins"
FIXED = "<Fixed Frame>"
DEPTH = 10


def rviz_layout(viewed: ViewedRobot) -> str:
    """The configuration for one robot, as the text of its file."""
    manager = {
        "Class": "",
        "Displays": _displays(viewed),
        "Enabled": True,
        "Global Options": {
            "Background Color": "48; 48; 48",
            "Fixed Frame": viewed.frames.odom,
            "Frame Rate": 30,
        },
        "Name": "root",
        "Tools": _tools(viewed),
        "Transformation": {"Current": {"Class": f"{PLUGINS}/TF"}},
        "Value": True,
        "Views": {"Current": _view(viewed), "Saved": None},
    }
    panels = [
        {"Class": f"rviz_common/{name}", "Name": name}
        for name in ("Displays", "Selection", "Tool Properties", "Views")
    ]
    layout = {
        "Panels": panels,
        "Visualization Manager": manager,
        "Window Geometry": {"Height": 900, "Width": 1400},
    }
    return yaml.safe_dump(layout, sort_keys=False)


def _displays(viewed: ViewedRobot) -> list[dict[str, Any]]:
    arrow = {"Shape": {"Value": "Arrow", "Shaft Length": 0.3, "Head Length": 0.1}}
    odometry = {"Keep": 100, "Position Tolerance": 0.1, "Angle Tolerance": 0.2, **arrow}
    without = {"Covariance": {"Value": False}}
    return [
        _display("Grid", "Grid", {"Reference Frame": FIXED, "Plane Cell Count": 20, "Cell Size": 1}),
        _display("TF", "TF", {"Marker Scale": 0.5, "Show Names": True}),
        _display(
            "RobotModel",
            "Model",
            {
                "Description Source": "Topic",
                "Description Topic": _topic(viewed, DESCRIPTION),
                "TF Prefix": "",
                "Visual Enabled": True,
            },
        ),
        _display("MarkerArray", "Goal, limits and thrust", {"Topic": _topic(viewed, MARKERS)}),
        _display("MarkerArray", "Obstacles", {"Topic": _topic(viewed, OBSTACLES)}),
        _display("Odometry", "Odometry", {"Topic": _topic(viewed, ODOMETRY), **odometry, **without}),
        _display(
            "Odometry",
            "Ground truth",
            {"Topic": _topic(viewed, TRUTH), **odometry, **without, "Color": "25; 255; 0"},
            enabled=False,
        ),
        _display("Pose", "Goal", {"Topic": _topic(viewed, GOAL_POSE), "Color": "255; 170; 0"}),
        _display("PointStamped", "Goal point", {"Topic": _topic(viewed, GOAL_POINT), "Radius": 0.1}),
        _display("Path", "Goal path", {"Topic": _topic(viewed, GOAL_PATH), "Color": "51; 102; 230"}),
    ]


def _display(kind: str, name: str, more: dict[str, Any], *, enabled: bool = True) -> dict[str, Any]:
    return {"Class": f"{PLUGINS}/{kind}", "Name": name, "Enabled": enabled, "Value": enabled, **more}


def _tools(viewed: ViewedRobot) -> list[dict[str, Any]]:
    """Those that every configuration has, and two that publish goals."""
    usual = [{"Class": f"{PLUGINS}/{name}"} for name in ("Interact", "MoveCamera", "Select", "FocusCamera")]
    return [
        *usual,
        {"Class": f"{PLUGINS}/Measure", "Line color": "128; 128; 0"},
        {"Class": f"{PLUGINS}/SetGoal", "Topic": _topic(viewed, GOAL_POSE)},
        {"Class": f"{PLUGINS}/PublishPoint", "Single click": True, "Topic": _topic(viewed, GOAL_POINT)},
    ]


def _view(viewed: ViewedRobot) -> dict[str, Any]:
    """From above, or, in space, around the origin."""
    if viewed.in_space:
        return {
            "Class": f"{PLUGINS}/Orbit",
            "Name": "Current View",
            "Target Frame": FIXED,
            "Value": f"Orbit ({PLUGINS})",
            "Distance": 8,
            "Pitch": 0.6,
            "Yaw": 0.8,
        }
    return {
        "Class": f"{PLUGINS}/TopDownOrtho",
        "Name": "Current View",
        "Target Frame": FIXED,
        "Value": f"TopDownOrtho ({PLUGINS})",
        "Angle": 0,
        "Scale": 80,
        "X": 0,
        "Y": 0,
    }


def _topic(viewed: ViewedRobot, wire: Wire) -> dict[str, Any]:
    """A topic with a quality of service that matches every publisher of its wire.

    Goals and obstacles also come from volatile publishers, RViz itself among them, which a transient-local subscription
    never matches. What Fulmar alone latches is asked for as such, so that an RViz that starts later has it at once.
    """
    latched = wire.delivery == "latched" and wire.source != "operator"
    return {
        "Depth": 1 if latched else DEPTH,
        "Durability Policy": "Transient Local" if latched else "Volatile",
        "History Policy": "Keep Last",
        "Reliability Policy": "Best Effort" if wire.delivery == "best_effort" else "Reliable",
        "Value": viewed.topic(wire),
    }
