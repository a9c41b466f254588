"""A robot as URDF, and the fixed frames on its body, from its YAML."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, hypot, pi, radians
from pathlib import Path
from xml.etree import ElementTree

from scipy.spatial.transform import Rotation

from fulmar_core.robots.actuators.parts import Fixture
from fulmar_core.robots.look import Part
from fulmar_core.robots.look_of import hull_of
from fulmar_core.robots.look_primitives import primitives_of
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.camera import LINK, OPTICAL, CameraConfig
from fulmar_core.states.attitude import euler_of
from fulmar_core.wires.robot_name import PLAIN, Frames

IMU = "imu_link"
PART_COLOUR = (0.9, 0.4, 0.2, 1.0)  # red, green, blue, opacity
WHEEL_COLOUR = (0.15, 0.15, 0.17, 1.0)
NOZZLE = 0.04  # length and, halved, diameter of the cylinder that shows an actuator; our value [m]


@dataclass(frozen=True)
class BodyFrame:
    """A frame fixed to the body."""

    name: str  # without the prefix of a named robot
    position: tuple[float, float, float]  # in `base_link` [m]
    rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)  # roll, pitch and yaw of its axes in `base_link` [rad]
    part: Fixture | None = None  # what sits there

    @property
    def quat_xyzw(self) -> tuple[float, float, float, float]:
        """The same turn as a quaternion."""
        x, y, z, w = Rotation.from_euler("xyz", self.rpy).as_quat().tolist()
        return x, y, z, w


def body_frames(robot: Robot) -> tuple[BodyFrame, ...]:
    """Frames of the parts of a robot.

    Returns:
        `imu_link`, those of its camera, if any, then `<name>_link` of each of `Actuators.fixtures`.
    """
    camera = robot.sensors.camera
    return (
        BodyFrame(IMU, (0.0, 0.0, 0.0)),
        *(_camera_frames(camera) if camera is not None else ()),
        *(
            BodyFrame(f"{part.name}_link", part.position, _x_axis_along(part.axis), part)
            for part in robot.actuators.fixtures
        ),
    )


def _camera_frames(camera: CameraConfig) -> tuple[BodyFrame, BodyFrame]:
    """Where it sits, with x ahead, and the same with ROS's optical axes."""
    attitudes = (LINK, camera.quat_xyzw), (OPTICAL, camera.optical_quat_xyzw)
    link, optical = (BodyFrame(name, camera.position, euler_of(quat)) for name, quat in attitudes)
    return link, optical


def urdf_of(robot: Robot, frames: Frames = PLAIN) -> str:
    """A robot's model for RViz, Foxglove and other readers of URDF.

    `base_link` has the whole mass, and the inertia tensor about the centre of mass; the other links are fixed to it, so
    that no joint states are needed to show them, and say that they have neither. PyBullet takes a link that says
    nothing for 1 kg; zero is read as zero by PyBullet, Drake (which asks for a joint that is fixed), MuJoCo (which
    merges such links), urdfdom and KDL.

    `base_link` is drawn as the robot's `look`; without one its hull is, and each actuator in its link. What touches is
    the hull.

    Args:
        robot: The robot.
        frames: Names of its frames, which its links have too.

    Returns:
        XML text.
    """
    root = ElementTree.Element("robot", name=robot.name)
    base = ElementTree.SubElement(root, "link", name=frames.base)
    _add_inertial(base, robot.body.com, robot.body.mass, robot.body.tensor)
    for each in primitives_of(robot.look or hull_of(robot)):
        _add_look(ElementTree.SubElement(base, "visual"), each)
    low, high = robot.hull_span
    collision = ElementTree.SubElement(base, "collision")
    _place(collision, (robot.body.footprint_x, 0.0, 0.5 * (low + high)))
    _add_hull(ElementTree.SubElement(collision, "geometry"), robot, high - low)
    for frame in body_frames(robot):
        name = frames.named(frame.name)
        link = ElementTree.SubElement(root, "link", name=name)
        _add_inertial(link, (0.0,) * 3, 0.0, (0.0,) * 6)
        if frame.part is not None and not robot.look:  # the look has wheels and nozzles of its own
            _add_part(ElementTree.SubElement(link, "visual"), frame.part)
        joint = ElementTree.SubElement(root, "joint", name=f"{name}_joint", type="fixed")
        _place(joint, frame.position, frame.rpy)
        ElementTree.SubElement(joint, "parent", link=frames.base)
        ElementTree.SubElement(joint, "child", link=name)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _add_inertial(
    link: ElementTree.Element, com: Sequence[float], mass: float, tensor: Sequence[float]
) -> None:
    inertial = ElementTree.SubElement(link, "inertial")
    _place(inertial, com)
    ElementTree.SubElement(inertial, "mass", value=_number(mass))
    names = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    ElementTree.SubElement(inertial, "inertia", dict(zip(names, map(_number, tensor), strict=True)))


def _add_hull(geometry: ElementTree.Element, robot: Robot, height: float) -> None:
    if robot.body.footprint is None:
        _cylinder(geometry, robot.body.radius, height)
    else:
        ElementTree.SubElement(geometry, "box", size=_numbers((*robot.body.footprint, height)))


def _add_look(visual: ElementTree.Element, part: Part) -> None:
    """Show a box, a cylinder, a sphere or a mesh of a look."""
    _place(visual, part.at, [radians(each) for each in part.rpy])
    geometry = ElementTree.SubElement(visual, "geometry")
    if part.shape == "box":
        ElementTree.SubElement(geometry, "box", size=_numbers(part.size))
    elif part.shape == "mesh":
        ElementTree.SubElement(
            geometry, "mesh", filename=Path(part.file).as_uri(), scale=_numbers(part.scale)
        )
    elif part.shape == "sphere":
        ElementTree.SubElement(geometry, "sphere", radius=_number(0.5 * part.size[0]))
    else:
        _cylinder(geometry, 0.5 * part.size[0], part.size[1])
    _colour(visual, part.color, part.rgba)


def _add_part(visual: ElementTree.Element, part: Fixture) -> None:
    """Show a caster, a wheel, or a nozzle that ends where its force acts."""
    if not part.wheel:
        _place(visual, (-0.5 * NOZZLE, 0.0, 0.0), (0.0, 0.5 * pi, 0.0))
        _cylinder(ElementTree.SubElement(visual, "geometry"), 0.25 * NOZZLE, NOZZLE)
        _colour(visual, "actuator", PART_COLOUR)
        return
    if len(part.wheel) == 1:
        _place(visual, (0.0, 0.0, 0.0))
        ball = ElementTree.SubElement(visual, "geometry")
        ElementTree.SubElement(ball, "sphere", radius=_number(*part.wheel))
    else:
        _place(visual, (0.0, 0.0, 0.0), (0.5 * pi, 0.0, 0.0))
        _cylinder(ElementTree.SubElement(visual, "geometry"), *part.wheel)
    _colour(visual, "wheel", WHEEL_COLOUR)


def _cylinder(geometry: ElementTree.Element, radius: float, length: float) -> None:
    ElementTree.SubElement(geometry, "cylinder", radius=_number(radius), length=_number(length))


def _colour(visual: ElementTree.Element, name: str, rgba: Sequence[float]) -> None:
    material = ElementTree.SubElement(visual, "material", name=name)
    ElementTree.SubElement(material, "color", rgba=_numbers(rgba))


def _place(parent: ElementTree.Element, xyz: Sequence[float], rpy: Sequence[float] = (0.0, 0.0, 0.0)) -> None:
    ElementTree.SubElement(parent, "origin", xyz=_numbers(xyz), rpy=_numbers(rpy))


def _numbers(values: Sequence[float]) -> str:
    return " ".join(map(_number, values))


def _number(value: float) -> str:
    """The shortest text that is read as the same number."""
    return repr(float(value))


def _x_axis_along(direction: Sequence[float] | None) -> tuple[float, float, float]:
    """Roll, which is 0, pitch and yaw that turn the x axis into a direction, if any [rad]."""
    if direction is None:
        return 0.0, 0.0, 0.0
    x, y, z = direction
    return 0.0, -atan2(z, hypot(x, y)), atan2(y, x)
