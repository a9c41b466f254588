"""What holds for each thing in space that Fulmar comes with, and how a file of one's own is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.config.paths import OWN_FOLDERS, config_path
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.worlds.structure_file import StructureFile
from fulmar_core.worlds.structures import SEMANTIC_IDS, KeepOut, list_structures, load_structure

STRUCTURES = {name: load_structure(name) for name in list_structures()}
HALVES = {"gateway": (1.2, 1.28), "iss": (2.1, 2.2), "venus_express": (1.9, 2.0)}  # m, at their scales
every = pytest.mark.parametrize("name", STRUCTURES)


def test_three_things_come_with_fulmar() -> None:
    assert sorted(STRUCTURES) == sorted(HALVES)


@every
def test_a_thing_is_as_large_as_the_true_one_at_its_scale(name: str) -> None:
    low, high = HALVES[name]
    assert low <= STRUCTURES[name].half_size <= high + 1e-9


@every
def test_no_part_lies_outside_of_the_keep_out_volume(name: str) -> None:
    structure = STRUCTURES[name]
    assert structure.keep_out.radius >= 1.2 * structure.half_size - 1e-9
    for part in structure.parts:
        assert structure.keep_out.distance(part.corners).max() < 0.0, part.name


@every
def test_parts_have_names_of_their_own_and_known_meanings(name: str) -> None:
    parts = STRUCTURES[name].parts
    assert len({part.name for part in parts}) == len(parts)
    assert {part.semantic for part in parts} <= set(SEMANTIC_IDS) - {"background"}
    assert all(min(part.size) > 0.0 and 0.0 <= min(part.color) <= max(part.color) <= 1.0 for part in parts)


@every
def test_few_parts_are_round_and_every_size_has_a_source(name: str) -> None:
    file = load_config(StructureFile, config_path("things", name))
    assert {part.source for part in file.parts} == set(file.sources)
    assert sum(part.shape != "box" for part in STRUCTURES[name].parts) <= 12


@every
def test_a_thing_elsewhere_keeps_distances_between_its_parts(name: str) -> None:
    structure = STRUCTURES[name]
    moved = structure.at((1.0, -2.0, 3.0, np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)))  # a quarter turn about z
    for part, there in zip(structure.parts, moved.parts, strict=True):
        x, y, z = part.corners.T
        np.testing.assert_allclose(there.corners, np.stack((1.0 - y, x - 2.0, z + 3.0), axis=1), atol=1e-9)
    assert moved.keep_out.distance(np.array((1.0, -2.0, 3.0))) == pytest.approx(-structure.keep_out.radius)


def test_a_keep_out_capsule_measures_from_its_line_in_numpy_and_torch() -> None:
    volume = KeepOut((0.0, 0.0, 0.0), (2.0, 0.0, 0.0), 0.5)
    points = [[1.0, 1.0, 0.0], [3.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [1.0, 0.0, 0.2]]
    for array in (np.array(points), torch.tensor(points)):
        away, far = volume.offset(array)
        np.testing.assert_allclose(far, [0.5, 0.5, 0.5, -0.3], atol=1e-6)
        np.testing.assert_allclose(away, [[0, 1, 0], [1, 0, 0], [-1, 0, 0], [0, 0, 1]], atol=1e-6)


GOOD = """title: a box
scale: 0.5
sources: {mine: measured}
parts:
  - {name: box, kind: box, size: [2, 4, 2], at: [[0, 0, 0]], semantic: bus, source: mine}
"""


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("kind: box", "kind: bix", "'kind' = 'bix' is not known. Did you mean 'box'?"),
        ("semantic: bus", "semantic: busz", "Did you mean 'bus'?"),
        ("size: [2, 4, 2]", "size: [2, -4, 2]", "'size entry 2' must be greater than 0."),
        ("source: mine", "source: yours", "part 'box' has the source 'yours', which is none of: mine."),
        ("[[0, 0, 0]]", "[]", "part 'box' stands nowhere; give 'at' a place."),
        ("  - {name: box", "  []\nother: {name: box", "Known"),
        ("scale: 0.5", "scale: 0", "'scale' must be greater than 0."),
        (
            "scale: 0.5",
            "scale: 0.5\nkeep_out: {start: [0, 0, 0], end: [0, 0, 0], radius: 2}",
            "part 'box' reaches 0.45 m out of 'keep_out'. Make that larger.",
        ),
    ],
)
def test_a_mistake_in_a_file_is_said_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, old: str, new: str, words: str
) -> None:
    (tmp_path / "things").mkdir()
    (tmp_path / "things/mine.yaml").write_text(GOOD.replace(old, new))
    monkeypatch.setenv(OWN_FOLDERS, str(tmp_path))
    with pytest.raises(ConfigError, match="mine") as refused:
        load_structure("mine")
    assert words in str(refused.value) and "\n" not in str(refused.value)


def test_a_thing_without_parts_and_an_unknown_one_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "things").mkdir()
    (tmp_path / "things/empty.yaml").write_text("title: none\nscale: 1\nsources: {}\nparts: []\n")
    monkeypatch.setenv(OWN_FOLDERS, str(tmp_path))
    with pytest.raises(ConfigError, match="a thing without a surface cannot be inspected"):
        load_structure("empty")
    with pytest.raises(UnknownNameError, match="unknown thing 'gatewai'") as unknown:
        load_structure("gatewai")
    assert str(unknown.value).endswith("Did you mean 'gateway'?")
