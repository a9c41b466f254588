"""Samples of the outer surface of a thing in space, spread by area; what lies within other parts is left out."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np

from fulmar_core.states.rotation import rotate, rotate_inverse
from fulmar_core.worlds.structures import Part, Structure, xyzw

SAMPLES = 8_000  # of a whole surface, of which those between parts are left out
LIFT = 1e-3  # how far off its face a sample is looked at, of the half size: parts that touch hide each other's faces


@dataclass(frozen=True)
class Surface:
    """n samples of equal area."""

    points: np.ndarray  # in the world, shape (n, 3) [m]
    normals: np.ndarray  # outwards, unit vectors, shape (n, 3)
    parts: np.ndarray  # index of each one's part, shape (n,)


@functools.cache
def surface_of(structure: Structure, samples: int = SAMPLES) -> Surface:
    """The outer surface of a structure; the same samples each time.

    Raises:
        ValueError: All of it lies within other parts.
    """
    areas = np.array([_faces(part)[0].sum() for part in structure.parts])
    counts = np.round(samples * areas / areas.sum()).astype(int).clip(1)
    rng = np.random.default_rng(0)
    found = [_sampled(part, count, rng) for part, count in zip(structure.parts, counts, strict=True)]
    points, normals = (np.concatenate([each[i] for each in found]) for i in (0, 1))
    parts = np.repeat(np.arange(len(counts)), counts)
    lifted = points + LIFT * structure.half_size * normals
    buried = np.zeros(len(points), dtype=bool)
    for index, part in enumerate(structure.parts):
        buried |= (parts != index) & _holds(part, lifted)
    if buried.all():
        raise ValueError(f"'{structure.name}' has no outer surface.")
    return Surface(points[~buried], normals[~buried], parts[~buried])


def _faces(part: Part) -> tuple[np.ndarray, list[str]]:
    """Areas of the faces of a part [m²], and what each is."""
    if part.shape == "box":
        x, y, z = part.size
        return np.repeat([4 * y * z, 4 * x * z, 4 * x * y], 2), ["box"] * 6
    radius, half = part.size[0], part.size[-1]
    if part.shape == "sphere":
        return np.array([4 * math.pi * radius**2]), ["ball"]
    side = 4 * math.pi * radius * half
    if part.shape == "capsule":
        return np.array([4 * math.pi * radius**2, side]), ["ball", "side"]
    return np.array([side, 2 * math.pi * radius**2]), ["side", "ends"]


def _sampled(part: Part, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Points and normals in the world, spread by area over the faces, shapes (count, 3)."""
    areas, kinds = _faces(part)
    # Evenly spaced along the sum of the areas: each face has its share but for less than one sample.
    face = np.searchsorted(np.cumsum(areas), (np.arange(count) + 0.5) * areas.sum() / count)
    u, v = rng.uniform(-1.0, 1.0, (2, count))
    points, normals = np.zeros((2, count, 3))
    for index, kind in enumerate(kinds):
        mine = face == index
        points[mine], normals[mine] = _on_face(part, kind, index, u[mine], v[mine])
    quat = xyzw(part.pose)
    return np.array(part.pose[:3]) + rotate(quat, points), rotate(quat, normals)


def _on_face(
    part: Part, kind: str, index: int, u: np.ndarray, v: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Points and normals in the part's frame from numbers between -1 and 1."""
    normals = np.zeros((len(u), 3))
    if kind == "box":
        axis = index // 2
        normals[:, axis] = 1.0 if index % 2 else -1.0
        points = normals * np.array(part.size)
        for other, number in zip([a for a in range(3) if a != axis], (u, v), strict=True):
            points[:, other] = part.size[other] * number
        return points, normals
    radius, half, angle = part.size[0], part.size[-1], math.pi * v
    across = np.stack((np.cos(angle), np.sin(angle)), axis=-1)
    if kind == "ball":
        normals = np.column_stack((np.sqrt(1.0 - u * u)[:, None] * across, u))
        lift = np.sign(u) * half if part.shape == "capsule" else 0.0
        return radius * normals + np.column_stack((0.0 * u, 0.0 * u, lift + 0.0 * u)), normals
    if kind == "side":
        normals[:, :2] = across
        return np.column_stack((radius * across, half * u)), normals
    normals[:, 2] = np.sign(u)
    return np.column_stack((radius * np.sqrt(np.abs(u))[:, None] * across, half * np.sign(u))), normals


def _holds(part: Part, points: np.ndarray) -> np.ndarray:
    """Whether points (n, 3) of the world lie within a part, shape (n,)."""
    local = np.abs(rotate_inverse(xyzw(part.pose), points - np.array(part.pose[:3])))
    if part.shape == "box":
        return np.asarray((local <= np.array(part.size)).all(axis=1))
    radius, half = part.size[0], 0.0 if part.shape == "sphere" else part.size[-1]
    across = np.hypot(local[:, 0], local[:, 1])
    if part.shape == "cylinder":
        return np.asarray((across <= radius) & (local[:, 2] <= half))
    return np.asarray(np.hypot(across, (local[:, 2] - half).clip(0.0)) <= radius)
