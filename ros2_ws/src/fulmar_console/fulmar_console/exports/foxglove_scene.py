"""Robots, goals, trails, signals, images and events as channels of Foxglove's own schemas.

Needs the extra `foxglove`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from foxglove import Channel, Context
from foxglove.channels import (
    CompressedImageChannel,
    FrameTransformsChannel,
    LogChannel,
    PoseInFrameChannel,
    SceneUpdateChannel,
)
from foxglove.messages import (
    Color,
    CompressedImage,
    CubePrimitive,
    CylinderPrimitive,
    FrameTransform,
    FrameTransforms,
    LinePrimitive,
    LinePrimitiveLineType,
    Log,
    LogLevel,
    Point3,
    Pose,
    PoseInFrame,
    Quaternion,
    SceneEntity,
    SceneUpdate,
    SpherePrimitive,
    Timestamp,
    TriangleListPrimitive,
    Vector3,
)

from fulmar_console.exports.drawn_parts import DrawnPart, parts_of, rgba_of, structures_of

MAP = "map"
NS = 1_000_000_000
TRAIL_POINTS = 600
TRAIL_S = 0.2  # between two points of a trail
SCENE_S = 1.0  # between two messages of a scene; what comes late is drawn within this time
KINDS = ("colour", "depth", "ids")
LEVELS = {
    "fault": LogLevel.Error,
    "refused": LogLevel.Error,
    "estop": LogLevel.Error,
    "intervention": LogLevel.Warning,
}
GOAL = Color(r=0.25, g=0.8, b=0.35, a=0.5)
FORMATS = {b"\x89PNG": "png"}


class FoxgloveScene:
    """Publishes robots on a context, to whatever sinks it has: a websocket, or an MCAP file."""

    def __init__(self, context: Context) -> None:
        """Make the channels that all robots share."""
        self._context = context
        self._scene = SceneUpdateChannel("/scene", context=context)
        self._frames = FrameTransformsChannel("/frames", context=context)
        self._events = LogChannel("/events", context=context)
        self._own: dict[str, Any] = {}
        self._trails: dict[str, list[tuple[float, float, float]]] = {}
        self._drawn_ns: dict[str, int] = {}
        self._trailed_ns: dict[str, int] = {}
        self._balls: dict[str, SpherePrimitive] = {}  # of goals, drawn again for viewers that come late

    def see(
        self, record: Mapping[str, Any], pose: Sequence[float], signals: Mapping[str, Any], time_ns: int
    ) -> None:
        """Publish one robot at one time: frame, pose, signals, and from time to time its body and trail.

        Args:
            record: Of the robot: name, color, info.
            pose: x, y, z [m] and the quaternion x, y, z, w.
            signals: Numbers by name, for plots; those that are not finite are null.
            time_ns: Of all of it [ns].
        """
        name = str(record["name"])
        stamp, at = _stamp(time_ns), _pose(pose)
        turned = FrameTransform(
            timestamp=stamp,
            parent_frame_id=MAP,
            child_frame_id=_base(name),
            translation=_vector(pose),
            rotation=_quaternion(pose),
        )
        self._frames.log(FrameTransforms(transforms=[turned]), log_time=time_ns)
        channel = self._channel(f"/{name}/pose", PoseInFrameChannel)
        channel.log(PoseInFrame(timestamp=stamp, frame_id=MAP, pose=at), log_time=time_ns)
        self._signals(name, signals, time_ns)
        if time_ns - self._trailed_ns.get(name, -NS) >= TRAIL_S * NS:
            self._trailed_ns[name] = time_ns
            trail = self._trails.setdefault(name, [])
            trail.append((float(pose[0]), float(pose[1]), float(pose[2])))
            del trail[:-TRAIL_POINTS]
        if time_ns - self._drawn_ns.get(name, -10 * NS) >= SCENE_S * NS:
            self._drawn_ns[name] = time_ns
            self._scene.log(SceneUpdate(entities=self._entities(record, stamp)), log_time=time_ns)

    def goal(self, name: str, target: Sequence[float], tolerance_m: float, time_ns: int) -> None:
        """Publish the target that counts: its pose, and a ball as wide as the tolerance."""
        stamp, at = _stamp(time_ns), _pose(target)
        message = PoseInFrame(timestamp=stamp, frame_id=MAP, pose=at)
        self._channel(f"/{name}/goal", PoseInFrameChannel).log(message, log_time=time_ns)
        width = 2.0 * tolerance_m
        ball = SpherePrimitive(pose=at, size=Vector3(x=width, y=width, z=width), color=GOAL)
        self._balls[name] = ball
        self._scene.log(SceneUpdate(entities=self._goal_of(name, stamp)), log_time=time_ns)

    def _goal_of(self, name: str, stamp: Timestamp) -> list[SceneEntity]:
        balls = [self._balls[name]] if name in self._balls else []
        return [SceneEntity(timestamp=stamp, frame_id=MAP, id=f"{name} goal", spheres=balls)]

    def event(self, robot: str, kind: str, words: str, time_ns: int) -> None:
        """Publish what happened, as a line of a log."""
        level = LEVELS.get(kind, LogLevel.Info)
        text = f"{kind}: {words}" if words else kind
        self._events.log(
            Log(timestamp=_stamp(time_ns), level=level, message=text, name=robot), log_time=time_ns
        )

    def image(self, name: str, kind: int, data: bytes, time_ns: int) -> None:
        """Publish an encoded image of a robot's camera."""
        form = FORMATS.get(data[:4], "jpeg")
        frame = f"{name}/camera"
        message = CompressedImage(timestamp=_stamp(time_ns), frame_id=frame, data=data, format=form)
        topic = f"/{name}/camera/{KINDS[kind]}"
        self._channel(topic, CompressedImageChannel).log(message, log_time=time_ns)

    def _signals(self, name: str, signals: Mapping[str, Any], time_ns: int) -> None:
        topic = f"/{name}/signals"
        if topic not in self._own:
            properties = {key: {"type": ["number", "null"]} for key in signals}
            schema = {"type": "object", "title": "fulmar.Signals", "properties": properties}
            self._own[topic] = Channel(topic, schema=schema, context=self._context)
        known = {key: value if math.isfinite(value) else None for key, value in signals.items()}
        self._own[topic].log(known, log_time=time_ns)

    def _channel(self, topic: str, kind: Any) -> Any:
        if topic not in self._own:
            self._own[topic] = kind(topic, context=self._context)
        return self._own[topic]

    def _entities(self, record: Mapping[str, Any], stamp: Timestamp) -> list[SceneEntity]:
        name, color = str(record["name"]), Color(**dict(zip("rgba", rgba_of(record["color"]), strict=True)))
        points = [Point3(x=x, y=y, z=z) for x, y, z in self._trails.get(name, ())]
        line = LinePrimitive(
            type=LinePrimitiveLineType.LineStrip,
            thickness=2.0,
            scale_invariant=True,
            points=points,
            color=color,
        )
        trail = SceneEntity(timestamp=stamp, frame_id=MAP, id=f"{name} trail", lines=[line])
        body = _entity(f"{name} body", _base(name), parts_of(record), stamp, locked=True)
        things = structures_of(record)
        return [
            body,
            trail,
            *self._goal_of(name, stamp),
            *([_entity("things", MAP, things, stamp)] if things else []),
        ]


def _entity(
    name: str, frame: str, parts: Sequence[DrawnPart], stamp: Timestamp, *, locked: bool = False
) -> SceneEntity:
    """Primitives and meshes as one entity."""
    cubes, spheres, cylinders, meshes = list[Any](), list[Any](), list[Any](), list[Any]()
    for part in parts:
        pose, color = _pose((*part.at, *part.quat_xyzw)), Color(**dict(zip("rgba", part.rgba, strict=True)))
        size = Vector3(x=part.size[0], y=part.size[1], z=part.size[2])
        if part.mesh is not None:
            points, corners = part.mesh
            meshes.append(
                TriangleListPrimitive(
                    pose=pose,
                    points=[Point3(x=x, y=y, z=z) for x, y, z in points.tolist()],
                    color=color,
                    indices=corners.ravel().tolist(),
                )
            )
        elif part.shape == "box":
            cubes.append(CubePrimitive(pose=pose, size=size, color=color))
        elif part.shape == "sphere":
            spheres.append(SpherePrimitive(pose=pose, size=size, color=color))
        else:
            top = 0.0 if part.shape == "cone" else 1.0
            cylinders.append(
                CylinderPrimitive(pose=pose, size=size, bottom_scale=1.0, top_scale=top, color=color)
            )
    return SceneEntity(
        timestamp=stamp,
        frame_id=frame,
        id=name,
        frame_locked=locked,
        cubes=cubes,
        spheres=spheres,
        cylinders=cylinders,
        triangles=meshes,
    )


def _base(name: str) -> str:
    return f"{name}/base_link"


def _stamp(time_ns: int) -> Timestamp:
    return Timestamp(time_ns // NS, time_ns % NS)


def _vector(pose: Sequence[float]) -> Vector3:
    return Vector3(x=float(pose[0]), y=float(pose[1]), z=float(pose[2]))


def _pose(pose: Sequence[float]) -> Pose:
    return Pose(position=_vector(pose), orientation=_quaternion(pose))


def _quaternion(pose: Sequence[float]) -> Quaternion:
    qx, qy, qz, qw = (float(each) for each in pose[3:7])
    return Quaternion(x=qx, y=qy, z=qz, w=qw)
