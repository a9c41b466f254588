"""Goals written down: what ships can be read, and mistakes are named."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import get_args, get_type_hints

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.config.paths import config_names
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks.excitation import Torques
from fulmar_core.tasks.goal_files import (
    FollowedPath,
    HeldVelocity,
    Poses,
    Positions,
    Trajectory,
    Velocities,
    load_goal_file,
    load_goals,
)
from fulmar_core.tasks.references import PATHS
from fulmar_core.tasks.references.in_space import SpacePath

SPACE_PATHS = {get_args(get_type_hints(path)["kind"])[0]: path for path in get_args(SpacePath)}
SIZES = {
    "circle": "radius: 1.0",
    "square": "side: 1.0",
    "infinite_square": "side: 1.0",
    "spiral": "start_radius: 0.5, end_radius: 1.5, turns: 4",
    "bernoulli_lemniscate": "half_width: 1.5",
    "gerono_lemniscate": "half_width: 1.5",
    "lissajous": "half_width: 1.0, half_height: 2.0, x_cycles: 3, y_cycles: 2",
    "hippopede": "a: 1.0, b: 0.8",
    "hypotrochoid": "ring_radius: 5, wheel_radius: 3, pen_distance: 1",
    "ngon": "corners: 5, radius: 1.0",
    "sine": "length: 4.0, amplitude: 0.5, cycles: 2",
    "race_track": "seed: 1",
    "line": "length: 4.0",
    "rectangle": "length: 4.0, width: 2.0, corner_radius: 0.5",
    "capsule": "length: 3.0, radius: 1.0",
}


@pytest.fixture
def read(tmp_path, monkeypatch):
    """Read a text as if it were a file of `configs/goals`."""
    for family in ("robots", "goals"):
        (tmp_path / family).mkdir()
    monkeypatch.setenv("FULMAR_CONFIGS", str(tmp_path))

    def load(text):
        (tmp_path / "goals" / "mine.yaml").write_text(text)
        return load_goals("mine")

    return load


@pytest.mark.parametrize("name", config_names("goals"))
def test_every_shipped_file_can_be_read_and_has_a_title(name):
    goals = load_goal_file(name)
    assert goals.title
    if isinstance(goals, Torques):
        return
    if isinstance(goals, FollowedPath):
        assert goals.planner().points.shape == (3600, 2)
    else:
        assert goals.targets().shape[1] == (3 if goals.form is PlanarState else 7)


def test_every_kind_of_path_ships_in_a_file():
    shipped = [load_goal_file(name) for name in config_names("goals")]
    assert {goals.path.kind for goals in shipped if isinstance(goals, FollowedPath)} == set(PATHS)
    assert {goals.path.kind for goals in shipped if isinstance(goals, Trajectory)} == set(SPACE_PATHS)


def test_docs_state_of_every_kind_of_goal_and_path_and_of_all_their_entries():
    text = (Path(__file__).parents[3] / "docs/goals.md").read_text(encoding="utf-8")
    kinds = (
        Positions,
        Poses,
        HeldVelocity,
        FollowedPath,
        Trajectory,
        Torques,
        *PATHS.values(),
        *SPACE_PATHS.values(),
    )
    entries = {field.name for kind in kinds for field in fields(kind)} - {"title"}
    assert {
        name
        for name in entries | set(PATHS) | set(SPACE_PATHS)
        if f"`{name}`" not in text and f"{name}:" not in text
    } == set()


def test_the_lab_s_circle_is_that_of_drift():
    goals = load_goals("lab_circle")
    radius = np.linalg.norm(goals.planner().points - np.array([2.5, -1.5]), axis=1)
    np.testing.assert_allclose(radius, 0.75)
    assert (goals.speed, goals.look_ahead) == (0.3, 0.15)


def test_positions_become_targets_without_a_heading(read):
    goals = read("kind: positions\ntitle: t\npositions: [[1, 2], [3.5, -4]]\n")
    assert isinstance(goals, Positions)
    np.testing.assert_array_equal(goals.targets(), [[1.0, 2.0, 0.0], [3.5, -4.0, 0.0]])


def test_degrees_of_poses_become_radians(read):
    goals = read("kind: poses\ntitle: t\nposes: [[1, 2, 90]]\n")
    assert isinstance(goals, Poses)
    np.testing.assert_allclose(goals.targets(), [[1.0, 2.0, np.pi / 2]])


def test_velocities_know_when_each_is_over(read):
    goals = read(
        "kind: velocities\ntitle: t\nvelocities:\n"
        "- {velocity: [0.3, 0, 180], hold_s: 2}\n- {velocity: [0, 0.1, 0], hold_s: 1.5}\n"
    )
    assert isinstance(goals, Velocities)
    np.testing.assert_allclose(goals.targets(), [[0.3, 0.0, np.pi], [0.0, 0.1, 0.0]])
    np.testing.assert_allclose(goals.ends(), [2.0, 3.5])


@pytest.mark.parametrize("kind", PATHS)
def test_every_kind_of_path_can_be_written_down(read, kind):
    goals = read(
        f"kind: path\ntitle: t\nspeed: 0.2\nlook_ahead: 0.3\npath: {{kind: {kind}, {SIZES[kind]}}}\n"
    )
    assert type(goals.path) is PATHS[kind]
    assert goals.planner().closed == goals.path.closed


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("kind: position\ntitle: t\n", 1, "Did you mean 'positions'?"),
        ("kind: positions\ntitle: t\npositions: []\n", 1, "'positions' must have at least one entry."),
        (
            "kind: poses\ntitle: t\nposes: [[1, 2]]\n",
            1,
            "every entry of 'poses' must have 3 numbers, or 6 in space, all the same.",
        ),
        (
            "kind: positions\ntitle: t\npositions: [[1, 2], [1, 2, 3]]\n",
            1,
            "every entry of 'positions' must have 2 numbers, or 3 in space, all the same.",
        ),
        (
            "kind: velocities\ntitle: t\nvelocities:\n- {velocity: [0, 0], hold_s: 1}\n",
            1,
            "every entry of 'velocities' must have 3 numbers, or 6 in space, all the same.",
        ),
        ("kind: poses\ntitle: t\nposes: []\n", 1, "'poses' must have at least one entry."),
        ("kind: velocities\ntitle: t\nvelocities: []\n", 1, "'velocities' must have at least one entry."),
        (
            "kind: velocities\ntitle: t\nvelocities:\n- {velocity: [0, 0, 0], hold_s: 0}\n",
            4,
            "'hold_s' must be greater than 0.",
        ),
        (
            "kind: path\ntitle: t\nspeed: 0.2\nlook_ahead: 0.3\npath:\n  kind: circle\n  radius: -1\n",
            6,
            "'radius' must be greater than 0.",
        ),
        (
            "kind: path\ntitle: t\nspeed: 0\nlook_ahead: 0.3\npath: {kind: square, side: 1}\n",
            1,
            "speed, look_ahead",
        ),
        (
            "kind: path\ntitle: t\nspeed: 1\nlook_ahead: 0.3\nloops: -1\npath: {kind: square, side: 1}\n",
            1,
            "'loops' must not be negative",
        ),
        (
            "kind: path\ntitle: t\nspeed: 1\nlook_ahead: 1\npath: {kind: cirkle}\n",
            5,
            "Did you mean 'circle'?",
        ),
    ],
)
def test_mistakes_are_named_with_their_line(read, text, line, words):
    with pytest.raises(ConfigError) as caught:
        read(text)
    assert f"mine.yaml:{line}: " in str(caught.value)
    assert words in str(caught.value)


def test_an_unknown_name_gets_the_nearest_one():
    with pytest.raises(UnknownNameError, match=r"^unknown goal 'lab_circel'\. Did you mean 'lab_circle'\?$"):
        load_goals("lab_circel")
