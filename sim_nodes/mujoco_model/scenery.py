"""Parts of every model: floor, light, camera, hull, and the sensors on the body."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

from fulmar_core.robots.look import COLORS
from fulmar_core.robots.mesh_file import read_mesh
from fulmar_core.robots.robot import Robot

BODY, IMU_SITE = "base_link", "imu_link"
DRAWN, HIDDEN = 2, 3  # groups of geoms that MuJoCo's viewer shows, and that it does not
FLOOR_BIT, THING_BIT = 1, 2  # what touches the floor, and what touches one another above it


def add_scenery(spec: mujoco.MjSpec, colour: list[float] | None) -> None:
    """Add a floor at z = 0, a sun and a camera above.

    Args:
        spec: Model under construction.
        colour: Of the floor, or of the water; red, green, blue, opacity. None: there is no floor.
    """
    if colour is not None:
        spec.worldbody.add_geom(
            name="floor",
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[10, 10, 0.1],
            rgba=colour,
            contype=0,
            conaffinity=FLOOR_BIT,
        )
    spec.worldbody.add_light(name="sun", pos=[0, 0, 6], dir=[0, 0, -1])
    spec.worldbody.add_camera(name="above", pos=[0, 0, 9], fovy=50)
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 1280, 960


def add_sensors(spec: mujoco.MjSpec, body: mujoco.MjsBody) -> None:
    """Add an inertial unit at the body's origin, and sensors of the truth."""
    body.add_site(name=IMU_SITE, pos=[0.0, 0.0, 0.0])
    on_body = {"objtype": mujoco.mjtObj.mjOBJ_XBODY, "objname": BODY}
    on_site = {"objtype": mujoco.mjtObj.mjOBJ_SITE, "objname": IMU_SITE}
    spec.add_sensor(name="position", type=mujoco.mjtSensor.mjSENS_FRAMEPOS, **on_body)
    spec.add_sensor(name="attitude", type=mujoco.mjtSensor.mjSENS_FRAMEQUAT, **on_body)
    spec.add_sensor(name="velocity", type=mujoco.mjtSensor.mjSENS_FRAMELINVEL, **on_body)
    spec.add_sensor(name="gyroscope", type=mujoco.mjtSensor.mjSENS_GYRO, **on_site)
    spec.add_sensor(name="accelerometer", type=mujoco.mjtSensor.mjSENS_ACCELEROMETER, **on_site)


def add_body(
    spec: mujoco.MjSpec, robot: Robot, height: float = 0.0, *, floats: bool = True
) -> mujoco.MjsBody:
    """Add the robot's body with its hull; the world of an episode brings the rest of the tensor.

    Args:
        spec: Model under construction.
        robot: The robot.
        height: Of its origin [m].
        floats: Whether it moves freely; else joints are to be added.
    """
    body = spec.worldbody.add_body(name=BODY, pos=[0.0, 0.0, height])
    if floats:
        body.add_freejoint(name="free")
    body.explicitinertial = True
    body.ipos, body.iquat = [0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]
    body.mass, body.inertia = robot.body.mass, list(robot.body.inertia[:3])
    _add_hull(body, robot)
    _add_meshes(spec, body, robot)
    return body


def _add_meshes(spec: mujoco.MjSpec, body: mujoco.MjsBody, robot: Robot) -> None:
    """Draw the meshes of a robot's look, and then its hull no more: they weigh nothing and touch nothing.

    MuJoCo takes vertices and triangles, so that what one reader of files takes is what all draw.
    """
    for number, part in enumerate(robot.look):
        if part.shape != "mesh":
            continue
        mesh, name = read_mesh(Path(part.file)), f"look_{number}"
        spec.add_mesh(
            name=name,
            uservert=(mesh.vertices * np.array(part.scale)).ravel(),
            userface=mesh.triangles.ravel(),
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,  # of a sheet and of what is open, too
        )
        x, y, z, w = part.quat_xyzw
        body.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            pos=list(part.at),
            quat=[w, x, y, z],
            rgba=list(part.rgba),
            mass=0.0,
            contype=0,
            conaffinity=0,
            group=DRAWN,
        )
        body.geoms[0].group = HIDDEN


def _add_hull(body: mujoco.MjsBody, robot: Robot) -> None:
    """Add the outline that touches obstacles and blocks; it weighs nothing and never touches the floor."""
    (low, high), outline = robot.hull_span, robot.body
    half = 0.5 * (high - low)
    shape, size = mujoco.mjtGeom.mjGEOM_CYLINDER, [outline.radius, half, 0.0]
    if outline.footprint is not None:
        length, width = outline.footprint
        shape, size = mujoco.mjtGeom.mjGEOM_BOX, [0.5 * length, 0.5 * width, half]
    body.add_geom(
        name="hull",
        type=shape,
        size=size,
        pos=[outline.footprint_x, 0.0, 0.5 * (low + high)],
        rgba=list(COLORS["own"]),
        mass=0.0,
        contype=THING_BIT,
        conaffinity=THING_BIT,
    )
