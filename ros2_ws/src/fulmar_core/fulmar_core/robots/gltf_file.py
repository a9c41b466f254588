"""Triangles of a binary glTF 2.0 (.glb), from its default scene with the places of its nodes.

Coordinates stay as the file has them, with y up by glTF's convention. Colours, textures, skins and animations are not
read. Format: Khronos Group, "glTF 2.0 Specification", §3.5 to §3.7 and §4.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from typing import Any

import numpy as np

from fulmar_core.states.rotation import rotate

MAGIC, JSON_CHUNK, BINARY_CHUNK = 0x46546C67, 0x4E4F534A, 0x004E4942
COMPONENTS = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
NUMBERS = {"SCALAR": 1, "VEC3": 3}
TRIANGLES = 4  # mode of a primitive
DEEPEST, MOST_NODES = 64, 100_000  # nodes below one another, and all that are drawn


def read_glb(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read a file.

    Returns:
        Vertices, shape (n, 3), and triangles, shape (m, 3).

    Raises:
        ValueError: It is no such file, damaged, or compressed by an extension.
    """
    document, binary = _chunks(data)
    if document.get("extensionsRequired"):
        needed = ", ".join(map(str, document["extensionsRequired"]))
        raise ValueError(f"it needs {needed}, which is not read: export it without compression")
    vertices, triangles, count = [np.zeros((0, 3))], [np.zeros((0, 3), dtype=int)], 0
    for mesh, pose in _placed_meshes(document):
        for primitive in document["meshes"][mesh]["primitives"]:
            if primitive.get("mode", TRIANGLES) != TRIANGLES:
                continue
            places = _accessor(document, binary, primitive["attributes"]["POSITION"]).reshape(-1, 3)
            if "indices" in primitive:
                numbers = _accessor(document, binary, primitive["indices"]).astype(int).reshape(-1)
            else:
                numbers = np.arange(len(places))
            if len(numbers) % 3 or (len(numbers) and numbers.max() >= len(places)):
                raise ValueError("a triangle names a vertex that is not there")
            vertices.append(places @ pose[:3, :3].T + pose[:3, 3])
            triangles.append(numbers.reshape(-1, 3) + count)
            count += len(places)
    return np.concatenate(vertices), np.concatenate(triangles)


def _chunks(data: bytes) -> tuple[dict[str, Any], bytes]:
    """The document and the binary buffer."""
    try:
        magic, version, length = struct.unpack_from("<III", data)
        if magic != MAGIC or version != 2 or length > len(data):
            raise ValueError("it has no header of version 2, or is cut off")
        size, kind = struct.unpack_from("<II", data, 12)
        if kind != JSON_CHUNK:
            raise ValueError("its first chunk is no JSON")
        document = json.loads(data[20 : 20 + size])
        binary, start = b"", 20 + size
        if start + 8 <= length:
            size, kind = struct.unpack_from("<II", data, start)
            binary = data[start + 8 : start + 8 + size] if kind == BINARY_CHUNK else b""
    except struct.error as error:
        raise ValueError("it is cut off") from error
    if not isinstance(document, dict):
        raise ValueError("its JSON is no object")
    return document, binary


def _placed_meshes(document: dict[str, Any]) -> Iterator[tuple[int, np.ndarray]]:
    """Numbers of the meshes of the default scene, and their poses as matrices of shape (4, 4)."""
    nodes, scenes = document.get("nodes", []), document.get("scenes", [])
    tops = scenes[document.get("scene", 0)].get("nodes", []) if scenes else range(len(nodes))
    waiting, drawn = [(number, np.eye(4), 0) for number in tops], 0
    while waiting:
        number, above, depth = waiting.pop()
        drawn += 1
        if depth > DEEPEST or drawn > MOST_NODES:
            raise ValueError("its nodes are nested too deeply, or stand for too many")
        node = nodes[number]
        pose = above @ _pose(node)
        if "mesh" in node:
            yield node["mesh"], pose
        waiting += [(child, pose, depth + 1) for child in node.get("children", [])]


def _pose(node: dict[str, Any]) -> np.ndarray:
    """Of a node in the one above, shape (4, 4); matrices are stored by columns."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=float).reshape(4, 4).T
    pose = np.eye(4)
    quat = np.array(node.get("rotation", (0.0, 0.0, 0.0, 1.0)), dtype=float)
    turn = rotate(quat / np.linalg.norm(quat), np.eye(3)).T
    pose[:3, :3] = turn * np.array(node.get("scale", (1.0, 1.0, 1.0)), dtype=float)
    pose[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return pose


def _accessor(document: dict[str, Any], binary: bytes, number: int) -> np.ndarray:
    """Values of an accessor, shape (count, numbers of one)."""
    accessor = document["accessors"][number]
    if "sparse" in accessor or "bufferView" not in accessor:
        raise ValueError("sparse accessors are not read")
    view = document["bufferViews"][accessor["bufferView"]]
    if view.get("buffer", 0) != 0 or "uri" in document["buffers"][0]:
        raise ValueError("its buffer is another file: export it as one .glb")
    kind, width = np.dtype(COMPONENTS[accessor["componentType"]]), NUMBERS[accessor["type"]]
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    stride, count = view.get("byteStride") or kind.itemsize * width, accessor["count"]
    if start + stride * (count - 1) + kind.itemsize * width > len(binary):
        raise ValueError("its buffer is cut off")
    rows = np.ndarray((count, width), kind, binary, start, (stride, kind.itemsize))
    return rows.astype(float)
