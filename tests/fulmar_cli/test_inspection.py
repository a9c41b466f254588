"""Inspections that cannot be flown: one line with exit code 2, before anything starts."""

from __future__ import annotations

import pytest

from fulmar_core.config.paths import OWN_FOLDERS, config_path
from tests.fulmar_cli.command_line import complaint

RUN = ("run", "cubesat_8", "--task", "inspect", "--controller", "pd", "--lockstep")
EVALUATE = ("evaluate", "cubesat_8", "inspect", "--controller", "pd")


@pytest.fixture
def own_files(tmp_path, monkeypatch):
    """Tasks of the user's own that ask for too much, and a thing that has no part."""
    shipped = config_path("tasks", "inspect").read_text(encoding="utf-8").replace("name: inspect", "name: {}")
    for name, old, new in (
        ("near", "radius: 1.5", "radius: 1.1"),
        ("fast", "  speed: 0.2", "  fixed: 0.4\n  speed: 0.2"),
        ("tight", "  speed: 0.2", "  fixed: 0.25\n  speed: 0.2"),
    ):
        text = shipped.format(name).replace(old, new)
        text = text.replace("radius: 1.5", "radius: 0.5") if name == "tight" else text
        (tmp_path / "tasks").mkdir(exist_ok=True)
        (tmp_path / "tasks" / f"{name}.yaml").write_text(text, encoding="utf-8")
    (tmp_path / "things").mkdir()
    (tmp_path / "things" / "bare.yaml").write_text(
        "title: nothing\nscale: 1.0\nsources: {}\nparts: []\n", encoding="utf-8"
    )
    monkeypatch.setenv(OWN_FOLDERS, str(tmp_path))


@pytest.mark.parametrize("command", [RUN, EVALUATE])
@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--path", "circl"), "unknown path 'circl'. Did you mean 'circle'?"),
        (("--thing", "gatewai"), "unknown thing 'gatewai'. Did you mean 'gateway'?"),
    ],
)
def test_an_unknown_path_or_thing_is_said_with_the_nearest_name(fulmar, command, options, words):
    assert words in complaint(fulmar(*command, *options))


@pytest.mark.parametrize(
    ("task", "words"),
    [
        ("near", "the circle about 'gateway' comes to -0.13 m from the keep-out volume"),
        ("fast", "moves by 0.4 m/s, and tasks of 'cubesat_8' ask for 0.3 m/s at most"),
        ("tight", "bends so hard that 0.25 m/s takes 0.0977 m/s², and 'cubesat_8' sustains 0.06 m/s²"),
    ],
)
def test_a_path_through_the_keep_out_volume_or_too_fast_is_refused(fulmar, own_files, task, words):
    assert words in complaint(fulmar("run", "cubesat_8", "--task", task, "--controller", "pd", "--lockstep"))


def test_a_thing_without_a_surface_is_refused(fulmar, own_files):
    assert "a thing without a surface cannot be inspected" in complaint(fulmar(*RUN, "--thing", "bare"))


def test_what_has_no_path_and_what_flies_in_no_space_take_none(fulmar):
    pose = complaint(fulmar("run", "cubesat_8", "--task", "go_to_pose_3d", "--path", "circle"))
    assert "task 'go_to_pose_3d' has no path to choose. Leave --path out." in pose
    rover = complaint(fulmar("run", "turtlebot2", "--task", "go_to_pose", "--thing", "gateway"))
    assert "'gateway' stands in space, and task 'go_to_pose' is for robots that do not fly there" in rover
