"""`fulmar new robot` and its kin: what they write, and one line for each mistake, before anything is written."""

from __future__ import annotations

import io
import json

import pytest

from fulmar_core.config.paths import OWN_FOLDERS
from fulmar_core.robots.robot_file import load_robot_file
from tests.fulmar_cli.command_line import complaint
from tests.robot_files import TURTLE, new_platform


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv(OWN_FOLDERS, raising=False)
    return tmp_path


@pytest.mark.parametrize("count", [3, 4])
def test_four_thrusters_are_the_least_that_is_controllable(count, fulmar, folder):
    code, said, _ = fulmar(*new_platform(count))
    assert code == 0
    assert f"wrote mine/robots/with_{count}.yaml" in said
    assert f"export FULMAR_CONFIGS={folder / 'mine'}" in said
    assert f"fulmar check robot with_{count}" in said
    _, checked, _ = fulmar("check", "robot", f"mine/robots/with_{count}.yaml", "--json")
    assert json.loads(checked)["controllable"] is (count == 4)


def test_what_was_not_taken_is_listed_and_in_the_json(fulmar, folder):
    (folder / "turtle.urdf").write_text(TURTLE)
    words = ("new", "robot", "turtle", "--like", "turtlebot2", "--urdf", "turtle.urdf")
    _, said, _ = fulmar(*words)
    assert "not taken: actuators.wheel_force: the wheels' joints have no 'effort'" in said
    _, text, _ = fulmar(*words, "--force", "--json")
    found = json.loads(text)
    assert found["file"] == "mine/robots/turtle.yaml"
    assert {"key", "why", "write"} == set(found["not_taken"][0])
    assert any(step.startswith("fulmar identify runs/turtle") for step in found["steps"])


def test_it_goes_into_the_first_folder_of_one_s_own(fulmar, folder, monkeypatch):
    (folder / "ours" / "robots").mkdir(parents=True)
    monkeypatch.setenv(OWN_FOLDERS, str(folder / "ours"))
    assert fulmar("new", "robot", "spare", "--like", "jetbot")[0] == 0
    assert (folder / "ours" / "robots" / "spare.yaml").is_file()
    assert "spare" in fulmar("list", "robots")[1]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("jetbot", "--like", "jetbot"), "comes with a robot 'jetbot'"),
        (("mine", "--like", "jetbott"), "unknown robot 'jetbott'. Did you mean 'jetbot'?"),
        (("mine", "--like", "jetbot", "--urdf", "none.urdf"), "none.urdf: cannot be read"),
        (("mine", "--like", "jetbot", "--mjcf", "none.xml"), "none.xml: cannot be read"),
        (("mine", "--like", "jetbot", "--set", "body.mas=1"), "unknown key 'mas'"),
        (("mine", "--like", "jetbot", "--set", "body.mass=300"), "'body.mass' = 300 kg"),
    ],
)
def test_a_mistake_is_one_line_and_nothing_is_written(words, said, fulmar, folder):
    assert said in complaint(fulmar("new", "robot", *words))
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("kind", ["task", "controller", "driver", "estimator", "sensor"])
def test_a_class_is_written_with_its_test_and_what_to_do_next(kind, fulmar, folder):
    code, text, _ = fulmar("new", kind, "dock_gate", "--json")
    found = json.loads(text)
    assert code == 0
    assert found["class"] == "dock_gate:DockGate"
    assert set(found["files"]) >= {"dock_gate.py", "test_dock_gate.py"}
    assert found["next"][0] == "python -m pytest test_dock_gate.py"
    assert "already; no file is overwritten" in complaint(fulmar("new", kind, "dock_gate"))


class Terminal(io.StringIO):
    """Standard input of a person."""

    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(("answer", "track"), [("motor_a, motor_b", 0.24), ("", 0.23)])
def test_a_person_is_asked_for_names_that_no_word_gives(answer, track, fulmar, folder, monkeypatch):
    renamed = TURTLE.replace("left_wheel", "motor_a").replace("right_wheel", "motor_b")
    (folder / "turtle.urdf").write_text(renamed)
    monkeypatch.setattr("sys.stdin", Terminal(f"{answer}\n"))
    code, said, _ = fulmar("new", "robot", "mine", "--like", "turtlebot2", "--urdf", "turtle.urdf")
    assert code == 0
    assert "Which links, sites or joints of the file move it? (NAME,NAME; nothing: as turtlebot2)" in said
    assert load_robot_file(folder / "mine" / "robots" / "mine.yaml").actuators.track == track


def test_a_script_is_not_asked(fulmar, folder, monkeypatch):
    (folder / "turtle.urdf").write_text(TURTLE.replace("_wheel", "_disc"))
    monkeypatch.setattr("sys.stdin", io.StringIO())
    _, said, _ = fulmar("new", "robot", "mine", "--like", "turtlebot2", "--urdf", "turtle.urdf")
    assert "Which links" not in said
    assert "name them: --actuators LEFT,RIGHT" in said
