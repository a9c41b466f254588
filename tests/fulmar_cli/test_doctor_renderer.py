"""`fulmar doctor` on what draws the cameras of simulated robots."""

import pytest

from fulmar_cli.diagnosis.installation import check_renderer
from fulmar_core.config.errors import ConfigError
from sim_nodes.camera import opengl


def test_the_renderer_that_is_there_is_named(monkeypatch):
    monkeypatch.setattr(opengl, "find_platform", lambda: "osmesa")
    found = check_renderer()
    assert (found.level, found.found, found.fix) == ("ok", "osmesa", "")


def test_a_missing_renderer_is_advice_with_what_to_install(monkeypatch):
    def none():
        raise ConfigError(
            "no renderer for cameras (egl: gone). Run: sudo apt-get install libegl1 libgl1-mesa-dri"
        )

    monkeypatch.setattr(opengl, "find_platform", none)
    found = check_renderer()
    assert (found.level, found.ok) == ("advice", True)
    assert found.fix == "sudo apt-get install libegl1 libgl1-mesa-dri"
    assert found.found == "no renderer for cameras (egl: gone)."


@pytest.mark.parametrize(("value", "level"), [("elg", "wrong"), ("off", "advice")])
def test_a_wrong_mujoco_gl_ends_simulators_and_one_that_switches_off_does_not(value, level, monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", value)
    found = check_renderer()
    assert (found.level, found.fix) == (level, "unset MUJOCO_GL")
