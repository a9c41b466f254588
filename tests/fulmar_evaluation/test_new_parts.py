"""Classes of a user's own, made from templates: the pages show them, their tests pass, and mistakes are one line."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.loop.fallback import warm_up
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_evaluation.new_parts.new_part import PARTS, make_part, template, write_part
from policy_server.controllers import Choice, load_controller
from tests.own_files import blocks, own_folder

EACH = pytest.mark.parametrize("kind", PARTS)
NAME = "dock_gate"
SLOW = ("controller",)  # its test evaluates in a process of its own


@pytest.fixture
def folder(tmp_path, monkeypatch):
    with own_folder(tmp_path, monkeypatch):
        monkeypatch.syspath_prepend(str(tmp_path))
        monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=":")
        yield tmp_path


def test_of(path: Path) -> object:
    """The module of a test, as pytest imports it."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


test_of.__test__ = False


def run_tests(path: Path) -> int:
    """Call each test of a module, with each of its parameters.

    Returns:
        How many there were.
    """
    count = 0
    for name, function in vars(test_of(path)).items():
        if not name.startswith("test_"):
            continue
        marks = [mark for mark in getattr(function, "pytestmark", []) if mark.name == "parametrize"]
        for values in marks[0].args[1] if marks else [()]:
            function(*values)
            count += 1
    return count


@EACH
def test_the_page_shows_the_template(kind):
    part = PARTS[kind]
    shown = [*blocks(part.page, "python"), *blocks(part.page, "yaml")]
    for file in part.files:
        if not file.startswith("test_"):
            assert template(file) in shown, f"docs/{part.page} does not show {file}"


@EACH
def test_a_template_is_short(kind):
    assert 15 <= len(template(PARTS[kind].files[0]).splitlines()) <= 60


@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=pytest.mark.slow if kind in SLOW else ()) for kind in PARTS]
)
def test_what_is_written_runs_and_passes_its_test(kind, folder):
    made = make_part(kind, NAME, folder)
    write_part(made)
    assert made.path == "dock_gate:DockGate"
    assert "dock_gate:DockGate" in " ".join((*made.then, *made.files.values()))
    assert not any(PARTS[kind].module in text or PARTS[kind].cls in text for text in made.files.values())
    assert run_tests(folder / f"test_{NAME}.py") >= 1


def test_a_new_controller_answers_with_one_command_for_each_robot(folder):
    write_part(make_part("controller", NAME, folder))
    robot, task = load_robot("turtlebot2"), load_task("go_to_position")
    warm_up(load_controller("dock_gate:DockGate", robot, task, Choice(10.0)), robot, task)


@pytest.mark.parametrize("name", ["Dock", "dock-gate", "json", "class", "", "1dock", "x" * 65])
def test_a_name_that_no_module_can_have_is_refused(name, folder):
    with pytest.raises(ConfigError, match="must begin with a small letter"):
        make_part("task", name, folder)


def test_no_file_is_overwritten(folder):
    write_part(make_part("task", NAME, folder))
    with pytest.raises(ConfigError, match=r"dock_gate.py exists already; no file is overwritten"):
        make_part("task", NAME, folder)


def test_an_unknown_kind_is_refused_with_the_nearest(folder):
    with pytest.raises(ConfigError, match="Did you mean 'sensor'"):
        make_part("senser", NAME, folder)
