"""A layout for Foxglove: JSON that its menu "Import from file" takes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from fulmar_bringup.layouts.viewed_robot import ViewedRobot
from fulmar_core.robots.topics import (
    ACTUATORS_STATE,
    BLOCK,
    DESCRIPTION,
    DIAGNOSTICS,
    ESTOP_RESET,
    ESTOP_TRIGGER,
    GOAL_PATH,
    GOAL_POINT,
    GOAL_POSE,
    MARKERS,
    OBSERVATION,
    OBSTACLES,
    ODOMETRY,
    STATUS,
    TRUTH,
)

SCENE, SPEED, DISTANCE, COMMAND, APPLIED = (
    "3D!scene", "Plot!speed", "Plot!distance", "Plot!command", "Plot!applied",
)  # fmt: skip
STATES, OBSERVED, HEALTH, CONTROLLER = (
    "StateTransitions!mode", "RawMessages!observation", "DiagnosticSummary!health",
    "DiagnosticStatusPanel!controller",
)  # fmt: skip
STOP, RESET, GOAL = "CallService!stop", "CallService!reset", "Publish!goal"
RED, GREEN = "#d32f2f", "#2e7d32"


def foxglove_layout(viewed: ViewedRobot) -> str:
    """The layout of one robot, as the text of its file."""
    layout = {
        "configById": _panels(viewed),
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": _placed(),
    }
    return json.dumps(layout, indent=2) + "\n"


def _placed() -> dict[str, Any]:
    """Where each panel is."""
    buttons = _split("row", STOP, _split("row", RESET, GOAL), 34)
    health = _split("row", HEALTH, CONTROLLER)
    left = _split("column", _split("column", SCENE, buttons, 84), health, 70)
    plots = _split("column", _split("column", SPEED, DISTANCE), _split("column", COMMAND, APPLIED))
    return _split("row", left, _split("column", plots, _split("row", STATES, OBSERVED), 78))


def _split(direction: str, first: Any, second: Any, percentage: int = 50) -> dict[str, Any]:
    """Two parts beside one another (row) or below one another (column)."""
    return {"direction": direction, "first": first, "second": second, "splitPercentage": percentage}


def _panels(viewed: ViewedRobot) -> dict[str, Any]:
    topic, applied = viewed.topic, viewed.topic(ACTUATORS_STATE)
    status = f"{topic(STATUS)}.status[0]"
    names = viewed.robot.actuators.names
    return {
        SCENE: _scene(viewed),
        SPEED: _plot("velocity and turn rate of the body [m/s, rad/s]", _speeds(viewed)),
        DISTANCE: _plot("distance from the goal [m]", {"distance": _value(status, "goal_distance_m")}),
        COMMAND: _plot("command", viewed.commands()),
        APPLIED: _plot("applied", {name: f"{applied}.effort[{i}]" for i, name in enumerate(names)}),
        STATES: {
            "isSynced": True,
            "paths": [
                _path("mode", _value(status, "mode"), "receiveTime"),
                _path("reason", _value(status, "reason"), "receiveTime"),
            ],
        },
        OBSERVED: {"topicPath": topic(OBSERVATION), "diffEnabled": False},
        HEALTH: {
            "minLevel": 0, "pinnedIds": [], "hardwareIdFilter": "", "topicToRender": topic(DIAGNOSTICS),
        },
        CONTROLLER: {"topicToRender": topic(STATUS), "collapsedSections": []},
        STOP: _service(viewed.service(ESTOP_TRIGGER), "Emergency stop", RED),
        RESET: _service(viewed.service(ESTOP_RESET), "Reset", GREEN),
        GOAL: {
            "topicName": topic(GOAL_POSE),
            "datatype": GOAL_POSE.type,
            "buttonText": "Publish the goal",
            "advancedView": True,
            "value": json.dumps(_pose(viewed), indent=2),
        },
    }  # fmt: skip


def _scene(viewed: ViewedRobot) -> dict[str, Any]:
    """Robot, goal, markers and obstacles in `odom`; a click publishes a goal."""
    topic, frames = viewed.topic, viewed.frames
    shown = (ODOMETRY, MARKERS, GOAL_POSE, GOAL_POINT, GOAL_PATH, OBSTACLES, BLOCK)
    return {
        "followTf": frames.odom,
        "followMode": "follow-none",
        "cameraState": {
            "perspective": viewed.in_space,
            "distance": 12,
            "phi": 60 if viewed.in_space else 0,
            "thetaOffset": 45 if viewed.in_space else 90,
            "targetOffset": [0, 0, 0],
        },
        "scene": {"transforms": {"showLabel": True, "axisScale": 0.3}},
        "transforms": {f"frame:{frame}": {"visible": True} for frame in (frames.odom, frames.base)},
        "topics": {topic(wire): {"visible": True} for wire in shown} | {topic(TRUTH): {"visible": False}},
        "layers": {
            "grid": {
                "layerId": "foxglove.Grid",
                "instanceId": "grid",
                "label": "Grid",
                "visible": True,
                "frameId": frames.odom,
                "size": 20,
                "divisions": 20,
                "order": 1,
            },
            "robot": {
                "layerId": "foxglove.Urdf",
                "instanceId": "robot",
                "label": viewed.name,
                "visible": True,
                "sourceType": "topic",
                "topic": topic(DESCRIPTION),
                "framePrefix": "",
                "displayMode": "auto",
                "order": 2,
            },
        },
        "publish": {"type": "pose", "poseTopic": topic(GOAL_POSE), "pointTopic": topic(GOAL_POINT)},
    }


def _speeds(viewed: ViewedRobot) -> dict[str, str]:
    twist = f"{viewed.topic(ODOMETRY)}.twist.twist"
    linear, angular = ("xyz", "xyz") if viewed.in_space else ("xy", "z")
    lines = {f"velocity {axis}": f"{twist}.linear.{axis}" for axis in linear}
    return lines | {f"turn rate {axis}": f"{twist}.angular.{axis}" for axis in angular}


def _value(status: str, key: str) -> str:
    """Path to a value of a status by its key."""
    return f'{status}.values[:]{{key=="{key}"}}.value'


def _plot(title: str, lines: Mapping[str, str]) -> dict[str, Any]:
    """A plot over time of paths by their labels."""
    return {
        "title": title,
        "paths": [_path(label, value, "headerStamp") for label, value in lines.items()],
        "showXAxisLabels": True,
        "showYAxisLabels": True,
        "showLegend": True,
        "legendDisplay": "floating",
        "isSynced": True,
        "xAxisVal": "timestamp",
    }


def _path(label: str, value: str, stamp: str) -> dict[str, Any]:
    return {"value": value, "enabled": True, "timestampMethod": stamp, "label": label}


def _service(name: str, text: str, color: str) -> dict[str, Any]:
    """A button that calls a service of std_srvs/Trigger."""
    return {"serviceName": name, "requestPayload": "{}", "buttonText": text, "buttonColor": color}


def _pose(viewed: ViewedRobot) -> dict[str, Any]:
    """The origin, to be edited."""
    return {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": viewed.frames.odom},
        "pose": {
            "position": {"x": 0.0, "y": 0.0, "z": 0.0},
            "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
        },
    }
