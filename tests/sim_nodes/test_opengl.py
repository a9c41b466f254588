"""What draws images without a screen, and what is said where nothing does."""

import os
import signal
import subprocess
from types import SimpleNamespace

import pytest

from fulmar_cli.installation.extras import require
from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from fulmar_evaluation import evaluation
from fulmar_ros.plant_settings import PlantSettings
from sim_nodes.camera import opengl
from sim_nodes.sight import CameraSight
from sim_nodes.sim_node import make_backend


@pytest.fixture(autouse=True)
def plain(monkeypatch):
    """Without what the shell says of renderers."""
    for name in ("MUJOCO_GL", "PYOPENGL_PLATFORM"):
        monkeypatch.delenv(name, raising=False)
    opengl.first_of.cache_clear()


def refusal():
    with pytest.raises(ConfigError) as caught:
        opengl.find_platform()
    words = str(caught.value)
    assert "\n" not in words
    return words


def test_this_machine_can_draw():
    assert opengl.find_platform() in opengl.PLATFORMS


def test_an_unknown_platform_is_refused_with_the_nearest_name(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "elg")
    words = refusal()
    assert "MUJOCO_GL = 'elg'" in words and "Did you mean 'egl'?" in words and "osmesa" in words


def test_rendering_that_is_switched_off_is_named(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "disable")
    assert "MUJOCO_GL = 'disable' switches rendering off" in refusal()


def test_without_a_driver_the_packages_are_named(monkeypatch, tmp_path):
    monkeypatch.setenv("MUJOCO_GL", "egl")
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_DIRS", str(tmp_path))  # where the driver of Mesa is looked for
    words = refusal()
    assert words.startswith("no renderer for cameras (egl: ") and words.count("no renderer") == 1
    assert words.endswith("Run: sudo apt-get install libegl1 libgl1-mesa-dri")


@pytest.mark.parametrize(
    ("done", "words"),
    [
        (subprocess.CompletedProcess([], -signal.SIGSEGV, b"", b""), "it crashed, by signal 11"),
        (
            subprocess.CompletedProcess([], 1, b"", b"log\nCannot initialize a EGL device display\n"),
            "EGL device display",
        ),
        (subprocess.CompletedProcess([], 3, b"", b""), "exit code 3"),
        (subprocess.TimeoutExpired([], 60.0), "nothing within 60 s"),
    ],
)
def test_whatever_ends_the_probe_is_one_line(done, words, monkeypatch):
    def run(*_command, **_options):
        if isinstance(done, Exception):
            raise done
        return done

    monkeypatch.setattr(opengl.subprocess, "run", run)
    said = refusal()
    assert words in said
    assert said.endswith("Run: sudo apt-get install libegl1 libgl1-mesa-dri or libosmesa6")


def test_what_ends_a_context_is_one_line(monkeypatch):
    def broken(_name):
        raise AttributeError("'NoneType' object has no attribute 'glGetError'")

    monkeypatch.setattr(opengl, "import_module", broken)
    with (
        pytest.raises(ConfigError, match=r"osmesa: its library is not installed.*libosmesa6"),
        opengl.context("osmesa", 8, 8),
    ):
        pass


def test_the_probe_leaves_the_environment_as_it_is():
    before = dict(os.environ)
    opengl.problem_of("egl")
    assert dict(os.environ) == before


def test_a_simulator_is_not_loaded_with_a_platform_that_ends_it(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "elg")
    robot = load_robot("floating_platform")
    with pytest.raises(ConfigError, match="MUJOCO_GL = 'elg'"):
        make_backend(robot, PlantSettings(robot=robot.name, task="go_to_pose", backend="mujoco"))
    trial = SimpleNamespace(through="mujoco")
    for value, words in (("elg", "MUJOCO_GL = 'elg'"), ("osmesa", "cannot be loaded with it")):
        monkeypatch.setenv("MUJOCO_GL", value)
        monkeypatch.setattr(opengl, "problem_of", lambda platform: "its library is not installed")
        with pytest.raises(ConfigError, match=words):
            evaluation._simulator(trial, robot, load_task("go_to_pose"), load_scenario("nominal"))
        with pytest.raises(ConfigError, match=value):
            CameraSight(load_robot("cubesat_8"), load_task("dock"))


def test_a_command_that_needs_mujoco_is_refused_before_anything_begins(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "elg")
    require("matplotlib")
    with pytest.raises(ConfigError, match="Did you mean 'egl'"):
        require("matplotlib", "mujoco")
