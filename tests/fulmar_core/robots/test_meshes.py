"""Meshes of a look: read from STL, OBJ and GLB, found beside the robot's file, else refused in one line."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_path
from fulmar_core.robots import gltf_file
from fulmar_core.robots.look import Part
from fulmar_core.robots.look_files import without_mesh_files
from fulmar_core.robots.look_of import look_as_json
from fulmar_core.robots.mesh_file import read_mesh
from fulmar_core.robots.mesh_outline import MOST_TRIANGLES, outline_of, packed, unpacked
from fulmar_core.robots.robot_file import load_robot_file
from fulmar_core.robots.urdf import urdf_of
from tests.robot_files import write_cuboid

SIZE = (0.4, 0.3, 0.2)
TEXT_STL = """solid triangle
 facet normal 0 0 1
  outer loop
   vertex 0 0 0
   vertex 1e0 0 0
   vertex 0 2.5 0
  endloop
 endfacet
endsolid triangle
"""


def write_robot(folder: Path, *parts: dict) -> Path:
    """The shipped platform with a look of its own."""
    robot = yaml.safe_load(config_path("robots", "floating_platform").read_text(encoding="utf-8"))
    path = folder / "drawn.yaml"
    path.write_text(yaml.safe_dump(robot | {"name": "drawn", "look": list(parts)}), encoding="utf-8")
    return path


@pytest.mark.parametrize("name", ["cuboid.stl", "cuboid.obj", "CUBOID.STL"])
def test_a_cuboid_has_its_corners_and_twelve_triangles_that_face_outwards(tmp_path, name):
    write_cuboid(tmp_path / name, SIZE)
    mesh = read_mesh(tmp_path / name)
    assert mesh.vertices.shape == (8, 3)
    assert mesh.triangles.shape == (12, 3)
    low, high = mesh.span
    assert high - low == pytest.approx(SIZE)
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0 == pytest.approx(np.prod(SIZE))


def test_a_text_stl_is_read(tmp_path):
    (tmp_path / "one.stl").write_text(TEXT_STL)
    mesh = read_mesh(tmp_path / "one.stl")
    assert mesh.vertices.max(axis=0).tolist() == [1.0, 2.5, 0.0]
    assert mesh.triangles.shape == (1, 3)


def test_numbers_of_an_obj_may_count_from_the_last_vertex(tmp_path):
    (tmp_path / "one.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2/1/1 -1\n# end\n")
    assert read_mesh(tmp_path / "one.obj").triangles.tolist() == [[0, 1, 2]]


def glb(document: dict, binary: bytes = b"") -> bytes:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text
    body += struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<III", 0x46546C67, 2, 12 + len(body)) + body


def triangle_glb(**changed) -> bytes:
    """A triangle of 16-bit numbers, in a node that is turned about z, in one that is moved and twice as large."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype="<f4").tobytes()
    binary = corners + np.array([0, 1, 2], dtype="<u2").tobytes() + b"\0\0"
    half = float(np.sqrt(0.5))
    document = {
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {"children": [1], "translation": [10, 0, 0], "scale": [2, 2, 2]},
            {"mesh": 0, "rotation": [0, 0, half, half]},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 6}],
        "buffers": [{"byteLength": len(binary)}],
    }
    return glb(document | changed, binary)


def test_a_binary_gltf_has_its_nodes_in_their_places(tmp_path):
    (tmp_path / "one.glb").write_bytes(triangle_glb())
    mesh = read_mesh(tmp_path / "one.glb")
    assert mesh.triangles.tolist() == [[0, 1, 2]]
    assert mesh.vertices == pytest.approx(np.array([[10, 0, 0], [10, 2, 0], [8, 0, 0]]), abs=1e-6)


BUSHY = [{"children": [n + 1] * 3} for n in range(60)] + [{}]  # stand for three, nine, 27 nodes and so on


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.stl", b"", "is no whole STL file"),
        ("a.stl", b"\0" * 80 + b"\5\0\0\0" + b"\0" * 60, "5 triangles take 334 bytes, and it has 144"),
        ("a.stl", b"solid\nvertex 0 0 0\nvertex 1 0 0\n", "2 vertices are no triangles"),
        ("a.stl", b"solid\nvertex 0 0 a\nvertex 1 0 0\nvertex 1 1 0\n", "is no whole STL file"),
        ("a.obj", b"v 0 0 0\nf 1 2 3\n", "a face names a vertex that is not there"),
        ("a.obj", b"v 0 0 x\n", "is no whole OBJ file"),
        ("a.obj", b"v 0 0 0\n", "has no triangles"),
        ("a.obj", b"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "vertices that are not finite"),
        ("a.glb", b"glTF", "it is cut off"),
        ("a.glb", b"x" * 40, "it has no header of version 2"),
        ("a.glb", triangle_glb()[:-4], "is cut off"),
        (
            "a.glb",
            triangle_glb(extensionsRequired=["KHR_draco_mesh_compression"]),
            "export it without compression",
        ),
        ("a.glb", triangle_glb(bufferViews=[{"buffer": 0, "byteOffset": 40}] * 2), "its buffer is cut off"),
        ("a.glb", triangle_glb(nodes=[{"children": [0]}]), "nested too deeply"),
        pytest.param("a.glb", triangle_glb(nodes=BUSHY), "stand for too many", marks=pytest.mark.slow),
        ("a.glb", triangle_glb(accessors=[]), "IndexError"),
        ("a.glb", triangle_glb(meshes=3), "is no whole GLB file"),
        ("a.glb", glb({}), "has no triangles"),
        ("a.dae", b"<COLLADA/>", "'.dae' is no mesh that is drawn; accepted are .stl, .obj, .glb"),
    ],
)
def test_a_damaged_mesh_is_refused_in_one_line_with_its_path(tmp_path, name, content, said):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(ConfigError) as refused:
        read_mesh(path)
    assert str(refused.value).startswith(f"{path}: ")
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_nodes_that_stand_for_too_many_are_refused_once_the_limit_is_reached(tmp_path, monkeypatch):
    monkeypatch.setattr(gltf_file, "MOST_NODES", 1000)
    path = tmp_path / "a.glb"
    path.write_bytes(triangle_glb(nodes=BUSHY))
    with pytest.raises(ConfigError, match="stand for too many"):
        read_mesh(path)


def test_a_mesh_that_is_missing_is_one_line_with_its_path_and_the_line_of_the_robot_s_file(tmp_path):
    path = write_robot(
        tmp_path, {"shape": "sphere", "size": [0.1]}, {"shape": "mesh", "file": "meshes/hull.stl"}
    )
    with pytest.raises(ConfigError) as refused:
        load_robot_file(path)
    line = 1 + path.read_text().splitlines().index("- file: meshes/hull.stl")
    assert str(refused.value).startswith(
        f"{path}:{line}: 'look.1.file': {tmp_path / 'meshes/hull.stl'}: there is no"
    )
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    "part",
    [
        {"shape": "mesh"},
        {"shape": "box", "size": [1, 1, 1], "file": "a.stl"},
        {"shape": "mesh", "file": "a.stl", "size": [1]},
        {"shape": "mesh", "file": "a.stl", "scale": [1, 0, 1]},
        {"shape": "box"},
    ],
)
def test_a_part_that_is_half_a_mesh_is_refused(tmp_path, part):
    with pytest.raises(ConfigError, match=r"a mesh has a 'file'|'size' of a box has 3 lengths"):
        load_robot_file(write_robot(tmp_path, part))


@pytest.fixture
def drawn(tmp_path):
    """The platform with a cuboid in millimetres, turned by a quarter, 0.1 m up."""
    write_cuboid(tmp_path / "meshes" / "hull.stl", tuple(1000.0 * each for each in SIZE))
    part = {
        "shape": "mesh",
        "file": "meshes/hull.stl",
        "scale": [0.001] * 3,
        "at": [0, 0, 0.1],
        "rpy": [0, 0, 90],
    }
    return load_robot_file(write_robot(tmp_path, part | {"color": "navy"}))


def test_the_urdf_has_the_mesh_by_its_address(drawn, tmp_path):
    visual = ElementTree.fromstring(urdf_of(drawn)).find("link/visual")
    mesh = visual.find("geometry/mesh")
    assert mesh.get("filename") == (tmp_path / "meshes" / "hull.stl").resolve().as_uri()
    assert mesh.get("scale") == "0.001 0.001 0.001"
    assert visual.find("origin").get("xyz") == "0.0 0.0 0.1"


def test_robot_info_has_the_mesh_in_metres_and_the_size_of_its_box(drawn):
    (part,) = look_as_json(drawn)
    assert part["shape"] == "mesh"
    assert part["size"] == pytest.approx(SIZE)
    assert part["at"] == pytest.approx([0.0, 0.0, 0.1], abs=1e-9)  # of the origin of the file
    points, corners = unpacked(part["mesh"])
    assert np.ptp(points, axis=0) == pytest.approx(SIZE, rel=1e-6)
    assert volume(points, corners) == pytest.approx(np.prod(SIZE), rel=1e-6)


def write_ball(path: Path, rows: int = 60) -> None:
    """A ball of radius 1 about (3, 0, 0), of 4 * rows * rows triangles that face outwards."""
    heights, turns = np.linspace(-1.0, 1.0, rows + 1), np.linspace(0.0, 2.0 * np.pi, 2 * rows, endpoint=False)
    across = np.sqrt(1.0 - heights**2)
    lines = [
        f"v {3.0 + width * np.cos(turn):.6f} {width * np.sin(turn):.6f} {height:.6f}"
        for height, width in zip(heights, across, strict=True)
        for turn in turns
    ]
    around = len(turns)
    for row in range(rows):
        for place in range(around):
            one, next_one = row * around + place, row * around + (place + 1) % around
            lines.append(f"f {one + 1} {next_one + 1} {next_one + around + 1} {one + around + 1}")
    path.write_text("\n".join(lines))


def volume(points: np.ndarray, corners: np.ndarray) -> float:
    a, b, c = np.moveaxis(points[corners], 1, 0)
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0


def test_a_fine_mesh_travels_with_few_triangles_and_keeps_its_form(tmp_path):
    write_ball(tmp_path / "ball.obj")
    assert len(read_mesh(tmp_path / "ball.obj").triangles) == 4 * 60 * 60
    mesh = outline_of(Part("mesh", file=str(tmp_path / "ball.obj")), 1500)
    assert 700 < len(mesh.triangles) <= 1500
    assert np.linalg.norm(mesh.vertices - [3.0, 0.0, 0.0], axis=1) == pytest.approx(1.0, abs=0.03)
    assert volume(mesh.vertices, mesh.triangles) == pytest.approx(4.0 / 3.0 * np.pi, rel=0.05)
    points, corners = unpacked(packed(mesh))
    assert points[corners] == pytest.approx(mesh.vertices[mesh.triangles], abs=1e-6)


def test_a_mirrored_mesh_still_faces_outwards(tmp_path):
    write_cuboid(tmp_path / "cuboid.stl", SIZE)
    mesh = outline_of(Part("mesh", file=str(tmp_path / "cuboid.stl"), scale=(1.0, -2.0, 1.0)), 1500)
    assert volume(mesh.vertices, mesh.triangles) == pytest.approx(2.0 * np.prod(SIZE))


def test_all_meshes_of_a_robot_share_the_most_of_triangles(tmp_path):
    write_ball(tmp_path / "ball.obj")
    parts = [{"shape": "mesh", "file": "ball.obj", "at": [0, 0, height]} for height in range(4)]
    look = look_as_json(load_robot_file(write_robot(tmp_path, *parts, {"shape": "sphere", "size": [0.1]})))
    counts = [len(unpacked(part["mesh"])[1]) for part in look if "mesh" in part]
    assert len(counts) == 4
    assert 1500 < sum(counts) <= MOST_TRIANGLES
    assert len(json.dumps(look)) < 80_000


def test_a_damaged_mesh_of_robot_info_is_refused(tmp_path):
    write_cuboid(tmp_path / "cuboid.stl", SIZE)
    said = packed(outline_of(Part("mesh", file=str(tmp_path / "cuboid.stl")), 1500))
    for key in said:
        with pytest.raises(ValueError):
            unpacked(said | {key: said[key][:-4]})


def test_a_bag_s_robot_is_read_without_its_meshes(tmp_path):
    path = write_robot(tmp_path, {"shape": "sphere", "size": [0.1]}, {"shape": "mesh", "file": "a.stl"})
    path.write_bytes(without_mesh_files(path.read_bytes()))
    assert load_robot_file(path).look == (Part("sphere", (0.1,)),)
    path = write_robot(tmp_path, {"shape": "mesh", "file": "a.stl"})
    path.write_bytes(without_mesh_files(path.read_bytes()))
    assert load_robot_file(path).look == ()


@pytest.mark.parametrize(
    "text", [b"\xff", b"a: [", b"[]", b"look: 3\n", b"look: [{shape: box}]  # as it is\n"]
)
def test_other_files_stay_byte_for_byte(text):
    assert without_mesh_files(text) == text
