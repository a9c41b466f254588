"""Read an MJCF into a `Description`, by MuJoCo's own parser: its joints at their reference, masses lumped."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from fulmar_core.config.errors import ConfigError, did_you_mean
from fulmar_evaluation.new_robot.description import (
    Description,
    Gap,
    Joint,
    Lump,
    Place,
    Solid,
    Spin,
    Thrust,
)
from fulmar_evaluation.new_robot.mesh_places import Meshes

BODY, SITE, JOINT = mujoco.mjtObj.mjOBJ_BODY, mujoco.mjtObj.mjOBJ_SITE, mujoco.mjtObj.mjOBJ_JOINT
GEOM, ACTUATOR, MESH = mujoco.mjtObj.mjOBJ_GEOM, mujoco.mjtObj.mjOBJ_ACTUATOR, mujoco.mjtObj.mjOBJ_MESH
SHOWN = 3  # groups of geoms below it are shown by MuJoCo's viewer
UNPAINTED = (0.5, 0.5, 0.5, 1.0)  # MuJoCo's colour of a geom without one


@dataclass
class _Reader:
    """A model under way, and the body whose frame is the robot's."""

    path: Path
    spec: mujoco.MjSpec
    model: mujoco.MjModel
    data: mujoco.MjData
    root: int
    meshes: Meshes
    gaps: list[Gap] = field(default_factory=list)

    def name(self, kind: mujoco.mjtObj, number: int) -> str:
        return mujoco.mj_id2name(self.model, kind, number) or ""

    def place(self, position: np.ndarray, rotation: np.ndarray) -> Place:
        """A frame in the world, in that of the robot."""
        at, turn = self.data.xpos[self.root], self.data.xmat[self.root].reshape(3, 3)
        return Place(turn.T @ (position - at), turn.T @ rotation.reshape(3, 3))

    @property
    def bodies(self) -> list[int]:
        """The robot's bodies, from its outermost one on."""
        top = self.model.body_rootid[self.root]
        return [number for number in range(1, self.model.nbody) if self.model.body_rootid[number] == top]


def read_mjcf(path: Path, root_body: str = "") -> Description:
    """Read an MJCF.

    Args:
        path: The file.
        root_body: Whose frame becomes the robot's; empty: the body with a free joint, else the heaviest of the world's.

    Raises:
        ConfigError: It cannot be read, or has no such body; one line.
    """
    if not path.is_file():
        raise ConfigError(f"{path}: cannot be read (there is no such file).")
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise ConfigError(f"{path}: no MJCF: {_one_line(error)}.") from error
    meshes = Meshes(path)
    gaps = _drop_missing(spec, path)
    try:
        model = spec.compile()
    except ValueError as error:
        raise ConfigError(f"{path}: MuJoCo does not build it: {_one_line(error)}.") from error
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    reader = _Reader(path, spec, model, data, 0, meshes, gaps)
    reader.root = _root(reader, root_body)
    visuals, contacts = _solids(reader)
    return Description(
        source=path,
        name=spec.modelname or path.stem,
        lump=Lump.of(_lumps(reader)),
        frames=dict(_frames(reader)),
        joints=tuple(_joints(reader)),
        contacts=tuple(contacts),
        visuals=tuple(visuals),
        thrusts=tuple(_thrusts(reader)),
        gaps=(*reader.gaps, *meshes.gaps),
    )


def _one_line(error: ValueError) -> str:
    return " ".join(str(error).removeprefix("Error: ").split()).rstrip(".")


def _drop_missing(spec: mujoco.MjSpec, path: Path) -> list[Gap]:
    """Take out meshes whose files are missing, where no mass follows from them.

    Raises:
        ConfigError: A mass does.
    """
    folder = path.parent / (spec.meshdir or "")
    gaps = []
    for mesh in list(spec.meshes):
        file = folder / mesh.file
        if not mesh.file or file.is_file():
            continue
        shown = [geom for geom in spec.geoms if geom.meshname == mesh.name]
        heavy = [geom.parent.name for geom in shown if not geom.parent.explicitinertial and geom.mass != 0.0]
        if heavy:
            raise ConfigError(
                f"{path}: the mesh {file} is not there, and the mass of body '{heavy[0]}' follows from it. Put it "
                "there, or give the body an <inertial>."
            )
        for element in (*shown, mesh):
            spec.delete(element)
        gaps.append(Gap("look", f"the mesh {file} is not there", "put it there"))
    return gaps


def _root(reader: _Reader, name: str) -> int:
    """The body whose frame is the robot's."""
    model = reader.model
    if name:
        names = [reader.name(BODY, number) for number in range(1, model.nbody)]
        if name not in names:
            raise ConfigError(
                f"{reader.path}: has no body '{name}'.{did_you_mean(name, filter(None, names))}"
            )
        return names.index(name) + 1
    free = [
        int(model.jnt_bodyid[number])
        for number in range(model.njnt)
        if model.jnt_type[number] == mujoco.mjtJoint.mjJNT_FREE
    ]
    tops = free or [number for number in range(1, model.nbody) if model.body_parentid[number] == 0]
    if not tops:
        raise ConfigError(f"{reader.path}: has no body.")
    return max(tops, key=lambda number: float(model.body_subtreemass[number]))


def _lumps(reader: _Reader) -> Iterator[Lump]:
    for number in reader.bodies:
        place = reader.place(reader.data.xipos[number], reader.data.ximat[number])
        tensor = place.rotation @ np.diag(reader.model.body_inertia[number]) @ place.rotation.T
        yield Lump(float(reader.model.body_mass[number]), place.position, tensor)


def _frames(reader: _Reader) -> Iterator[tuple[str, Place]]:
    """Bodies and sites that have names."""
    data = reader.data
    for number in reader.bodies:
        if name := reader.name(BODY, number):
            yield name, reader.place(data.xpos[number], data.xmat[number])
    for number in range(reader.model.nsite):
        if reader.model.site_bodyid[number] in reader.bodies and (name := reader.name(SITE, number)):
            yield name, reader.place(data.site_xpos[number], data.site_xmat[number])


def _joints(reader: _Reader) -> Iterator[Joint]:
    model, data = reader.model, reader.data
    slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
    for number in range(model.njnt):
        body, kind = int(model.jnt_bodyid[number]), model.jnt_type[number]
        if body not in reader.bodies or kind not in (slide, hinge):
            continue
        limited = bool(model.jnt_limited[number])
        spin: Spin = "slides" if kind == slide else "swings" if limited else "turns"
        place = reader.place(data.xanchor[number], data.xmat[body])
        axis = reader.data.xmat[reader.root].reshape(3, 3).T @ data.xaxis[number]
        link = reader.name(BODY, body)
        effort, velocity = _motor(model, number)
        yield Joint(
            name=reader.name(JOINT, number) or f"{link}_joint",
            link=link,
            kind=spin,
            place=place,
            axis=axis,
            limit=float(np.abs(model.jnt_range[number]).max()) if limited else None,
            effort=effort,
            velocity=velocity,
        )


def _motor(model: mujoco.MjModel, joint: int) -> tuple[float | None, float | None]:
    """Largest torque [N·m] and, of a speed servo, speed [rad/s] of the actuator on a joint; None: no such limit."""
    for number in range(model.nu):
        on_joint = model.actuator_trntype[number] == mujoco.mjtTrn.mjTRN_JOINT
        if not on_joint or model.actuator_trnid[number][0] != joint:
            continue
        gear = abs(float(model.actuator_gear[number][0])) or 1.0
        command = float(model.actuator_ctrlrange[number][1]) if model.actuator_ctrllimited[number] else 0.0
        force = float(model.actuator_forcerange[number][1]) if model.actuator_forcelimited[number] else 0.0
        servo = float(model.actuator_biasprm[number][2]) != 0.0
        if not servo and not force:
            force = command * float(model.actuator_gainprm[number][0])
        return gear * force or None, command / gear if servo and command else None
    return None, None


def _thrusts(reader: _Reader) -> Iterator[Thrust]:
    """Sites on which actuators push."""
    model = reader.model
    for number in range(model.nu):
        if model.actuator_trntype[number] != mujoco.mjtTrn.mjTRN_SITE:
            continue
        site, gear = int(model.actuator_trnid[number][0]), model.actuator_gear[number][:3]
        size = float(np.linalg.norm(gear))
        if size == 0.0 or model.site_bodyid[site] not in reader.bodies:
            continue
        place = reader.place(reader.data.site_xpos[site], reader.data.site_xmat[site])
        command = float(model.actuator_ctrlrange[number][1]) if model.actuator_ctrllimited[number] else 0.0
        yield Thrust(
            name=reader.name(ACTUATOR, number) or reader.name(SITE, site),
            position=place.position,
            direction=place.rotation @ gear / size,
            newtons=max(0.0, command * size * float(model.actuator_gainprm[number][0])),
        )


def _solids(reader: _Reader) -> tuple[list[Solid], list[Solid]]:
    """Shapes that are drawn, and shapes that touch: of a body without the one, the other are both."""
    shown: dict[int, list[Solid]] = {}
    touching: dict[int, list[Solid]] = {}
    model = reader.model
    for number in range(model.ngeom):
        body = int(model.geom_bodyid[number])
        solid = _solid(reader, number) if body in reader.bodies else None
        if solid is None:
            continue
        touches = bool(model.geom_contype[number] or model.geom_conaffinity[number])
        if touches:
            touching.setdefault(body, []).append(solid)
        if not touches and model.geom_group[number] < SHOWN:
            shown.setdefault(body, []).append(solid)
    drawn = [solid for body in reader.bodies for solid in shown.get(body) or touching.get(body, [])]
    return drawn, list(_flat(touching[body] for body in reader.bodies if body in touching))


def _flat(groups: Iterable[list[Solid]]) -> Iterator[Solid]:
    for group in groups:
        yield from group


def _solid(reader: _Reader, number: int) -> Solid | None:
    """One geom; None for one that is not taken."""
    model, data, kinds = reader.model, reader.data, mujoco.mjtGeom
    kind, (a, b, c) = model.geom_type[number], (float(each) for each in model.geom_size[number])
    link = reader.name(BODY, int(model.geom_bodyid[number]))
    place = reader.place(data.geom_xpos[number], data.geom_xmat[number])
    rgba = _colour(model, number)
    if kind == kinds.mjGEOM_SPHERE:
        return Solid("sphere", (2.0 * a,), place, link, rgba)
    if kind == kinds.mjGEOM_CYLINDER:
        return Solid("cylinder", (2.0 * a, 2.0 * b), place, link, rgba)
    if kind == kinds.mjGEOM_CAPSULE:
        return Solid("capsule", (2.0 * a, 2.0 * (a + b)), place, link, rgba)
    if kind == kinds.mjGEOM_BOX:
        return Solid("box", (2.0 * a, 2.0 * b, 2.0 * c), place, link, rgba)
    if kind == kinds.mjGEOM_MESH:
        return _mesh(reader, number, place, link, rgba)
    label = reader.name(GEOM, number) or f"number {number}"
    reader.gaps.append(
        Gap("look", f"the geom {label} of '{link}' is no box, cylinder, capsule, sphere or mesh")
    )
    return None


def _mesh(
    reader: _Reader, number: int, place: Place, link: str, rgba: tuple[float, ...] | None
) -> Solid | None:
    """A mesh, where its file puts it: MuJoCo moves its origin into its middle of mass."""
    model, which = reader.model, int(reader.model.geom_dataid[number])
    name = reader.name(MESH, which)
    mesh = reader.spec.mesh(name)
    x, y, z, w = np.roll(model.mesh_quat[which], -1)
    turn = place.rotation @ Rotation.from_quat([x, y, z, w]).as_matrix().T
    there = Place(place.position - turn @ model.mesh_pos[which], turn)
    file = str(Path(reader.spec.meshdir or "") / mesh.file)
    where = f"a geom of '{link}'"
    solid = reader.meshes.solid(file, np.array(mesh.scale), where, link, there)
    return solid and Solid(**{**vars(solid), "rgba": rgba})


def _colour(model: mujoco.MjModel, number: int) -> tuple[float, ...] | None:
    """Of the geom, else of its material; None where it has none."""
    rgba = tuple(float(each) for each in model.geom_rgba[number])
    material = int(model.geom_matid[number])
    if rgba == UNPAINTED and material >= 0:
        rgba = tuple(float(each) for each in model.mat_rgba[material])
    return None if rgba == UNPAINTED else rgba
