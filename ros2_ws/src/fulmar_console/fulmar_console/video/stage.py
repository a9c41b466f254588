"""A MuJoCo model that is only drawn: sky, ground, light, the bodies of robots by their look, and things in space.

No backend and no camera of a robot uses it, so that what it shows changes neither physics nor what policies see.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np

from fulmar_console.exports.drawn_parts import DrawnPart, parts_of, rgba_of, structures_of
from fulmar_core.states.rotation import multiply

SPIN = 25.0  # of what spins, at full command [rad/s]
TURNS = ("surface", "steer")  # kinds of actuators that stand at an angle; all others spin
RING = 32  # vertices of a cone's base
THING_M = 0.3  # side of a thing whose size a bag does not say [m]
THING_RGBA = (0.93, 0.55, 0.20, 1.0)
SHAPES = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
}


@dataclass(frozen=True)
class Surroundings:
    """Colours of one kind of world.

    Attributes:
        sky: From the horizon, and overhead.
        ground: Two of the floor's squares, or none.
        line: Of the edges of squares.
        square: Side of a square of the floor [m]; 0 draws none.
        shine: How far the floor mirrors, 0 to 1.
        stars: Share of the sky's pixels that are stars.
    """

    sky: tuple[tuple[float, float, float], tuple[float, float, float]]
    ground: tuple[tuple[float, float, float], tuple[float, float, float]] = ((0, 0, 0), (0, 0, 0))
    line: tuple[float, float, float] = (0, 0, 0)
    square: float = 0.0
    shine: float = 0.0
    stars: float = 0.0


DAY = ((0.80, 0.88, 0.95), (0.28, 0.47, 0.72))
NIGHT = ((0.012, 0.016, 0.032), (0.004, 0.005, 0.012))
ROOM = ((0.62, 0.68, 0.75), (0.30, 0.36, 0.44))
SURROUNDINGS = {
    "plane": Surroundings(ROOM, ((0.40, 0.44, 0.50), (0.44, 0.48, 0.54)), (0.56, 0.60, 0.66), 0.5, 0.12),
    "water": Surroundings(DAY, ((0.10, 0.33, 0.46), (0.11, 0.35, 0.48)), (0.16, 0.41, 0.54), 1.0, 0.18),
    "flight": Surroundings(DAY, ((0.13, 0.36, 0.44), (0.15, 0.385, 0.465)), (0.24, 0.47, 0.54), 5.0, 0.08),
    "space": Surroundings(NIGHT, stars=0.004),
    "attitude": Surroundings(NIGHT, stars=0.004),
}


@dataclass
class _Mover:
    """A part that an actuator turns."""

    body: int
    index: int  # of the actuator
    about: np.ndarray
    still: np.ndarray  # how it is turned at rest, quaternion x, y, z, w
    factor: float  # angle by the share of full command [rad], or speed [rad/s]
    turns: bool
    angle: float = 0.0


@dataclass
class Stage:
    """A compiled model, and what of it moves."""

    model: Any
    data: Any
    ground: float | None  # height of the floor; none in space [m]
    reach: float  # how far the largest robot reaches [m]
    movers: list[list[_Mover]] = field(default_factory=list)

    def place(self, number: int, pose: np.ndarray, shares: np.ndarray, dt: float) -> None:
        """Put a robot at a pose (x, y, z, quaternion x, y, z, w), and turn its parts by what its actuators do."""
        self._put(f"robot{number}", pose)
        for mover in self.movers[number]:
            share = float(shares[mover.index]) if mover.index < len(shares) else 0.0
            mover.angle = mover.factor * share if mover.turns else mover.angle + mover.factor * share * dt
            half = 0.5 * mover.angle
            turn = np.array([*(math.sin(half) * mover.about), math.cos(half)])
            self.model.body_quat[mover.body] = _wxyz(multiply(mover.still, turn))

    def place_thing(self, name: str, pose: np.ndarray) -> None:
        """Put a thing of a task at a pose."""
        self._put(f"thing:{name}", pose)

    def _put(self, name: str, pose: np.ndarray) -> None:
        mocap = self.model.body(name).mocapid[0]
        self.data.mocap_pos[mocap], self.data.mocap_quat[mocap] = pose[:3], _wxyz(pose[3:])


def build_stage(
    records: Sequence[Mapping[str, Any]], things: Sequence[str], size: tuple[int, int], floor: float
) -> Stage:
    """The stage of some robots.

    Args:
        records: Of the robots, as the page has them.
        things: Names of what they push or carry.
        size: Of images [px].
        floor: Height of the origin of robots on a floor [m].
    """
    spec = mujoco.MjSpec()
    infos = [record.get("info") or {} for record in records]
    space = next((str(info["space"]) for info in infos if info.get("space")), "plane")
    around = SURROUNDINGS.get(space, SURROUNDINGS["plane"])
    drawn = [parts_of(record) for record in records]
    reach = max(_reach(parts) for parts in drawn)
    lowest = min(_lowest(parts) for parts in drawn)
    ground = None if not around.square else floor + lowest if space == "plane" else 0.0
    _add_surroundings(spec, around, ground, reach, size)
    indices = [
        _add_robot(spec, number, record, parts)
        for number, (record, parts) in enumerate(zip(records, drawn, strict=True))
    ]
    _add_things(spec, records, things)
    model = spec.compile()
    stage = Stage(model, mujoco.MjData(model), ground, reach)
    stage.movers = [
        [_mover(model, number, part, infos[number], drawn[number][part]) for part in parts]
        for number, parts in enumerate(indices)
    ]
    return stage


def _add_surroundings(
    spec: Any, around: Surroundings, ground: float | None, reach: float, size: tuple[int, int]
) -> None:
    horizon, overhead = around.sky
    sky = spec.add_texture(
        name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=overhead, rgb2=horizon, width=512, height=512,
    )  # fmt: skip
    if around.stars:
        sky.mark, sky.markrgb, sky.random = mujoco.mjtMark.mjMARK_RANDOM, [0.85, 0.88, 0.95], around.stars
    if ground is not None:
        spec.add_texture(
            name="floor", type=mujoco.mjtTexture.mjTEXTURE_2D, builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
            mark=mujoco.mjtMark.mjMARK_EDGE, rgb1=around.ground[0], rgb2=around.ground[1],
            markrgb=around.line, width=512, height=512,
        )  # fmt: skip
        repeat = 0.5 / around.square
        floor = spec.add_material(
            name="floor", texuniform=True, texrepeat=[repeat, repeat], reflectance=around.shine
        )
        floor.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "floor"
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 0.05], pos=[0, 0, ground], material="floor"
        )
    spec.worldbody.add_light(
        name="sun", type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, dir=[-0.3, 0.22, -1.0],
        diffuse=[0.75, 0.74, 0.70], specular=[0.3, 0.3, 0.3], castshadow=ground is not None,
    )  # fmt: skip
    look = spec.visual
    look.headlight.ambient, look.headlight.diffuse = [0.38, 0.39, 0.42], [0.22, 0.22, 0.24]
    look.headlight.specular = [0.05, 0.05, 0.05]
    look.global_.offwidth, look.global_.offheight = size
    look.global_.fovy = 40.0
    look.quality.shadowsize, look.quality.numslices, look.quality.numstacks = 2048, 24, 14
    look.rgba.haze = [*horizon, 1.0]
    look.rgba.fog = [*horizon, 1.0]
    spec.stat.extent, spec.stat.center = reach, [0.0, 0.0, 0.0]
    look.map.znear, look.map.zfar = 0.1, 150.0
    look.map.fogstart, look.map.fogend = 40.0, 300.0
    look.map.shadowclip = 14.0  # less leaves dots of shadow on the floor
    look.map.haze = 0.5


def _add_robot(spec: Any, number: int, record: Mapping[str, Any], parts: Sequence[DrawnPart]) -> list[int]:
    """Add a robot's body; the indices of its parts that move, each of which is a body of its own."""
    body = spec.worldbody.add_body(name=f"robot{number}", mocap=True)
    look = (record.get("info") or {}).get("look") or ()
    moving = []
    for index, part in enumerate(parts):
        name = f"robot{number}/{index}"
        if index < len(look) and look[index].get("moves"):
            mine = body.add_body(name=name, pos=list(part.at), quat=_wxyz(np.array(part.quat_xyzw)).tolist())
            _add_part(spec, mine, name, part, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
            moving.append(index)
        else:
            _add_part(spec, body, name, part, part.at, part.quat_xyzw)
    return moving


def _add_part(
    spec: Any, body: Any, name: str, part: DrawnPart, at: Sequence[float], quat: Sequence[float]
) -> None:
    """Add a geom that touches nothing."""
    placed = {
        "pos": list(at), "quat": _wxyz(np.array(quat)).tolist(), "rgba": list(part.rgba),
        "contype": 0, "conaffinity": 0,
    }  # fmt: skip
    if part.mesh is not None:
        points, corners = part.mesh
        mesh = spec.add_mesh(name=name, uservert=points.ravel(), userface=corners.ravel())
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL  # it need not be closed
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, **placed)
        return
    x, y, z = (0.5 * each for each in part.size)
    if part.shape == "cone":
        mesh = spec.add_mesh(name=name)
        angles = 2.0 * np.pi * np.arange(RING) / RING
        ring = np.stack((x * np.cos(angles), x * np.sin(angles), np.full(RING, -z)), axis=1)
        mesh.uservert = np.vstack((ring, (0.0, 0.0, z))).ravel()
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, **placed)
        return
    length = max(z - x, 1e-4) if part.shape == "capsule" else z
    size = {"box": [x, y, z], "sphere": [x, 0.0, 0.0]}.get(part.shape, [x, length, 0.0])
    body.add_geom(type=SHAPES[part.shape], size=size, **placed)


def _add_things(spec: Any, records: Sequence[Mapping[str, Any]], things: Sequence[str]) -> None:
    """Add things in space where they stand, and what robots push."""
    for number, part in enumerate(part for record in records for part in structures_of(record)):
        _add_part(spec, spec.worldbody, f"structure{number}", part, part.at, part.quat_xyzw)
    still = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)
    block = DrawnPart("box", (THING_M, THING_M, THING_M), *still, THING_RGBA)
    for name in things:
        body = spec.worldbody.add_body(name=f"thing:{name}", mocap=True)
        _add_part(spec, body, f"thing:{name}", block, *still)


def _mover(model: Any, number: int, index: int, info: Mapping[str, Any], part: DrawnPart) -> _Mover:
    said = info["look"][index]
    actuators = info.get("actuators") or ()
    place = next((i for i, each in enumerate(actuators) if each["name"] == said["moves"]), len(actuators))
    kind: Mapping[str, Any] = actuators[place] if place < len(actuators) else {"kind": "", "full": 0.0}
    about = np.array(said["about"], dtype=float)
    turns = kind["kind"] in TURNS
    factor = float(said.get("gain", 1.0)) * (float(kind["full"]) if turns else SPIN)
    body = model.body(f"robot{number}/{index}").id
    return _Mover(body, place, about / np.linalg.norm(about), np.array(part.quat_xyzw), factor, turns)


def _reach(parts: Sequence[DrawnPart]) -> float:
    """How far a look reaches from the body's origin, about [m]."""
    return max(float(np.linalg.norm(part.at)) + 0.5 * max(part.size) for part in parts)


def _lowest(parts: Sequence[DrawnPart]) -> float:
    """Height of the lowest point of a look in the body's frame, about [m]."""
    found = 0.0
    for part in parts:
        matrix = np.zeros(9)
        mujoco.mju_quat2Mat(matrix, _wxyz(np.array(part.quat_xyzw)))
        found = min(found, part.at[2] - 0.5 * float(np.abs(matrix.reshape(3, 3)[2]) @ np.array(part.size)))
    return found


def _wxyz(quat: np.ndarray) -> np.ndarray:
    x, y, z, w = (float(each) for each in quat)
    return np.array([w, x, y, z])


def own_color(record: Mapping[str, Any]) -> tuple[float, float, float, float]:
    """The colour by which a robot is known among others."""
    return rgba_of(str(record.get("color", "#8899aa")))
