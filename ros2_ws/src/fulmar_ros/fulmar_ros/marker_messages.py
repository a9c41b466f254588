"""Shapes of `fulmar_core.scene` as ROS markers."""

from __future__ import annotations

from pathlib import Path

from geometry_msgs.msg import Point
from visualization_msgs.msg import Marker, MarkerArray

from fulmar_core.wires.robot_name import Frames
from fulmar_ros.scene.scene import Change
from fulmar_ros.scene.shape import Shape

TYPES = {
    "arrow": Marker.ARROW,
    "box": Marker.CUBE,
    "sphere": Marker.SPHERE,
    "cylinder": Marker.CYLINDER,
    "line": Marker.LINE_STRIP,
    "segments": Marker.LINE_LIST,
    "spheres": Marker.SPHERE_LIST,
    "mesh": Marker.MESH_RESOURCE,
}


def marker_of(shape: Shape, frames: Frames) -> Marker:
    """A shape as a marker, at the newest pose of its frame: viewers take the stamp 0 for that."""
    marker = Marker(ns=shape.group, id=shape.number, type=TYPES[shape.kind], action=Marker.ADD)
    marker.header.frame_id = frames.base if shape.in_body else frames.odom
    marker.frame_locked = shape.in_body  # it moves with the body, without a message for each pose
    place = marker.pose.position
    place.x, place.y, place.z = shape.position
    turn = marker.pose.orientation
    turn.x, turn.y, turn.z, turn.w = shape.quat
    marker.scale.x, marker.scale.y, marker.scale.z = shape.size
    marker.color.r, marker.color.g, marker.color.b, marker.color.a = shape.color
    marker.points = [Point(x=x, y=y, z=z) for x, y, z in shape.points]
    if shape.file:
        marker.mesh_resource = Path(shape.file).as_uri()
    return marker


def scene_message(change: Change, frames: Frames) -> MarkerArray:
    """Everything that there is, and a deletion of each marker that was there before.

    A viewer that missed messages, or comes late, so draws the right scene from the newest one alone.
    """
    return MarkerArray(
        markers=[*map(_deletion, change.gone), *(marker_of(shape, frames) for shape in change.shapes)]
    )


def _deletion(key: tuple[str, int]) -> Marker:
    return Marker(ns=key[0], id=key[1], action=Marker.DELETE)
