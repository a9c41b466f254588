"""Read a URDF into a `Description`: all joints at zero, masses of all links lumped."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from fulmar_core.config.errors import ConfigError, did_you_mean
from fulmar_evaluation.new_robot.description import Description, Gap, Joint, Lump, Place, Solid, Spin
from fulmar_evaluation.new_robot.mesh_places import Meshes
from fulmar_evaluation.new_robot.xml_file import read_xml

SPINS: dict[str, Spin] = {"continuous": "turns", "revolute": "swings", "prismatic": "slides"}
FIXED = ("fixed", "floating", "planar")  # floating and planar: the robot itself moves in its world
MOST_LINKS = 2000


@dataclass
class _Reader:
    """One file under way."""

    path: Path
    root: Element
    meshes: Meshes
    places: dict[str, Place] = field(default_factory=dict)
    joints: list[Joint] = field(default_factory=list)
    gaps: list[Gap] = field(default_factory=list)
    unplaced: set[str] = field(default_factory=set)  # links whose place could not be read

    def fail(self, message: str) -> ConfigError:
        return ConfigError(f"{self.path}: {message}")

    def numbers(self, text: str | None, count: int, default: Sequence[float], where: str) -> np.ndarray:
        """Numbers of an attribute; its default where there is none."""
        if text is None:
            return np.array(default, dtype=float)
        try:
            found = np.array([float(word) for word in text.split()])
        except ValueError:
            found = np.array([])
        if found.shape != (count,) or not np.isfinite(found).all():
            raise self.fail(f"{where} is '{text}'; {count} finite numbers are wanted.")
        return found

    def origin(self, parent: Element, where: str) -> Place:
        """The `origin` of an element."""
        element = parent.find("origin")
        if element is None:
            return Place.origin()
        xyz = self.numbers(element.get("xyz"), 3, (0.0,) * 3, f"'xyz' of {where}")
        rpy = self.numbers(element.get("rpy"), 3, (0.0,) * 3, f"'rpy' of {where}")
        return Place(xyz, Rotation.from_euler("xyz", rpy).as_matrix())


def read_urdf(path: Path, root_link: str = "") -> Description:
    """Read a URDF.

    Args:
        path: The file; a xacro has to be expanded first.
        root_link: Whose frame becomes the robot's; empty: `base_link` where there is one, else the root.

    Raises:
        ConfigError: It cannot be read, is no URDF, or its links are no tree; one line.
    """
    root = read_xml(path, "robot", "URDF")
    reader = _Reader(path, root, Meshes(path))
    links = {link.get("name", ""): link for link in root.findall("link")}
    if not links or len(links) != len(root.findall("link")) or len(links) > MOST_LINKS:
        raise reader.fail("has no links, links with one name, or too many.")
    _place_links(reader, links, root_link)
    lumps = [lump for name, link in links.items() if (lump := _lump(reader, name, link)) is not None]
    colours = _colours(reader)
    return Description(
        source=path,
        name=root.get("name", path.stem),
        lump=Lump.of(lumps),
        frames={name: place for name, place in reader.places.items() if name not in reader.unplaced},
        joints=tuple(reader.joints),
        contacts=tuple(_solids(reader, links, "collision", colours)),
        visuals=tuple(_solids(reader, links, "visual", colours)),
        gaps=(*reader.gaps, *reader.meshes.gaps),
    )


def _place_links(reader: _Reader, links: dict[str, Element], root_link: str) -> None:
    """Find the frame of each link in that of the body, and the joints that move."""
    joints = {_end(reader, joint, "child", links): joint for joint in reader.root.findall("joint")}
    parents = {child: _end(reader, joint, "parent", links) for child, joint in joints.items()}
    tops = [name for name in links if name not in parents]
    if len(tops) != 1 or len(joints) != len(reader.root.findall("joint")):
        found = f"{len(tops)} links without a parent" if len(tops) != 1 else "a link with two parents"
        raise reader.fail(f"its links are no tree: {found}.")
    if root_link and root_link not in links:
        raise reader.fail(f"has no link '{root_link}'.{did_you_mean(root_link, links)}")
    body = root_link or ("base_link" if "base_link" in links else tops[0])
    local = {name: _local(reader, name, joints.get(name), links[name]) for name in links}
    in_top: dict[str, Place] = {tops[0]: Place.origin()}
    for name in links:
        for each in reversed(_chain(reader, name, parents, in_top)):
            in_top[each] = in_top[parents[each]].then(local[each])
    at = in_top[body]
    back = Place(-at.rotation.T @ at.position, at.rotation.T)
    reader.places = {name: back.then(in_top[name]) for name in links}
    reader.joints = [
        joint for name, element in joints.items() if (joint := _joint(reader, name, element)) is not None
    ]


def _end(reader: _Reader, joint: Element, which: str, links: dict[str, Element]) -> str:
    """Name of the link at one end of a joint."""
    element = joint.find(which)
    name = element.get("link", "") if element is not None else ""
    if name not in links:
        raise reader.fail(
            f"joint '{joint.get('name', '')}' has the {which} '{name}', which is no link."
            f"{did_you_mean(name, links)}"
        )
    return name


def _chain(reader: _Reader, name: str, parents: dict[str, str], placed: dict[str, Place]) -> list[str]:
    """A link and those above it that have no place yet."""
    chain: list[str] = []
    while name not in placed:
        if name in chain:
            raise reader.fail(f"its links are no tree: '{name}' hangs from itself.")
        chain.append(name)
        name = parents[name]
    return chain


def _local(reader: _Reader, name: str, joint: Element | None, link: Element) -> Place:
    """A link's frame in its parent's; of one without mass and shape, numbers that are none are a gap."""
    if joint is None:
        return Place.origin()
    try:
        return reader.origin(joint, f"joint '{joint.get('name', '')}'")
    except ConfigError as error:
        if any(link.find(part) is not None for part in ("inertial", "visual", "collision")):
            raise
        reader.unplaced.add(name)
        said = str(error).removeprefix(f"{reader.path}: ")
        reader.gaps.append(Gap("", f"the place of '{name}' was not read: {said}"))
        return Place.origin()


def _joint(reader: _Reader, link: str, element: Element) -> Joint | None:
    """A joint that moves; None for others."""
    name, kind = element.get("name", ""), element.get("type", "")
    if kind not in SPINS:
        if kind not in FIXED:
            raise reader.fail(f"joint '{name}' has the type '{kind}'.{did_you_mean(kind, (*SPINS, *FIXED))}")
        return None
    where = element.find("axis")
    axis = reader.numbers(
        where.get("xyz") if where is not None else None, 3, (1.0, 0.0, 0.0), f"'axis' of joint '{name}'"
    )
    if not axis.any():
        raise reader.fail(f"'axis' of joint '{name}' is zero.")
    limit = element.find("limit")
    given = {key: _limit(limit, key) for key in ("lower", "upper", "effort", "velocity")}
    ends = [abs(end) for key in ("lower", "upper") if (end := given[key]) is not None]
    place = reader.places[link]
    return Joint(
        name=name,
        link=link,
        kind=SPINS[kind],
        place=place,
        axis=place.rotation @ (axis / np.linalg.norm(axis)),
        limit=max(ends) if ends and kind != "continuous" else None,
        effort=given["effort"] or None,
        velocity=given["velocity"] or None,
    )


def _limit(limit: Element | None, key: str) -> float | None:
    """A number of a joint's `limit`; None where there is none that is finite."""
    try:
        value = float(limit.get(key, "")) if limit is not None else math.nan
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _lump(reader: _Reader, name: str, link: Element) -> Lump | None:
    """Mass properties of a link in the frame of the body; None for one without mass."""
    inertial = link.find("inertial")
    if inertial is None:
        return None
    mass_element, inertia = inertial.find("mass"), inertial.find("inertia")
    text = mass_element.get("value") if mass_element is not None else None
    (mass,) = reader.numbers(text, 1, (0.0,), f"'mass' of link '{name}'")
    if mass < 0.0:
        raise reader.fail(f"'mass' of link '{name}' is {mass:g} kg; 0 or more is wanted.")
    keys = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    found = [
        float(reader.numbers(inertia.get(key), 1, (0.0,), f"'{key}' of link '{name}'")[0])
        if inertia is not None
        else 0.0
        for key in keys
    ]
    xx, yy, zz, xy, xz, yz = found
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    place = reader.places[name].then(reader.origin(inertial, f"'inertial' of link '{name}'"))
    return Lump(float(mass), place.position, place.rotation @ tensor @ place.rotation.T)


def _colours(reader: _Reader) -> dict[str, tuple[float, ...]]:
    """Colours by the names of materials."""
    found: dict[str, tuple[float, ...]] = {}
    for material in reader.root.iter("material"):
        color = material.find("color")
        if color is not None and color.get("rgba"):
            name = material.get("name", "")
            found.setdefault(name, tuple(reader.numbers(color.get("rgba"), 4, (), f"material '{name}'")))
    return found


def _solids(
    reader: _Reader, links: dict[str, Element], which: str, colours: dict[str, tuple[float, ...]]
) -> Iterator[Solid]:
    """Shapes of all links, for contact or for drawing."""
    for name, link in links.items():
        for element in link.findall(which):
            where = f"a {which} of link '{name}'"
            place = reader.places[name].then(reader.origin(element, where))
            material = element.find("material")
            rgba = colours.get(material.get("name", "")) if material is not None else None
            solid = _solid(reader, element, where, name, place)
            if solid is not None:
                yield solid if rgba is None else _coloured(solid, rgba)


def _coloured(solid: Solid, rgba: tuple[float, ...]) -> Solid:
    return Solid(**{**vars(solid), "rgba": rgba})


def _solid(reader: _Reader, element: Element, where: str, link: str, place: Place) -> Solid | None:
    """One shape; None for one that is not taken."""
    for shape in element.findall("geometry/*"):
        if shape.tag == "box":
            size = reader.numbers(shape.get("size"), 3, (), f"'size' of {where}")
            return Solid("box", tuple(size), place, link)
        if shape.tag in ("cylinder", "sphere", "capsule"):
            (radius,) = reader.numbers(shape.get("radius"), 1, (), f"'radius' of {where}")
            if shape.tag == "sphere":
                return Solid("sphere", (2.0 * radius,), place, link)
            (length,) = reader.numbers(shape.get("length"), 1, (), f"'length' of {where}")
            if shape.tag == "capsule":
                return Solid("capsule", (2.0 * radius, length + 2.0 * radius), place, link)
            return Solid("cylinder", (2.0 * radius, length), place, link)
        if shape.tag == "mesh":
            scale = reader.numbers(shape.get("scale"), 3, (1.0,) * 3, f"'scale' of {where}")
            return reader.meshes.solid(shape.get("filename", ""), scale, where, link, place)
    return None
